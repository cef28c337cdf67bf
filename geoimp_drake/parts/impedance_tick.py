"""A tick of an impedance controller in one compiled call."""

from collections.abc import Mapping

import numpy as np

from geoimp_drake.compilation.compiled import bound
from geoimp_drake.laws.compositions.impedance_tick import UNUSUAL, impedance_tick
from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE
from geoimp_drake.parts.found_impedance import FoundImpedance
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.impedance_gains import GAIN_PORTS
from geoimp_drake.parts.inner_loop import InnerLoop
from geoimp_drake.parts.joint_limits import UNLIMITED
from geoimp_drake.parts.law_signals import ReadingSignals
from geoimp_drake.parts.part import Now
from geoimp_drake.typing import Array

__all__ = ["ImpedanceTick"]


class ImpedanceTick:
    """Does a tick of an `ImpedanceController` in a `PartLoop` if nothing in it is unusual.

    In any other tick it leaves memory and state as they are, and returns False. Then the loop calls
    the controller's pieces one after the other; they know what to do, and name a fault.

    Args:
        impedance: of the end effector.
        loop: of an arm of six joints.
        reading: how its joints are read; in persistent arrays, like all that follow.
        found: what the outputs follow from.
        last: motion of C when the last tick ended (19,).
        holds: not zero while C is held back (1,).
        acts: not zero while a limit acts (1,).
    """

    def __init__(
        self,
        impedance: Impedance,
        loop: InnerLoop,
        reading: ReadingSignals,
        found: FoundImpedance,
        last: Array,
        holds: Array,
        acts: Array,
    ):
        self._loop, self._found, self._target = loop, found, np.zeros(FRAME_MOTION_SIZE)
        self._reports = np.zeros(loop.model.num_joints), 0.0, 0.0, UNLIMITED
        law = impedance_tick(impedance.rotation.law, loop.orientation_law)
        kept = found.impedance.arguments, found.arm.arguments, found.arm.efforts
        self._law = bound(law, reading.arguments, *kept, last, holds, acts, self._target)

    def __call__(self, now: Now, targets: Mapping[str, Array], elapsed: float) -> bool:
        """Advances by one tick; see `Stays`."""
        found, target = self._found, targets.get("desired_motion", ())
        is_known = len(targets) == 1 and len(target) == FRAME_MOTION_SIZE
        if not is_known or found.memory is not now.memory or now.has_any(GAIN_PORTS):
            return False
        self._target[:] = target
        try:
            passed = self._law(elapsed)
        except np.linalg.LinAlgError:
            return False
        if passed == UNUSUAL:
            return False
        found.time, found.reports = now.time, self._reports
        if passed:
            self._loop.warn(passed, found.arm, now)
        return True
