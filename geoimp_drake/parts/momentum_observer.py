"""External joint torques and the wrench at the end effector, without a wrist sensor."""

from dataclasses import dataclass, field

import numpy as np

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.dynamics import ChainDynamics
from geoimp_drake.compilation.compiled import bound
from geoimp_drake.laws.compositions.momentum_observation import (
    external_wrench,
    momentum_observation,
)
from geoimp_drake.parts.part import Memory, Now, Output, held
from geoimp_drake.parts.signals import check_signal
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, finite_array, key, non_negative, positive

__all__ = ["MomentumObserver", "MomentumObserverConfig"]


@dataclass
class MomentumObserverConfig:
    """How the external torques are observed."""

    gain: float = 100.0  # K: an external torque shows with a time constant of 1/K [1/s]
    tare: float = 0.0  # time at rest at the start, whose residual is subtracted; zero for none [s]
    threshold: Array = field(default_factory=lambda: np.array(3.5))  # of a collision [Nm, N]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        positive(self.gain, key(name, "gain"), "1/s")
        non_negative(self.tare, key(name, "tare"), "s")
        for threshold in np.atleast_1d(self.threshold):
            positive(threshold, key(name, "threshold"))


class MomentumObserver:
    """The part of `systems.sensing.MomentumObserver`; arguments and errors are the same."""

    def __init__(
        self,
        model: ControlModel,
        config: MomentumObserverConfig | None = None,
        period: float = 1e-3,
    ):
        config = config or MomentumObserverConfig()
        check(config, "observer")
        n = model.num_joints
        self._config = config
        threshold = (
            np.full(n, config.threshold) if np.ndim(config.threshold) == 0 else config.threshold
        )
        self._threshold = finite_array(threshold, "observer.threshold", (n,))
        arm, order = ChainDynamics(model).arguments, model.state_order
        self._law = bound(momentum_observation(n), *arm, order, model.actuation_order)
        self._wrench = bound(external_wrench, *arm, order)
        self.period = period
        self.inputs = {"estimated_state": 2 * n, "torque": n}
        self.memory = Memory(
            begun=0.0,  # when it started
            time=np.nan,  # of the last sample
            momentum=np.zeros(n),
            forces=np.zeros(n),
            residual=np.zeros(n),
            tared=np.zeros(n),  # the residual at rest
            tare_samples=0.0,
            wrench=np.zeros(6),
        )
        self.samplings = ((period, self.sample),)
        self.outputs = (
            Output("external_torque", n, self._write_torque, ("memory",)),
            held("wrench", self.memory.wrench),
            Output("collision", 1, self._write_collision, ("memory",)),
        )

    def start(self, memory: Array, now: Now) -> None:
        """Takes the first reading."""
        memory[self.memory.begun] = now.time
        self.sample(memory, now)

    def sample(self, memory: Array, now: Now) -> None:
        """Advances the observer to a reading, with the torque over the step that led to it.

        Raises:
            SignalError: the reading or the torque is NaN or infinite.
        """
        self.observe(memory, now)
        self._tare(memory, now.time - memory[self.memory.begun])
        external = self._external(memory)
        self._wrench(now["estimated_state"], external, memory[self.memory.wrench])

    def observe(self, memory: Array, now: Now, *, is_held: bool = False) -> None:
        """Advances the residual to a reading; with `is_held` it takes the reading alone.

        Args:
            memory: of this part, updated.
            now: the inputs, see `sample`.
            is_held: whether the residual stays.
        """
        places, reading = self.memory, now["estimated_state"]
        elapsed = now.time - memory[places.time]
        moved = elapsed if elapsed > 0 and not is_held else 0.0
        terms = memory[places.momentum], memory[places.forces], memory[places.residual]
        if not self._law(reading, now["torque"], self._config.gain, moved, *terms):
            check_signal(reading, now.port("estimated_state"))
            check_signal(now["torque"], now.port("torque"))
        memory[places.time] = now.time

    def _tare(self, memory: Array, time: float) -> None:
        """Takes the mean of the residual in the second half of the `tare` seconds from the start.

        Args:
            memory: of this part, updated.
            time: since the start [s].
        """
        if not 0.5 * self._config.tare < time <= self._config.tare:
            return
        count = memory[self.memory.tare_samples] = memory[self.memory.tare_samples] + 1.0
        tared = memory[self.memory.tared]
        tared += (memory[self.memory.residual] - tared) / count

    def _external(self, memory: Array) -> Array:
        external: Array = memory[self.memory.residual] - memory[self.memory.tared]
        return external

    def _write_torque(self, now: Now, external: Array) -> None:
        external[:] = self._external(now.memory)

    def _write_collision(self, now: Now, collision: Array) -> None:
        collision[:] = float((np.abs(self._external(now.memory)) > self._threshold).any())
