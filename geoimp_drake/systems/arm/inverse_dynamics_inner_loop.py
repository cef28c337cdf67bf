"""Inverse dynamics: joint torques that make the arm a set of double integrators."""

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.parts.torque import Torque
from geoimp_drake.systems.part_system import PartSystem

__all__ = ["InverseDynamicsInnerLoop"]


class InverseDynamicsInnerLoop(PartSystem):
    """Computes the driving torques (2.3) τ = Bα + Cq̇ + Fq̇ + g + Jᵀh, giving (2.4) q̈ = α.

    The torques are not limited here: Drake's actuators clamp at their effort limits. This system
    logs a warning the first time that a torque exceeds its joint's limit.

    Args:
        model: the arm's control model.

    Raises:
        SignalError: an input is NaN or infinite.

    Ports:
        input joint_acceleration: α (n) [rad/s² or m/s²]
        input arm: ArmState
        input wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6)
        output actuation: τ in the order of the model instance's actuators (n) [Nm or N]
        output peak_effort: largest torque since the start as a fraction of the limit (n)
    """

    def __init__(self, model: ControlModel):
        super().__init__(Torque(model))
