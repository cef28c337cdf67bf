"""The stiffness of Seo's geometric impedance control, which is the quaternion law's."""

import numpy as np

from geoimp_drake.typing import Array

__all__ = ["stiffness_from_trace_form"]


def stiffness_from_trace_form(K_R: Array) -> Array:
    """(3.29 trace) K_o = tr(K_R) I − K_R (3, 3): 2εᵀK_oε is then tr(K_R (I − ᵈR_c)).

    ᵈR_c = I + 2ηS(ε) + 2S(ε)² up to the sign of ε, and S(ε)² = εεᵀ − εᵀε I. For K_R = k I it is
    2k I. J. Seo et al., "Geometric impedance control on SE(3) for robotic manipulators",
    IFAC-PapersOnLine 56(2), 2023.

    Args:
        K_R: symmetric positive definite (3, 3) [Nm/rad].

    Returns:
        K_o [Nm/rad], positive definite: its eigenvalues are sums of two of K_R's.
    """
    stiffness: Array = np.trace(K_R) * np.eye(3) - K_R
    return stiffness
