"""From the compliant motion of an object to the motions of the two hands that hold it."""

from geoimp_drake.parts.grasp import GraspPose, HandReferences, MutualPose
from geoimp_drake.systems.part_system import PartSystem

__all__ = ["CooperativeReferenceGenerator"]


class CooperativeReferenceGenerator(PartSystem):
    """Computes the motions (4.10)-(4.15) of two hands that make their object move as C does.

        (4.10), (4.11)  p_r1 = p_c − ½ Δp_r21,   p_r2 = p_c + ½ Δp_r21
        (4.12), (4.13)  Q_r1 = Q_c * {cos(ϑ_r21/4), −sin(ϑ_r21/4) ¹r_r21},   Q_r2 = Q_r1 * ¹Q_r21
        (4.14), (4.15)  v_r1 = v_c − ½ Δv_r21,   v_r2 = v_c + ½ Δv_r21

    with accelerations that are their derivatives. The mutual pose ¹Q_r21, ᶜΔp_r21 = R_cᵀΔp_r21 is
    constant in C, and is prescribed or measured. It is measured at a simulator's first step, and
    also before it, so that the ports can be evaluated without a simulator. Initialize the simulator
    again to measure it again.

    If `mutual_motion` is connected, it replaces the constant mutual pose (see `InternalImpedance`).
    The references' velocities and accelerations then include the motion of the mutual pose.

    Frames: W world, C compliant (where the object O has to be), 1 and 2 the end effectors.

    Args:
        prescribed: the mutual pose; by default that of the measured motions at the start.

    Raises:
        ConfigurationError: the prescribed pose cannot be used.
        SignalError: an input is NaN or infinite, or a quaternion is not unit.
        OutOfDomainError: the hands' references turn by more than 355° against each other.

    Ports:
        input compliant_motion: of C in W (19)
        input measured_motion_1: of the first hand in W, read until the first step only (19)
        input measured_motion_2: of the second (19)
        input mutual_motion: ¹Q_r21, ᶜΔp_r21 and their derivatives; optional (19)
        output reference_motion_1: of the first hand in W (19)
        output reference_motion_2: of the second (19)
        output mutual_reference: the constant mutual pose ¹Q_21, ᵒΔp_21, at rest (19)
    """

    def __init__(self, prescribed: MutualPose | None = None):
        super().__init__(HandReferences(GraspPose(prescribed)))
