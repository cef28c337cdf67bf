"""The log of a drive."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE
from geoimp_drake.typing import Array

__all__ = ["DriveLog", "TickLog"]


@dataclass
class DriveLog:
    """The log of a drive: t, q, v, torque, wrench, mode, motions, and what the robot reported.

    For a robot that takes positions, `position` is what it was sent, and `torque` what it reports.

    Attributes:
        values: of the last ticks, a row each.
        whole: of the whole drive, a row each log period, or the next tick that has a valid status.
        ticks: their number in all.
        computing: time from a status to its torques, of the last ticks [s].
        failure: the error that ended the drive, if the supervisor did not.
        early: an error if it was braked before its motion had ended, by its supervisor or by
            Ctrl-C.
    """

    values: dict[str, Array]
    whole: dict[str, Array]
    ticks: int
    computing: Array
    failure: Exception | None = None
    early: Exception | None = None


class TickLog:
    """The last ticks, in arrays that are made once, and the whole drive more coarsely.

    Args:
        keep: how long every tick is kept [s].
        log_period: of the rows of the whole drive [s].
        period: of a tick [s].
        n: number of joints.
    """

    def __init__(self, keep: float, log_period: float, period: float, n: int):
        size = round(keep / period)
        widths = {"t": 1, "q": n, "v": n, "torque": n, "position": n, "wrench": 6, "mode": 1}
        widths |= {"reported_wrench": 6, "reported_external_torque": n}
        widths |= dict.fromkeys(("motion_D", "motion_C", "motion_E"), FRAME_MOTION_SIZE)
        self._rows = {name: np.full((size, width), np.nan) for name, width in widths.items()}
        self._coarse: dict[str, list[Array]] = {name: [] for name in widths}
        self._every = max(1, round(log_period / period))
        self._computing, self._count, self._due = np.zeros(size), 0, 0

    def append(self, values: dict[str, Any], computing: float) -> None:
        """Keeps a tick: values by name, NaN for those not given, and the computing time [s].

        There is a wrench whenever there is a valid status.
        """
        place = self._count % len(self._computing)
        for name, rows in self._rows.items():
            rows[place] = values.get(name, np.nan)
        if self._count >= self._due and np.isfinite(self._rows["wrench"][place]).all():
            for name, rows in self._rows.items():
                self._coarse[name].append(rows[place].copy())
            self._due = self._count - self._count % self._every + self._every
        self._computing[place] = computing
        self._count += 1

    def read(self) -> DriveLog:
        """Returns the log."""
        size = len(self._computing)
        kept = np.arange(max(0, self._count - size), self._count) % size
        rows = {name: rows[kept] for name, rows in self._rows.items()}
        whole = {name: np.array(rows) for name, rows in self._coarse.items()}
        return DriveLog(rows, whole, self._count, self._computing[kept])
