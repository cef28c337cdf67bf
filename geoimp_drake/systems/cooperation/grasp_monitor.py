"""Notices from the hands' wrenches that a grasp has opened."""

import logging
from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues, System

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.cooperation.grasp_watch import watch_grasps
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.frame_motion import check_signal
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, key, positive

__all__ = [
    "GRASP_CLOSED",
    "NOTHING_OPENED",
    "TIMES_AT_START",
    "GraspMonitor",
    "GraspMonitorConfig",
]

_log = logging.getLogger("drake")

_HANDS = ("first", "second")

# The time of an event that has not happened [s].
GRASP_CLOSED = -1.0

# For each hand the time since it was loaded, and since it was last not empty [s].
TIMES_AT_START = np.array([np.inf, np.inf, 0.0, 0.0])
NOTHING_OPENED = np.array([0.0, 0.0, GRASP_CLOSED])


@dataclass
class GraspMonitorConfig:
    """When a grasp counts as opened."""

    enabled: bool = True
    force_threshold: float = 4.0  # of a hand that holds nothing: below it, and [N]
    moment_threshold: float = 1.0  # below this [Nm]
    loaded: float = 2.5  # multiple of the thresholds above which a hand holds something
    fall_time: float = 0.005  # longest time from holding something to holding nothing [s]
    dwell: float = 0.010  # how long it has to hold nothing then [s]

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

    def make(self, period: float = 1e-3, name: str = "monitor") -> "GraspMonitor":
        """Returns the system."""
        check(self, name)
        return GraspMonitor(self, period)


class GraspMonitor(Block):
    """Reports a hand whose wrench falls to nothing at once: its grasp has opened.

    With the size s = max(‖f‖/f_t, ‖μ‖/μ_t) of a hand's wrench, its grasp counts as opened when s
    has fallen from `loaded` to below 1 within `fall_time` and has stayed below 1 for `dwell`. A
    force that passes through zero evenly, as when a contact takes over the weight, is not reported
    at any rate: slow ones take longer than `fall_time`, fast ones are through within `dwell`.
    Detection takes the fall, `dwell` and one sample: at most `fall_time` + `dwell` + one period.

    A grasp that carries nothing cannot be told from one that is open: if s is below `loaded` when
    the grasp opens, nothing is reported.

    The report is latched until the simulator is initialized again, and logged by Drake's logger.

    Args:
        config: thresholds.
        period: sampling period [s].

    Raises:
        ConfigurationError: a field cannot be used.
        SignalError: a wrench is NaN or infinite.

    Ports:
        input wrench_1: h = [μ; f] by the first hand on the object, about its own origin (6)
        input wrench_2: the same by the second (6)
        output opened: 1 for a hand whose grasp has opened, else 0; and the time, −1 for none (3)
    """

    def __init__(self, config: GraspMonitorConfig | None = None, period: float = 1e-3):
        super().__init__()
        self._config = config or GraspMonitorConfig()
        check(self._config, "monitor")
        positive(period, "sampling.period", "s")
        self._config.check_period("monitor", period)
        self._wrenches = [self.DeclareVectorInputPort(f"wrench_{k}", 6) for k in (1, 2)]
        self._times = self.declare_state(TIMES_AT_START)
        self._opened = self.declare_state(NOTHING_OPENED)
        self._period = period
        self._law = compiled(watch_grasps)
        self._thresholds, self._limits = self._config.arrays()
        self.declare_state_output("opened", self._opened)
        self.DeclareInitializationDiscreteUpdateEvent(self._reset)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._watch)

    @property
    def period(self) -> float:
        """Sampling period [s]."""
        return self._period

    def _reset(self, context: Context, state: DiscreteValues) -> None:
        state.set_value(self._times, TIMES_AT_START)
        state.set_value(self._opened, NOTHING_OPENED)

    def _watch(self, context: Context, state: DiscreteValues) -> None:
        h_1, h_2 = (port.Eval(context) for port in self._wrenches)
        # Drake hands over a copy of the context's state.
        times, opened = (state.get_mutable_value(k) for k in (self._times, self._opened))
        self.watch(self, context, h_1, h_2, times, opened)

    def watch(
        self, system: System, context: Context, h_1: Array, h_2: Array, times: Array, opened: Array
    ) -> None:
        """Takes a sample of both wrenches.

        Args:
            system: named in errors and in the report.
            context: of that system, whose time it is.
            h_1: wrench of the first hand (6).
            h_2: of the second (6).
            times: since each hand was loaded, and since it was last not empty (4) [s]; moved on.
            opened: as the output says (3); set for a grasp that has opened.

        Raises:
            SignalError: a wrench is NaN or infinite.
        """
        now = np.empty(2)
        if not self._law(h_1, h_2, times, self._thresholds, self._limits, self._period, times, now):
            for k, h in ((1, h_1), (2, h_2)):
                check_signal(h, f"{system.get_name()}:wrench_{k}")
        if now[0] or now[1]:
            self._latch(system.get_name(), context.get_time(), now, opened)

    def _latch(self, system: str, time: float, now: Array, opened: Array) -> None:
        new = (now != 0.0) & (opened[:2] == 0.0)
        if not new.any():
            return
        opened[:2] += new
        if opened[2] == GRASP_CLOSED:
            opened[2] = time
        for k in np.flatnonzero(new):
            _log.warning(
                f"{system}: the grasp of the {_HANDS[k]} hand has opened, seen at "
                f"t = {time:.3f} s: its wrench fell below "
                f"{self._config.force_threshold:g} N and {self._config.moment_threshold:g} Nm."
            )
