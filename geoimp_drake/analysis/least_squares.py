"""Linear least squares on a record over time, whose residuals are not independent."""

import numpy as np

from geoimp_drake.typing import Array

__all__ = ["BLOCK", "fitted"]

# Samples that count as one residual.
BLOCK = 20
# Half the width of a 95 % interval in standard errors.
_STUDENT = 2.0
# A direction counts as excited if its singular value is above the first; no norm is below the
# second.
_SINGULAR, _NOTHING = 1e-9, 1e-150


def fitted(columns: Array, load: Array) -> tuple[Array, Array, float, float]:
    """Returns the values that explain a load, and how certain they are.

    Args:
        columns: regressors of each sample (n, 3, m).
        load: of each sample (n, 3).

    Returns:
        The values (m,). Half the width of their 95 % intervals (m,), infinite where the load tells
        nothing about a value. The condition with columns of length 1, infinite if there is such a
        value. The misfit: the norm of the residual divided by that of the load.
    """
    A, b = columns.reshape(-1, columns.shape[2]), load.reshape(-1)
    lengths = np.linalg.norm(A, axis=0)
    excited = lengths > _SINGULAR * lengths.max(initial=_NOTHING)
    scale = np.where(excited, lengths, 1.0)
    _, s, Vt = np.linalg.svd(np.where(excited, A / scale, 0.0), full_matrices=False)
    seen = s > _SINGULAR * np.maximum(s[0], _NOTHING)
    V = Vt[seen].T
    inverse = (V / s[seen] ** 2) @ V.T
    values = inverse @ ((A / scale).T @ b)
    residual = b - (A / scale) @ values
    deviation = np.sqrt(np.diag(inverse) * _variance(columns, residual.reshape(load.shape)))
    # A value with a share in a blind direction is undetermined.
    blind = ~excited | (np.square(Vt[~seen]).sum(axis=0) > _SINGULAR)
    half_widths = np.where(blind, np.inf, _STUDENT * deviation / scale)
    condition = float(s[0] / s[-1]) if np.all(seen) else float("inf")
    misfit = float(np.linalg.norm(residual) / np.maximum(np.linalg.norm(b), _NOTHING))
    return values / scale, half_widths, condition, misfit


def _variance(columns: Array, residual: Array) -> Array:
    """Returns, for each column, the variance of its value times the column's squared length.

    Residuals of neighbouring samples are alike, and the largest come with one impact. So the number
    of independent residuals is that of the blocks of time that share their energy.
    """
    lengths = np.linalg.norm(columns, axis=1, keepdims=True)
    along = np.einsum("nij,ni->nj", columns / np.maximum(lengths, _NOTHING), residual)
    blocks = np.array_split(np.square(along), max(len(along) // BLOCK, 1))
    energy = np.array([block.sum(axis=0) for block in blocks])
    total = energy.sum(axis=0)
    return np.asarray(np.square(energy / np.maximum(total, _NOTHING)).sum(axis=0) * total)
