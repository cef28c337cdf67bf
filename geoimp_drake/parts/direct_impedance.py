"""The six-DOF impedance of E itself: C is E as measured, and nothing is integrated."""

from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE, FRAME_STATE_SIZE
from geoimp_drake.parts.hold_back import NO_SLACK
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.inner_loop import InnerLoop
from geoimp_drake.parts.law_signals import ArmSignals, ImpedanceSignals
from geoimp_drake.parts.part import Now, Output
from geoimp_drake.typing import Array

__all__ = ["DirectImpedance"]


class DirectImpedance:
    """The part of `systems.direct_impedance.DirectImpedance`.

    Args:
        springs: the impedance whose law is evaluated with the motion of E in place of C's state.

    Attributes:
        springs: the same.
        needs_wrench: True: the law contains the wrench.
        holds: see `Impedance`.
    """

    needs_wrench = True

    def __init__(self, springs: Impedance):
        self.springs = springs
        self.inputs, self.memory, self.holds = springs.inputs, springs.memory, springs.holds
        self.displacement, self.energy = springs.displacement, springs.energy
        self.check_start, self.new_signals = springs.check_start, springs.new_signals
        _, *others = springs.outputs
        signals = tuple(name for name in self.inputs if name != "slack")
        motion = Output("compliant_motion", FRAME_MOTION_SIZE, self._write, signals)
        self.outputs = motion, *others

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Keeps the motion of C as a step begins."""
        slack = now["slack"] if now.has("slack") else NO_SLACK
        self.keep(memory, state, now, now.output("compliant_motion"), slack)

    def keep(self, memory: Array, state: Array, now: Now, motion: Array, slack: Array) -> None:
        """Does what `Impedance.remember` does: without a state there is nothing to hold back."""
        self.springs.remember(memory, now, motion, slack)

    def follow(
        self,
        now: Now,
        wrench: Array,
        loop: InnerLoop,
        memory: Array,
        signals: ImpedanceSignals,
        arm: ArmSignals,
    ) -> tuple[Array, ...]:
        """Does what `Impedance.follow` does, for E as measured."""
        state = loop.measured(memory, now, arm)[:FRAME_STATE_SIZE]
        self.springs.evaluate(now, now["desired_motion"], wrench, state, signals)
        return ()

    def _write(self, now: Now, motion: Array) -> None:
        state = now["measured_motion"][:FRAME_STATE_SIZE]
        self.springs.write_motion(now, now["desired_motion"], now["wrench"], state, motion)
