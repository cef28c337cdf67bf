"""The results of the laws of an impedance controller."""

import numpy as np

from geoimp_drake.parts.law_signals import ArmSignals, ImpedanceSignals
from geoimp_drake.parts.part import NOTHING
from geoimp_drake.typing import Array

__all__ = ["FoundImpedance"]


class FoundImpedance:
    """The motion of C, what its energy needs, the memory and wrench behind both, and the torques.

    Args:
        impedance: the signals of the impedance's law.
        arm: the signals of the inner loop's law, with the torques.

    Attributes:
        impedance: see above.
        arm: see above.
        motion: of C (19,).
        terms: what the impedance's `follow` has returned for its `energy`.
        memory: of the whole part, with a reading.
        own: its part that is the impedance's.
        arm_memory: its part that is the inner loop's.
        wrench: at the end effector (6,).
        time: of the torques, which depend on it by a task function; NaN if there are none [s].
        reports: what `InnerLoop.write_torque` has returned.
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
