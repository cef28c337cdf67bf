"""The impedance and the derivative of its state in one call: (3.1), and Q̇, ṗ, ω̇ and v̇ of C."""

from collections.abc import Callable
from functools import cache

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.laws.impedance.compliant_motion import compliant_motion, frame_state_rate
from geoimp_drake.typing import Array

__all__ = ["impedance_step"]


@cache
def impedance_step(angular_acceleration: Callable[..., Array]) -> Callable[..., bool]:
    """Returns the law for an orientation family, given as for `compliant_motion`."""
    impedance = compilable(compliant_motion(angular_acceleration))

    def law(
        state: Array,
        desired: Array,
        wrench: Array,
        translation: Array,
        rotation: Array,
        coupling: Array,
        parts: Array,
        motion: Array,
        rate: Array,
    ) -> bool:
        """Writes the motion of C and the rate of its state; returns False if an input is unusable.

        Args:
            state: this and the following six are those of `compliant_motion`.
            desired: see there.
            wrench: see there.
            translation: see there.
            rotation: see there.
            coupling: see there.
            parts: see there.
            motion: of C (19,), where to write.
            rate: where to write the derivative of the state (13,).
        """
        if not impedance(state, desired, wrench, translation, rotation, coupling, parts, motion):
            return False
        frame_state_rate(motion, rate)
        return True

    return law
