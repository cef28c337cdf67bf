"""Checks of input signals; each error names the port and the number."""

import numpy as np

from geoimp_drake.compilation.small_arrays import numbers
from geoimp_drake.errors import SignalError
from geoimp_drake.laws.frame_motion import QUATERNION, is_finite
from geoimp_drake.laws.impedance.compliant_motion import has_diverged
from geoimp_drake.rotations import quaternion
from geoimp_drake.typing import Array

__all__ = ["AT_REST", "check_frame_motion", "check_signal", "check_wrench", "is_set"]

# The motion of a frame that rests at W's origin.
AT_REST = np.array([1.0, *[0.0] * 18])
AT_REST.flags.writeable = False


def is_set(pose: Array) -> bool:
    """Whether a pose, or a vector that begins with one, has been written: it is zero until then.

    Args:
        pose: quaternion first.
    """
    # Compared: an `AutoDiffXd` counts as true whatever its value.
    return bool(pose[0] != 0.0 or pose[1] != 0.0 or pose[2] != 0.0 or pose[3] != 0.0)


def check_signal(value: Array, port: str) -> None:
    """Raises SignalError if a value at a port is NaN or infinite, or overflows when squared."""
    value = numbers(value)
    if not is_finite(value):
        bad = {int(i): float(value[i]) for i in np.flatnonzero(~np.isfinite(value))}
        raise SignalError(
            f"Port '{port}' got {bad or 'values that overflow when squared'} (index: value); every "
            f"entry must be finite. Look at the system that feeds this port."
        )


def check_wrench(wrench: Array, port: str) -> None:
    """Raises SignalError if a wrench (6,) is not finite, or larger than any arm meets."""
    wrench = numbers(wrench)
    check_signal(wrench, port)
    if has_diverged(wrench):
        k = int(np.argmax(np.abs(wrench)))
        raise SignalError(
            f"Port '{port}' got {wrench[k]:.3g} {'Nm' if k < 3 else 'N'} (index {k}); no arm meets "
            f"that. Look at the sensor or the system that feeds this port."
        )


def check_frame_motion(motion: Array, port: str) -> None:
    """Raises SignalError if a frame motion is not finite or its quaternion is not unit."""
    motion = numbers(motion)
    check_signal(motion, port)
    quaternion.check_unit(motion[QUATERNION], f"Port '{port}': its quaternion")
