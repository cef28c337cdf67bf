"""A tick of the impedance controller of a six-joint arm in one call: reading, state of C, torques.

The laws are those that a tick otherwise calls one by one, in the same order. A call from Python
costs more than most of them, so they share one. Floats only.
"""

from collections.abc import Callable
from functools import cache

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import local, sized
from geoimp_drake.laws.compositions.arm_torque import DONE, arm_torque
from geoimp_drake.laws.compositions.impedance_step import impedance_step
from geoimp_drake.laws.explicit_euler import explicit_euler
from geoimp_drake.laws.frame_motion import FRAME_STATE_SIZE, QUATERNION
from geoimp_drake.laws.motion_control.inverse_dynamics import peak_effort
from geoimp_drake.laws.motion_control.joint_reading import next_reading
from geoimp_drake.typing import Array

__all__ = ["UNUSUAL", "impedance_tick"]

# What the law returns if it leaves the tick to the laws called one by one.
UNUSUAL = -1


@cache
def impedance_tick(
    angular_acceleration: Callable[..., Array], orientation_law: Callable[..., Array]
) -> Callable[..., int]:
    """Returns the law.

    Args:
        angular_acceleration: of an orientation family, see `compliant_motion`.
        orientation_law: see `orientation_control.ORIENTATION_LAWS`.
    """
    follow = compilable(impedance_step(angular_acceleration))
    resolve = compilable(arm_torque(orientation_law))

    def law(
        sampling: tuple,
        impedance: tuple,
        arm: tuple,
        efforts: tuple,
        last: Array,
        holds: Array,
        acts: Array,
        target: Array,
        elapsed: float,
    ) -> int:
        """Advances by one tick; returns what `peak_effort` returns.

        It returns UNUSUAL if C has not started or is held back, a limit acts or begins to act, or a
        signal cannot be used. The reading, the state of C, D, C's last motion and the peaks then
        stay as they were; torques and other results are overwritten.

        Args:
            sampling: the arguments of `next_reading` before the period; the last two are the same.
            impedance: the arguments of `impedance_step`, with D of the previous tick.
            arm: the arguments of `arm_torque`.
            efforts: the arguments of `peak_effort`.
            last: motion of C at the end of the previous tick (19,).
            holds: not zero while C is held back (1,).
            acts: not zero while a limit acts (1,).
            target: motion of D at the end of this tick (19,).
            elapsed: time since the previous tick [s].

        Raises:
            numpy.linalg.LinAlgError: J is exactly singular; the same stay as they were.
        """
        differenced, turns, reading, held, _ = sampling
        state, desired, h, translation, rotation, coupling, parts, C, rate = impedance
        Q = sized(state, FRAME_STATE_SIZE)[QUATERNION]
        if holds[0] != 0.0 or acts[0] != 0.0 or Q @ Q == 0.0:
            return UNUSUAL
        read, x = local(sized(held, 13)), local(sized(state, FRAME_STATE_SIZE))
        if not next_reading(differenced, turns, reading, held, read, elapsed):
            return UNUSUAL
        # The step of C takes the new wrench and the D of its beginning, as in a simulator.
        if not follow(x, desired, h, translation, rotation, coupling, parts, C, rate):
            return UNUSUAL
        explicit_euler(x, rate, elapsed)
        if not follow(x, target, h, translation, rotation, coupling, parts, C, rate):
            return UNUSUAL
        if resolve(*arm[:8], read, *arm[9:]) != DONE:
            return UNUSUAL
        held[:13] = sized(read, 13)
        state[:FRAME_STATE_SIZE] = C[:FRAME_STATE_SIZE]
        desired[:] = target
        last[:] = C
        return peak_effort(*efforts)

    return law
