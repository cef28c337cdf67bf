"""Stiffness given by its principal axes, for translation and for rotation."""

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.typing import Array

__all__ = ["principal_axes", "stiffness_from_principal_axes"]

# The largest entry of UᵀU − I for axes that are written with three or four digits.
ORTHONORMALITY_TOLERANCE = 2e-3


def stiffness_from_principal_axes(U: Array, gamma: Array) -> Array:
    """(3.2) K = U Γ Uᵀ: a displacement along the column u_i gives γ_i times it, along u_i.

    U is first replaced by the nearest orthonormal matrix. So axes written with a few digits become
    exactly the eigenvectors of K, and γ exactly its eigenvalues. Floats only.

    Args:
        U: principal axes as columns (3, 3).
        gamma: stiffness along each (3,) [N/m] or [Nm/rad].

    Returns:
        K (3, 3), symmetric positive definite.

    Raises:
        ConfigurationError: a wrong shape; the columns of U are not orthonormal within 2e-3; a
            stiffness is not positive and finite.
    """
    U, gamma = np.asarray(U, dtype=float), np.asarray(gamma, dtype=float)
    _check(U, gamma)
    left, _, right = np.linalg.svd(U)
    axes = left @ right
    K = (axes * gamma) @ axes.T
    return 0.5 * (K + K.T)


def principal_axes(K: Array) -> tuple[Array, Array]:
    """(3.2) U (3, 3) and γ (3,), ascending, of a symmetric K = U Γ Uᵀ. Floats only."""
    gamma, U = np.linalg.eigh(K)
    return U, gamma


def _check(U: Array, gamma: Array) -> None:
    if U.shape != (3, 3) or gamma.shape != (3,):
        raise ConfigurationError(
            f"principal axes have shape {U.shape} and their stiffnesses {gamma.shape}: give three "
            "columns (3, 3) and three numbers (3,)."
        )
    error = float(np.abs(U.T @ U - np.eye(3)).max())
    if not error <= ORTHONORMALITY_TOLERANCE:
        raise ConfigurationError(
            f"principal axes are not orthonormal: an entry of UᵀU − I is {error:.3g}, above "
            f"{ORTHONORMALITY_TOLERANCE:g}. The axes are the columns of U."
        )
    if not (np.isfinite(gamma).all() and gamma.min() > 0.0):
        raise ConfigurationError(
            f"stiffnesses along the principal axes are {gamma.tolist()}: each must be positive."
        )
