"""Orientation control on an angle/axis error of Table 2.1."""

from collections.abc import Callable
from functools import cache

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.rotations.angle_axis import Representation, displacement, displacement_of
from geoimp_drake.rotations.quaternion import relative, to_rotation
from geoimp_drake.typing import Array

__all__ = ["orientation_acceleration", "orientation_error"]


def orientation_error(row: Representation, Q_WD: Array, Q_WE: Array) -> Array:
    """(2.13) ᵉo_de = f(ϑ_de) ᵉr_de (3,), in E."""
    return displacement(row, relative(Q_WE, Q_WD))


@cache
def orientation_acceleration(row: Representation) -> Callable[..., Array]:
    """Returns the control law for a row of Table 2.1.

    (2.13) a_o = ω̇_d + K_Do Δω_de + K_Po R_e ᵉo_de, formed like (2.15) for the quaternion: the
    chapter gives only the error. Because f′(0) is 1 for sin ϑ and ϑ and ½ for the others, the same
    K_Po is twice as stiff for the first two.
    """
    coefficients = row.coefficients

    @compilable
    def law(
        Q_WD: Array, w_WD: Array, dw_WD: Array, Q_WE: Array, w_WE: Array, K_D: Array, K_P: Array
    ) -> Array:
        """Returns a_o (3,); arguments as of `quaternion_control.orientation_acceleration`."""
        error_W = to_rotation(Q_WE) @ displacement_of(coefficients, relative(Q_WE, Q_WD))
        return dw_WD + K_D @ (w_WD - w_WE) + K_P @ error_W

    return law
