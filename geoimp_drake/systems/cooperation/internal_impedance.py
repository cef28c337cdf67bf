"""The impedance between two hands, which bounds the squeeze that an error of their poses causes."""

from geoimp_drake.laws.impedance.families import QuaternionImpedance
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.systems.part_system import FlowingPartSystem
from geoimp_drake.typing import Array
from geoimp_drake.validation import spd_matrix

__all__ = ["InternalImpedance"]


class InternalImpedance(FlowingPartSystem):
    """Moves the mutual pose that two hands hold, as the internal wrench pushes it.

    These are the laws (3.1) and (3.30) with the internal wrench h_i = ½(h_2 − h_1). The mutual pose
    of the grasp takes the place of D, and the one that the references follow takes that of C:

        M Δp̈ + D Δṗ + K Δp = ᶜf_i,            Δp = ᶜΔp_21 − ᶜΔp_r21
        M_o Δω̇ + D_o Δω + 2EᵀK_o ε = ᶜμ_i,    {η, ε} the quaternion of ¹Q_r21⁻¹ * ¹Q_21

    Hands that squeeze push against Δp_21, so Δp_r21 grows and the squeeze falls to K times the
    error of the grasp. The mutual position is that of the object's frame, ᶜΔp_r21 in C's axes. The
    mutual orientation ¹Q_r21 is that of the second hand in the first, with its angular velocity in
    the first hand's axes. The power of h_i on the mutual velocity (4.9) is the power in these
    coordinates. `CooperativeReferenceGenerator` gives half of it to each hand, with velocity and
    acceleration.

    It starts at rest on the measured mutual pose, so the references start on the hands whatever the
    grasp's pose is assumed to be.

    Frames: 1 and 2 the hands, C the compliant object. In a motion of (19) the quaternion here is
    ¹Q_21 and the position ᶜΔp_21. The rest are their angular and linear velocities and
    accelerations.

    Args:
        M, D, K: of translation, symmetric positive definite (3×3) [kg, Ns/m, N/m].
        M_o, D_o, K_o: of rotation (3×3) [kg m², Nms/rad, Nm/rad].
        axes: `both`, `translation`, `rotation` or `none`; the part left out keeps the grasp's pose.

    Raises:
        ConfigurationError: a gain is not symmetric positive definite, or `axes` is unknown.
        SignalError: an input is NaN or infinite, a quaternion is not unit, or the motion diverged.

    Ports:
        input desired_motion: the mutual pose of the grasp, at rest (19)
        input wrench: the internal wrench [¹μ; ᵒf] (6) [Nm, N]
        input measured_motion: the measured mutual motion, read until the first step only (19)
        input stiffness_scale: factors of K and K_o, one each if not connected (2)
        input stiffness: K (6×6) row by row, [angular; linear], as configured if not connected (36)
        input damping: D (6×6), the same (36)
        input damping_scale: factor of D, one if not connected (1)
        input slack: acceleration left undone by limits, to hold C back; zero if not connected (6)
        output compliant_motion: the mutual motion for the references (19)
        output last_compliant_motion: the same when the last step began (19)
        output displacement: [ε; Δp], the grasp's mutual pose from that of the references (6) [-, m]
        output energy: ImpedanceEnergy: energies [J] and powers [W] of both parts (9)
    """

    def __init__(
        self,
        M: Array,
        D: Array,
        K: Array,
        M_o: Array,
        D_o: Array,
        K_o: Array,
        axes: str = "both",
    ):
        rotation = QuaternionImpedance(
            spd_matrix(M_o, "M_o"), spd_matrix(D_o, "D_o"), spd_matrix(K_o, "K_o")
        )
        super().__init__(Impedance(M, D, K, rotation, axes))
