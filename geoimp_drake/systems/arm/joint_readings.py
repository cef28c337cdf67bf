"""Joint readings: sampled positions, with measured or differenced velocities."""

from geoimp_drake.parts.joint_readings import Readings
from geoimp_drake.systems.part_system import PartSystem
from geoimp_drake.typing import Array

__all__ = ["JointReadings"]


class JointReadings(PartSystem):
    """Samples the joint state of an arm; its velocity is measured or differenced.

    At every sampling instant t_k it reads [q; v] and holds until the next one

        q̂ = q(t_k),   v̂ = v(t_k)  or  v̂ = (q(t_k) − q(t_k−1)) / (t_k − t_k−1).

    The readings at initialization and at the first instant keep the measured v in both cases. So a
    controller switched on while the arm moves sees no step in velocity. Before a simulator has
    initialized the context, the reading passes through.

    A resolver of a joint that turns may jump by whole turns. Where `turns` says so, the reading
    goes on without the jump, and so does the difference. The plant's period has to divide the
    sampling period. Otherwise some samples find the plant where it was, and differences of zero
    alternate with others. Controllers check that.

    Args:
        num_positions: n; the joints have one position for each velocity.
        period: sampling period [s].
        velocity: `measured` or `differenced`.
        turns: one for each joint that turns, zero for one that slides (n); by default all zero.

    Raises:
        ConfigurationError: the period is not positive or the velocity source is unknown.
        SignalError: the state at the port is NaN or infinite.

    Ports:
        input state: [q; v] (2n) [rad or m; rad/s or m/s]
        output estimated_state: [q̂; v̂] (2n)
    """

    def __init__(
        self,
        num_positions: int,
        period: float = 1e-3,
        velocity: str = "measured",
        turns: Array | None = None,
    ):
        super().__init__(Readings(num_positions, period, velocity, turns))
