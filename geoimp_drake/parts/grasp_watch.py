"""Detects from the hands' wrenches that a grasp has opened."""

import logging
from dataclasses import dataclass

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.law_signals import WatchSignals
from geoimp_drake.parts.part import Memory, Now, held
from geoimp_drake.parts.signals import check_signal
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, key, positive

__all__ = ["GRASP_CLOSED", "GraspMonitorConfig", "GraspWatch"]

_log = logging.getLogger("drake")

_HANDS = ("first", "second")

# The time of an event that has not happened [s].
GRASP_CLOSED = -1.0


@dataclass
class GraspMonitorConfig:
    """When a grasp counts as opened."""

    enabled: bool = True
    force_threshold: float = 4.0  # a hand with less force and less moment holds nothing [N]
    moment_threshold: float = 1.0  # the moment for the same [Nm]
    loaded: float = 2.5  # multiple of the thresholds above which a hand holds something
    fall_time: float = 0.005  # longest time from holding something to holding nothing [s]
    dwell: float = 0.010  # how long it must then hold nothing [s]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        positive(self.force_threshold, key(name, "force_threshold"), "N")
        positive(self.moment_threshold, key(name, "moment_threshold"), "Nm")
        positive(self.loaded - 1.0, f"{key(name, 'loaded')} minus one")
        positive(self.fall_time, key(name, "fall_time"), "s")
        positive(self.dwell, key(name, "dwell"), "s")
        if (self.loaded - 1.0) * self.dwell <= 2.0 * self.fall_time:
            raise ConfigurationError(
                f"{key(name, 'loaded')} less one, {self.loaded - 1.0:g}, times "
                f"{key(name, 'dwell')}, {self.dwell:g} s, is not above twice "
                f"{key(name, 'fall_time')}, {self.fall_time:g} s, so a force that passes "
                f"through zero evenly could be taken for an opened grasp. Raise "
                f"loaded or dwell, or lower fall_time."
            )

    def check_period(self, name: str, period: float) -> None:
        """Raises ConfigurationError if a fall cannot be seen with a sampling period [s]."""
        if self.fall_time < period:
            raise ConfigurationError(
                f"{key(name, 'fall_time')} is {self.fall_time:g} s, less than the sampling period "
                f"of {period:g} s: no fall is that fast. Give several periods."
            )

    def arrays(self) -> tuple[Array, Array]:
        """Returns thresholds (3) and limits (2) as `grasp_watch.watch_grasps` takes them."""
        thresholds = [self.force_threshold, self.moment_threshold, self.loaded]
        return np.array(thresholds, dtype=float), np.array([self.fall_time, self.dwell])


class GraspWatch:
    """The part of `GraspMonitor`; arguments and errors are the same."""

    def __init__(self, config: GraspMonitorConfig | None = None, period: float = 1e-3):
        self._config = config = config or GraspMonitorConfig()
        check(config, "monitor")
        positive(period, "sampling.period", "s")
        config.check_period("monitor", period)
        self._arguments = *config.arrays(), float(period)
        self.inputs = {"wrench_1": 6, "wrench_2": 6}
        # For each hand the time since it was loaded, and since it was last not empty [s].
        self.memory = Memory(
            times=np.array([np.inf, np.inf, 0.0, 0.0]),
            opened=np.array([0.0, 0.0, GRASP_CLOSED]),
        )
        self.samplings = ((period, self.sample),)
        self.outputs = (held("opened", self.memory.opened),)

    def new_workspace(self) -> WatchSignals:
        """Returns where a sample is taken."""
        return WatchSignals(*self._arguments)

    def sample(self, memory: Array, now: Now) -> None:
        """Takes a sample of both wrenches."""
        self.take(memory, now["wrench_1"], now["wrench_2"], now, now.workspace)

    def take(self, memory: Array, h_1: Array, h_2: Array, now: Now, signals: WatchSignals) -> None:
        """Takes a sample of given wrenches; `now` names the ports."""
        if not signals.take(h_1, h_2, memory[self.memory.times]):
            check_signal(h_1, now.port("wrench_1"))
            check_signal(h_2, now.port("wrench_2"))
        if signals.new[0] or signals.new[1]:
            self._latch(memory[self.memory.opened], now, signals.new)

    def _latch(self, opened: Array, now: Now, seen: Array) -> None:
        new = (seen != 0.0) & (opened[:2] == 0.0)
        if not new.any():
            return
        opened[:2] += new
        if opened[2] == GRASP_CLOSED:
            opened[2] = now.time
        for k in np.flatnonzero(new):
            _log.warning(
                f"{now.system}: the grasp of the {_HANDS[k]} hand has opened, seen at "
                f"t = {now.time:.3f} s: its wrench fell below "
                f"{self._config.force_threshold:g} N and {self._config.moment_threshold:g} Nm."
            )
