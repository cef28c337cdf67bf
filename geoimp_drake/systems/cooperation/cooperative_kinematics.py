"""Motion, wrench and internal wrench of an object, from the two hands that hold it."""

from geoimp_drake.parts.object_kinematics import ObjectKinematics
from geoimp_drake.parts.object_load import LoadArguments, ObjectLoad
from geoimp_drake.systems.part_system import PartSystem
from geoimp_drake.typing import Array

__all__ = ["CooperativeKinematics"]


class CooperativeKinematics(PartSystem):
    """Reads the motion and the wrench of an object from those of the two hands that hold it.

    The motion of the object is (4.1), (4.4), (4.5); that of the second hand relative to the first
    is (4.7), (4.8), (4.9),

        p_o = ½(p_1 + p_2),  Q_o = Q_1 * {cos(ϑ_21/4), sin(ϑ_21/4) ¹r_21},  v_o = ½(v_1 + v_2)
        Δp_21 = p_2 − p_1,   ¹Q_21 = Q_1⁻¹ * Q_2,                            Δv_21 = v_2 − v_1

    The wrench on the environment (4.6) follows from the full grasp matrix, or from the sum as
    printed. The object's weight and inertial load are removed from it. The internal wrench is h_i,

        f_o = Σ f_k − m (a − g),   μ_o = Σ (μ_k + (p_k − p_o) × f_k) − p_OG × m (a − g) − …
        h_i = ½(h_2 − h_1),        each moment about its own hand.

    The internal wrench is given in W and also in the frames of the mutual pose, for
    `InternalImpedance`. Of the two signs of ¹Q_21 it takes the one nearer to the mutual reference.

    Frames: W world, O object, G its centre of mass, 1 and 2 the end effectors.

    Args:
        load: mass, centre of mass and inertia of the object.
        gravity: g in W (3) [m/s²].
        wrench: `grasp-matrix` or `printed`.

    Raises:
        ConfigurationError: a field of the load, the gravity or the wrench's name cannot be used.
        SignalError: an input is NaN or infinite, or a quaternion is not unit.
        OutOfDomainError: the hands have turned by more than 355° against each other.

    Ports:
        input motion_1: of the first hand in W (19)
        input motion_2: of the second (19)
        input wrench_1: h = [μ; f] by the first hand on its environment, about its origin, in W (6)
        input wrench_2: the same by the second, about its own origin (6)
        input mutual_reference: ¹Q_21 of the grasp in its first four entries (19)
        input reference_motion: of O, for its inertial load; if not connected, the weight alone (19)
        input slack_1: acceleration of the first hand that its limits leave undone, or zero (6)
        input slack_2: the same of the second (6)
        output object_motion: of O in W; accelerations are the means of the hands' (19)
        output object_wrench: h_o = [μ; f] by the object on its environment, about Oo, in W (6)
        output internal_wrench: h_i = [μ; f], in W (6)
        output mutual_motion: ¹Q_21, ᵒΔp_21, ¹ω_21, ᵒΔṗ_21, see `InternalImpedance` (19)
        output mutual_wrench: the internal wrench [¹μ; ᵒf] (6)
        output object_slack: of the object, for `ImpedanceIntegrator` (6)
        output mutual_slack: of the mutual pose in its frames, for `InternalImpedance` (6)
    """

    def __init__(
        self,
        load: ObjectLoad | None = None,
        gravity: Array | None = None,
        wrench: str = "grasp-matrix",
    ):
        super().__init__(ObjectKinematics(LoadArguments(load, gravity, wrench)))
