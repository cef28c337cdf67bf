"""The orientation laws of the inner loop by name, one signature for all.

An entry is called as `law(Q_WD, w_WD, dw_WD, Q_WE, w_WE, K_D, K_P)` and returns a_o (3,) in W. To
track C instead of D, give C's motion: only one wire changes.
`families.make_family(name, …).check_domain(Q_WD, Q_WE)` checks whether the chosen error is defined.
"""

from collections.abc import Callable

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.motion_control import (
    alternative_euler_control,
    angle_axis_control,
    euler_control,
    quaternion_control,
)
from geoimp_drake.rotations.angle_axis import REPRESENTATIONS
from geoimp_drake.typing import Array

__all__ = ["ERROR_PER_ANGLE", "ORIENTATION_LAWS", "orientation_law"]

ORIENTATION_LAWS: dict[str, Callable[..., Array]] = {
    "quaternion": quaternion_control.orientation_acceleration,
    "classical-euler": euler_control.orientation_acceleration,
    "alternative-euler": alternative_euler_control.orientation_acceleration,
    **{
        f"angle-axis-{row.name}": angle_axis_control.orientation_acceleration(row)
        for row in REPRESENTATIONS.values()
    },
}

# The error that each law multiplies by K_Po, as a part of a small angle. ε of (2.15) is half of
# it, an angle/axis error is f′(0) of it.
ERROR_PER_ANGLE = {
    "quaternion": 0.5,
    "classical-euler": 1.0,
    "alternative-euler": 1.0,
    **{f"angle-axis-{row.name}": row.f_prime_at_zero for row in REPRESENTATIONS.values()},
}


def orientation_law(name: str) -> Callable[..., Array]:
    """The law (2.10), (2.12), (2.13) or (2.15) called `name`.

    Raises:
        ConfigurationError: there is no such law; the message lists the names.
    """
    if name not in ORIENTATION_LAWS:
        names = ", ".join(ORIENTATION_LAWS)
        raise ConfigurationError(f"no orientation law is called {name!r}: use one of {names}.")
    return ORIENTATION_LAWS[name]
