"""The six-DOF impedance of E itself, from D, the wrench and the motion of E: no state."""

from geoimp_drake.parts.direct_impedance import DirectImpedance as Part
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.systems.part_system import PartSystem

__all__ = ["DirectImpedance"]


class DirectImpedance(PartSystem):
    """(3.1 direct) Makes E itself a mass, damper and spring that the wrench deflects from D.

    The law is that of `ImpedanceIntegrator`, with the measured E in the place of C. (3.1) and
    (3.30), solved for the acceleration, give the a of (2.5) that makes them the closed loop of E,

        a = [ω̇_d; p̈_d] + M⁻¹(D Δv + K Δ − h),   Δ = "D minus E"

    with every orientation family. Its output, the motion of C, is the pose and the velocity of E
    with that acceleration. A `MotionController` that tracks it finds no error and passes the
    acceleration on. A part without impedance (translation or rotation) follows D and is tracked as
    usual.

    A model error or friction in the joints moves E as a wrench on it does: the softer the
    impedance, the farther. See `ImpedanceIntegrator` for the scheme that the chapter recommends.

    Frames: W world, D desired, C compliant, E end effector.

    Args:
        springs: gains and orientation family.

    Raises:
        SignalError: an input is NaN or infinite, or a quaternion is not unit.
        SingularityError: the attitude leaves the domain of the orientation family.

    Ports:
        input desired_motion: of D in W (19)
        input wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6)
        input measured_motion: of E in W (19)
        input stiffness_scale: factors of K_p and K_o, one each if not connected (2)
        input stiffness: K (6×6) row by row, [angular; linear], as configured if not connected (36)
        input damping: D (6×6), the same (36)
        input damping_scale: factor of D, one if not connected (1)
        input slack: C's acceleration that limits leave undone; zero if not connected (6)
        output compliant_motion: of C in W: E, with the acceleration that the law asks for (19)
        output last_compliant_motion: of C when the last step began; no direct feedthrough (19)
        output displacement: [orientation displacement of the family; Δp_dc] (6) [-, m]
        output energy: ImpedanceEnergy: energies [J] and powers [W] of both parts (9)
    """

    def __init__(self, springs: Impedance):
        super().__init__(Part(springs))
