"""The energy that an end effector gives out, from measurements."""

from dataclasses import dataclass

import numpy as np

from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE, POSE_SIZE, POSITION, QUATERNION
from geoimp_drake.laws.passivity.alternating_work import alternating_work
from geoimp_drake.parts.part import Memory, Now, held
from geoimp_drake.parts.signals import check_frame_motion, check_wrench, is_set
from geoimp_drake.rotations import quaternion
from geoimp_drake.typing import Array
from geoimp_drake.validation import key, non_negative, positive, whole_number

__all__ = ["ObserverConfig", "PassivityObserver"]

_POSE = slice(0, POSE_SIZE)
_ROUNDING = 1e-6  # of a period

# A push of less than this share of the last one's energy does not count: it dies out by itself.
_DECAY = 0.5

# A push ends when its work in a step falls below this share of its largest: against a damper work
# is never negative.
_DIP = 0.1


@dataclass
class ObserverConfig:
    """How the observer counts energy that is given out."""

    delay: int = 0  # how many periods the wrench is later than the joints' readings
    lag: float = 0.1  # of the means of (L.6): what is slower does not count [s]
    least: float = 1e-3  # energy that a push must give out to count [J]
    memory: float = 0.5  # longest time between pushes that belong together [s]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        whole_number(self.delay, key(name, "delay"), 0, 1000)
        non_negative(self.lag, key(name, "lag"), "s")
        positive(self.least, key(name, "least"), "J")
        positive(self.memory, key(name, "memory"), "s")


class PassivityObserver:
    """The part of `systems.passivity_observer.PassivityObserver`; arguments are the same."""

    float_only = "counts energy step by step"

    def __init__(self, period: float = 1e-3, config: ObserverConfig | None = None):
        config = config or ObserverConfig()
        config.validate("observer")
        positive(period, "period", "s")
        self.period = period
        self._share = period / (config.lag + period)
        self._config = config
        self.inputs = {"wrench": 6, "measured_motion": FRAME_MOTION_SIZE}
        self.memory = Memory(
            given_out=np.zeros(1),
            alternating=np.zeros(1),
            pose=np.zeros(POSE_SIZE),
            time=-np.inf,
            means=np.zeros(12),
            ways=np.zeros(6 * (config.delay + 1)),
            # Energy of the present push, and the most that it gave out in a step [J]. Then the
            # energy of the last push that counted [J], and when it ended [s].
            push=0.0,
            peak=0.0,
            last=0.0,
            ended=-np.inf,
        )
        self.outputs = (
            held("given_out", self.memory.given_out),
            held("alternating", self.memory.alternating),
        )

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Takes the last measurement, once a period."""
        self.keep(memory, now, now["wrench"], now["measured_motion"])

    def keep(self, memory: Array, now: Now, wrench: Array, E: Array) -> bool:
        """Does what `begin` does; returns whether a period is over.

        Args:
            memory: of this part, updated.
            now: the time, and the ports' names.
            wrench: the last measured one (6,).
            E: last measured motion of the end effector (19,).
        """
        places = self.memory
        if now.time < memory[places.time] + (1.0 - _ROUNDING) * self.period:
            return False
        check_wrench(wrench, now.port("wrench"))
        check_frame_motion(E, now.port("measured_motion"))
        memory[places.time] = now.time
        pose, ways = memory[places.pose], memory[places.ways].reshape(-1, 6)
        if is_set(pose):
            ways[1:] = ways[:-1].copy()
            ways[0] = _way(pose, E)
            self._add(memory, wrench, ways[-1], now.time)
        pose[:] = E[_POSE]
        return True

    def _add(self, memory: Array, h: Array, z: Array, time: float) -> None:
        """Adds the work of a step; a push lasts until its alternating work is small or negative.

        Args:
            memory: of this part, updated.
            h: wrench by the end effector on the environment (6,) [Nm, N].
            z: displacement of E in the step of that wrench (6,) [rad, m].
            time: [s].
        """
        places, least = self.memory, self._config.least
        memory[places.given_out] += h @ z
        work = alternating_work(h, z, memory[places.means].reshape(2, 6), self._share)
        if work > _DIP * memory[places.peak]:
            memory[places.push] += work
            memory[places.peak] = max(memory[places.peak], work)
        else:
            if memory[places.push] > least:
                memory[places.last], memory[places.ended] = memory[places.push], time
            memory[places.push] = memory[places.peak] = 0.0
        push, last = memory[places.push], memory[places.last]
        again = time - memory[places.ended] < self._config.memory
        memory[places.alternating] = push if again and push > max(least, _DECAY * last) else 0.0


def _way(before: Array, after: Array) -> Array:
    """Returns rotation vector and displacement (6,) from one pose in W to another."""
    turn = quaternion.product(after[QUATERNION], quaternion.conjugate(before[QUATERNION]))
    return np.concatenate((quaternion.log(turn), after[POSITION] - before[POSITION]))
