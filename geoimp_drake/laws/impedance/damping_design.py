"""Damping designed from the inertia: every mode of M and K gets the same damping ratio.

Let M = AAᵀ, K = A Λ Aᵀ with Λ = diag(ω_i²), and x = A⁻ᵀξ. Then M ẍ + D ẋ + K x = f separates into
modes ξ̈_i + 2ζω_i ξ̇_i + ω_i² ξ_i = (A⁻¹f)_i exactly if D = 2ζ A Λ^½ Aᵀ. M and K do not have to
share their axes: those of an arm, or of a tool longer than it is wide, seldom do. Floats only.
"""

import numpy as np

from geoimp_drake.typing import Array
from geoimp_drake.validation import positive, spd_matrix

__all__ = ["damping_for_ratio", "damping_of_design", "mass_for_frequency", "natural_modes"]


def damping_for_ratio(M: Array, K: Array, zeta: float) -> Array:
    """Returns D = 2ζ A Λ^½ Aᵀ (n, n), with which every mode of M, D, K has the damping ratio ζ.

    For scalars it is 2ζ√(MK). In contact the stiffness of the environment adds to K.

    Args:
        M: mass (n, n), symmetric positive definite [kg or kg m²].
        K: stiffness (n, n), symmetric positive definite [N/m or Nm/rad].
        zeta: ζ, 1 for critical damping.

    Returns:
        The damping, symmetric positive definite [Ns/m or Nms/rad].

    Raises:
        ConfigurationError: M or K is not symmetric positive definite, or not of the same size; ζ
            is not positive.
    """
    positive(zeta, "zeta")
    w, A = natural_modes(M, K)
    D = (A * (2.0 * zeta * w)) @ A.T
    return 0.5 * (D + D.T)


def natural_modes(M: Array, K: Array) -> tuple[Array, Array]:
    """Returns the natural frequencies ω (n,), ascending [rad/s], and A with M = AAᵀ, K = A Λ Aᵀ.

    The columns of A⁻ᵀ are the shapes of the modes.

    Args:
        M: mass (n, n), symmetric positive definite.
        K: stiffness (n, n), symmetric positive definite.

    Raises:
        ConfigurationError: M or K is not symmetric positive definite, or not of the same size.
    """
    size = len(np.atleast_1d(M))
    L = np.linalg.cholesky(spd_matrix(M, "M", size))
    K = spd_matrix(K, "K", size)
    # L⁻¹ K L⁻ᵀ has the eigenvalues of M⁻¹K, and orthonormal eigenvectors.
    squares, V = np.linalg.eigh(np.linalg.solve(L, np.linalg.solve(L, K).T))
    return np.sqrt(squares), L @ V


def mass_for_frequency(K: Array, W: Array) -> Array:
    """Returns M = K^½ W⁻² K^½ (n, n), with which M and K have W's eigenvalues as frequencies.

    For scalars it is K/ω². Where K and W share their axes, each axis has its own frequency.

    Args:
        K: stiffness (n, n), symmetric positive definite [N/m or Nm/rad].
        W: frequencies (n, n), symmetric positive definite [rad/s]; neither is checked.
    """
    root = np.linalg.solve(W, _root(K))
    return root.T @ root


def damping_of_design(M: Array, K: Array, Z: Array) -> Array:
    """Returns D = B^½ Z B^½ (n, n), B being the critical damping `damping_for_ratio(M, K, 1)`.

    With Z = ζI it is `damping_for_ratio(M, K, ζ)`; where Z shares the axes of M and K, each axis
    has its own ratio.

    Args:
        M: mass (n, n), symmetric positive definite [kg or kg m²].
        K: stiffness (n, n), of the environment included [N/m or Nm/rad].
        Z: damping ratios (n, n), symmetric positive definite; not checked.

    Raises:
        ConfigurationError: M or K is not symmetric positive definite, or not of the same size.
    """
    root = _root(damping_for_ratio(M, K, 1.0))
    D = root @ Z @ root
    return 0.5 * (D + D.T)


def _root(A: Array) -> Array:
    """Returns the symmetric square root of a symmetric positive definite matrix."""
    squares, V = np.linalg.eigh(A)
    return (V * np.sqrt(squares)) @ V.T
