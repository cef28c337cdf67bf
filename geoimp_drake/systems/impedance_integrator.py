"""The six-DOF impedance: integrates the motion of the compliant frame C from D and the wrench."""

from geoimp_drake.laws.impedance.families import OrientationImpedance
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.systems.part_system import FlowingPartSystem
from geoimp_drake.typing import Array

__all__ = ["ImpedanceIntegrator"]


class ImpedanceIntegrator(FlowingPartSystem):
    """Makes the frame C behave as a mass, damper and spring that the wrench deflects from D.

    Translation (3.1) and rotation, by the family that is given (quaternion: (3.30)),

        M_p Δp̈_dc + D_p Δṗ_dc + K_p Δp_dc = f
        M_o Δᶜω̇_dc + D_o Δᶜω_dc + K'_o ᶜε_dc = ᶜμ,   K'_o = 2 Eᵀ(η_dc, ᶜε_dc) K_o  (3.31)

    are solved for the acceleration of C, which is integrated; Δ is "D minus C". The orientation is
    propagated by its quaternion, Q̇ = ½ [−εᵀ; E(η, ε)] ω_c. The state's quaternion is normalized
    before every step. A term in Q̇ that pulls the norm to one would be integrated with the
    integrator's own error. At 1 ms and 2 rad/s this leaves a norm error of 4e-7.

    At a simulator's first step C starts at rest on the measured pose of E. So it does before that
    step, too, so that the ports can be evaluated without a simulator. Initialize the simulator
    again to restart C on E after another controller has moved the arm.

    With a coupling K_c (laws/coupled_stiffness.py) translation and rotation load each other; K_p is
    then in D instead of W. With `translation_axes` desired, M_p, D_p and K_p are all in D and turn
    with it. The stiffness then stores the work of D's turning, which no wrench supplied.

    Near a singularity of the family's Euler angles, where cond(T) exceeds 10, a warning is logged
    once. At the singularity, or beyond ϑ_M of an angle/axis family, a named error is raised.

    The result of a plant's last step belongs to the motion of C when that step began. The state
    holds this motion, so that an inertial load taken from it makes no algebraic loop with the
    wrench.

    Frames: W world, D desired, C compliant, E end effector.

    Args:
        M_p, D_p, K_p: symmetric positive definite (3×3) [kg, Ns/m, N/m].
        rotation: the orientation family with its gains.
        axes: `both`, or `translation` / `rotation` for an impedance on one part only; the other
            part of C then equals D. With `none` C is D: plain motion control, for comparison.
        K_c: coupling (3×3), in D [N]; for the quaternion family on both parts only.
        translation_axes: those of M_p, D_p and K_p: `world` or `desired`.

    Raises:
        ConfigurationError: a gain is not symmetric positive definite, `axes` is unknown, or the
            coupling makes the 6×6 stiffness indefinite or does not fit the family.
        SignalError: an input is NaN or infinite, a quaternion is not unit, or C has diverged.
        SingularityError: the attitude leaves the domain of the orientation family.

    Ports:
        input desired_motion: of D in W (19)
        input wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6)
        input measured_motion: of E in W, read until the first step only (19)
        input stiffness_scale: factors of K_p and K_o, one each if not connected (2)
        input stiffness: K (6×6) row by row, [angular; linear], as configured if not connected (36)
        input damping: D (6×6), the same (36)
        input damping_scale: factor of D, one if not connected (1)
        input slack: acceleration left undone by limits, to hold C back; zero if not connected (6)
        output compliant_motion: of C in W (19)
        output last_compliant_motion: of C when the last step began; no direct feedthrough (19)
        output displacement: [orientation displacement of the family; Δp_dc] (6) [-, m]
        output energy: ImpedanceEnergy: energies [J] and powers [W] of both parts (9)
    """

    def __init__(
        self,
        M_p: Array,
        D_p: Array,
        K_p: Array,
        rotation: OrientationImpedance,
        axes: str = "both",
        K_c: Array | None = None,
        translation_axes: str = "world",
    ):
        super().__init__(
            Impedance(M_p, D_p, K_p, rotation, axes, K_c, translation_axes=translation_axes)
        )
