"""The six-DOF impedance of E with the arm's own inertia, from D and the arm: no wrench."""

from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.natural_impedance import NaturalImpedance as Part
from geoimp_drake.systems.part_system import PartSystem

__all__ = ["NaturalImpedance"]


class NaturalImpedance(PartSystem):
    """(3.1 natural) Makes E a spring and a damper about D, with the arm's own inertia at E.

        Λ(q)Δv̇ + D(q)Δv + K(Δ) = h,   Λ⁻¹ = J B⁻¹ Jᵀ,   Δ = "D minus E"

    The elastic wrench K(Δ) is that of (3.1) and of any orientation family. The damping is designed
    in each step from Λ(q) and the stiffness where E equals D, so that every mode has the damping
    ratio ζ. The acceleration a = [ω̇_d; p̈_d] + Λ⁻¹(DΔv + K(Δ)) needs no wrench, if Jᵀh is left out
    of (2.3): `InverseDynamicsInnerLoop` then takes a wrench of zero.

    As in `DirectImpedance`, its output, the motion of C, is the pose and the velocity of E with
    this acceleration. The remark there on model errors holds here, too.

    Frames: W world, D desired, C compliant, E end effector.

    Args:
        springs: the impedance; its stiffness and orientation family are used.
        damping_ratio: ζ of every mode, 1 for critical damping.

    Raises:
        ConfigurationError: ζ is not positive.
        SignalError: an input is NaN or infinite, or a quaternion is not unit.
        SingularityError: the attitude leaves the domain of the orientation family.

    Ports:
        input desired_motion: of D in W (19)
        input arm: ArmState
        input wrench: h = [μ; f], for the supplied power alone; it may stay unconnected (6)
        input stiffness_scale: factors of K_p and K_o, one each if not connected (2)
        input slack: C's acceleration that limits leave undone; zero if not connected (6)
        output compliant_motion: of C in W: E, with the acceleration that the law asks for (19)
        output last_compliant_motion: of C when the last step began; no direct feedthrough (19)
        output displacement: [orientation displacement of the family; Δp_dc] (6) [-, m]
        output energy: ImpedanceEnergy: energies [J] and powers [W] of both parts (9)
    """

    def __init__(self, springs: Impedance, damping_ratio: float = 1.0):
        super().__init__(Part(springs, damping_ratio))
