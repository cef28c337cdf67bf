"""The pose of a frame as its rotation matrix and its origin."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import sized
from geoimp_drake.typing import Array

__all__ = ["compose"]


@compilable
def compose(R_WM: Array, p_WM: Array, X_MF: Array) -> tuple[Array, Array]:
    """R_WF (3, 3) and p_WF (3,) of a frame F that has the pose X_MF = [R p] (3, 4) in M."""
    X = sized(X_MF, 3, 4)
    return R_WM @ X[:, :3], p_WM + R_WM @ X[:, 3]
