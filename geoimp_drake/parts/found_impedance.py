"""The results of the laws of an impedance controller."""

import numpy as np

from geoimp_drake.parts.law_signals import ArmSignals, ImpedanceSignals
from geoimp_drake.parts.part import NOTHING
from geoimp_drake.typing import Array

__all__ = ["FoundImpedance"]


class FoundImpedance:
    """The motion of C, what its energy needs, the memory and wrench behind both, and the torques.

    The torques also depend on the time, by a task function. `time` is that of the torques, NaN if
    there are none.
    """

    __slots__ = (
        "arm",
        "arm_memory",
        "impedance",
        "memory",
        "motion",
        "own",
        "reports",
        "terms",
        "time",
        "wrench",
    )

    def __init__(self, impedance: ImpedanceSignals, arm: ArmSignals):
        self.impedance, self.arm, self.motion = impedance, arm, impedance.motion
        self.terms: tuple[Array, ...] = ()
        self.memory = self.own = self.arm_memory = self.wrench = NOTHING
        self.time, self.reports = np.nan, (NOTHING, 0.0, 0.0, NOTHING)
