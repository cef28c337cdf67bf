"""Joint readings as a laboratory takes them: sampled positions, velocities by differencing."""

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.motion_control.joint_reading import next_reading
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.frame_motion import check_signal
from geoimp_drake.typing import Array

__all__ = ["VelocityEstimator"]


class VelocityEstimator(Block):
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

    def __init__(
        self,
        num_positions: int,
        period: float = 1e-3,
        velocity: str = "measured",
    ):
        super().__init__()
        if not (np.isfinite(period) and period > 0):
            raise ConfigurationError(f"The sampling period is {period:g} s; it must be positive.")
        if velocity not in ("measured", "differenced"):
            raise ConfigurationError(
                f"Unknown velocity source '{velocity}'; valid ones: measured, differenced."
            )
        self._n = num_positions
        self._period = period
        self._law = compiled(next_reading)
        self._differenced = velocity == "differenced"
        self._state = self.DeclareVectorInputPort("state", 2 * num_positions)
        # The held reading and, last, how many there have been: none, the first, more.
        held = self.declare_state(2 * num_positions + 1)
        self.DeclareVectorOutputPort(
            "estimated_state",
            2 * num_positions,
            self._calc_reading,
            prerequisites_of_calc={
                self.ticket_of_state(held),
                self.input_port_ticket(self._state.get_index()),
            },
        )
        self.DeclareInitializationDiscreteUpdateEvent(self._first_reading)
        # Without offset, so that its instants are those of the plant's steps to the last bit.
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._next_reading)

    @property
    def period(self) -> float:
        """The sampling period [s]."""
        return self._period

    @property
    def is_differenced(self) -> bool:
        """Whether the velocity is that of the positions' differences."""
        return self._differenced

    def _calc_reading(self, context: Context, output: BasicVector) -> None:
        held = context.get_discrete_state_vector().value()
        output.SetFromVector(held[:-1] if held[-1] else self._state.Eval(context))

    def _first_reading(self, context: Context, state: DiscreteValues) -> EventStatus:
        state.set_value(np.append(self._read(context), 1.0))
        return EventStatus.Succeeded()

    def _next_reading(self, context: Context, state: DiscreteValues) -> None:
        reading = self._state.Eval(context)
        held, after = context.get_discrete_state_vector().value(), state.get_mutable_value()
        if not self._law(reading, held, self._period, self._differenced, after):
            self._check(reading)

    def _read(self, context: Context) -> Array:
        reading: Array = self._state.Eval(context)
        self._check(reading)
        return reading

    def _check(self, reading: Array) -> None:
        check_signal(reading, f"{self.get_name()}:state")
