"""Joint readings: sampled positions, with measured or differenced velocities."""

from geoimp_drake.parts.joint_readings import Readings
from geoimp_drake.systems.part_system import PartSystem

__all__ = ["JointReadings"]


class JointReadings(PartSystem):
    """Samples the joint state of an arm; its velocity is measured or differenced.

    At every sampling instant t_k it reads [q; v] and holds until the next one

        q̂ = q(t_k),   v̂ = v(t_k)  or  v̂ = (q(t_k) − q(t_k−1)) / (t_k − t_k−1).

    The readings at initialization and at the first instant keep the measured v in both cases, so
    that a controller switched on while the arm moves sees no step in velocity. Before a simulator
    has initialized the context the reading passes through.

    Args:
        num_positions: n; the joints have one position for each velocity.
        period: sampling period [s].
        velocity: `measured` or `differenced`.

    Raises:
        ConfigurationError: the period is not positive or the velocity source is unknown.
        SignalError: the state at the port is NaN or infinite.

    Ports:
        input state: [q; v] (2n) [rad or m; rad/s or m/s]
        output estimated_state: [q̂; v̂] (2n)
    """

    def __init__(self, num_positions: int, period: float = 1e-3, velocity: str = "measured"):
        super().__init__(Readings(num_positions, period, velocity))
