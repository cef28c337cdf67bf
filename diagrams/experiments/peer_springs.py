"""The orientation springs of other controllers, for comparison with this library's.

Each is a moment ᶜμ as a function of D's orientation seen from C and of a stiffness K_o. It is
scaled so that for small turns it is K_o times the rotation vector: all have the same gains. They
are written from the publications that they name. If these give an acceleration, or another factor,
the docstring says so.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import vector
from geoimp_drake.laws.impedance.families import make_family
from geoimp_drake.rotations import quaternion
from geoimp_drake.rotations.quaternion import to_rotation
from geoimp_drake.typing import Array

__all__ = [
    "OURS",
    "PEERS",
    "SPRINGS",
    "Spring",
    "axis_angle_moment",
    "cross_product_moment",
    "quaternion_vector_moment",
    "seo_moment",
    "seo_stiffness",
]


@compilable
def axis_angle_moment(Q_CD: Array, K_o: Array) -> Array:
    """ᶜμ = K_o ϑr (3,) [Nm], of the rotation vector ϑr with ϑ in [0, π].

    K. M. Lynch and F. C. Park, Modern Robotics, Cambridge 2017, section 11.4.3, whose X_e is the
    logarithm of the relative pose; CRISP (2025) multiplies it by the stiffness.

    Args:
        Q_CD: orientation of D seen from C (4,).
        K_o: stiffness (3, 3), in C [Nm/rad].
    """
    return K_o @ quaternion.log(Q_CD)


@compilable
def quaternion_vector_moment(Q_CD: Array, K_o: Array) -> Array:
    """ᶜμ = 2 K_o ε (3,) [Nm], of the vector part ε of Q_CD as it is given, of either sign.

    J. S.-C. Yuan, "Closed-loop manipulator control using quaternion feedback", IEEE Journal of
    Robotics and Automation 4(4), 1988. There, and in the examples for Franka's arm, the factor 2 is
    missing: their K is twice this K_o.

    Args:
        Q_CD: orientation of D seen from C (4,).
        K_o: stiffness (3, 3), in C [Nm/rad].
    """
    return 2.0 * (K_o @ Q_CD[1:])


@compilable
def cross_product_moment(Q_CD: Array, K_o: Array) -> Array:
    """ᶜμ = K_o ½ Σ cᵢ × dᵢ (3,) [Nm], of the axes cᵢ of C and dᵢ of D: K_o sin ϑ r.

    J. Y. S. Luh, M. W. Walker and R. P. C. Paul, "Resolved-acceleration control of mechanical
    manipulators", IEEE Transactions on Automatic Control 25(3), 1980; O. Khatib, "A unified
    approach for motion and force control of robot manipulators: the operational space formulation",
    IEEE Journal of Robotics and Automation 3(1), 1987. The operational-space controller of
    robosuite has it, with a stiffness of acceleration.

    Args:
        Q_CD: orientation of D seen from C (4,).
        K_o: stiffness (3, 3), in C [Nm/rad].
    """
    R = to_rotation(Q_CD)
    return K_o @ (0.5 * vector(R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]))


def seo_stiffness(K_o: Array) -> Array:
    """Returns K_R = ½ tr(K_o) I − K_o (3, 3) [Nm/rad], for which Seo's spring has K_o.

    Seo asks for a positive definite K_R, so that no eigenvalue of K_o may be larger than the sum of
    the others. For diag(4, 10, 2.5), K_R is diag(4.25, −1.75, 5.75).
    """
    K_R: Array = 0.5 * np.trace(K_o) * np.eye(3) - K_o
    return K_R


def seo_moment(Q_CD: Array, K_R: Array) -> Array:
    """ᶜμ = (R_CD K_R − K_R R_CDᵀ)^∨ (3,) [Nm], the gradient of tr(K_R (I − R_CD)).

    J. Seo et al., "Geometric impedance control on SE(3) for robotic manipulators",
    IFAC-PapersOnLine 56(2), 2023. It is the chapter's quaternion law with K_o = tr(K_R) I − K_R.

    Args:
        Q_CD: orientation of D seen from C (4,).
        K_R: Seo's stiffness (3, 3), see `seo_stiffness` [Nm/rad].
    """
    S = to_rotation(Q_CD) @ K_R
    return np.array([S[2, 1] - S[1, 2], S[0, 2] - S[2, 0], S[1, 0] - S[0, 1]])


Moment = Callable[[Array, Array], Array]

# The springs that are none of this library's families: functions of Q_CD and K_o, compilable.
PEERS: dict[str, Moment] = {
    "axis-angle": axis_angle_moment,
    "quaternion-vector": quaternion_vector_moment,
    "cross-products": cross_product_moment,
}


@dataclass(frozen=True)
class Spring:
    """A spring for tables and figures.

    Attributes:
        title: in words.
        formula: of ᶜμ.
        source: short form of its publication; the law's docstring has the whole.
        moment: ᶜμ (3,) [Nm] from Q_WD and Q_WC (4,), of either sign, and from K_o (3, 3).
    """

    title: str
    formula: str
    source: str
    moment: Callable[[Array, Array, Array], Array]


def _of_peer(moment: Moment) -> Callable[[Array, Array, Array], Array]:
    """Returns the moment of a peer, which does not know which sign of a quaternion to take."""

    def of_attitudes(Q_WD: Array, Q_WC: Array, K_o: Array) -> Array:
        return moment(quaternion.product(quaternion.conjugate(Q_WC), Q_WD), K_o)

    return of_attitudes


def _of_family(name: str) -> Callable[[Array, Array, Array], Array]:
    """Returns the moment of one of this library's families, in C."""

    def of_attitudes(Q_WD: Array, Q_WC: Array, K_o: Array) -> Array:
        family = make_family(name, np.eye(3), np.eye(3), K_o)
        moment: Array = to_rotation(Q_WC).T @ family.elastic_moment_W(Q_WD, Q_WC)
        return moment

    return of_attitudes


OURS = "quaternion"

SPRINGS = {
    OURS: Spring("quaternion (ours)", "2 Eᵀ K ε", "chapter (3.30)", _of_family(OURS)),
    "angle-axis-simple": Spring(
        "angle and axis (ours)", "Ωᵀ K ϑr", "chapter (3.22)", _of_family("angle-axis-simple")
    ),
    "seo": Spring(
        "Seo, SE(3)",
        "(R K_R − K_R Rᵀ)^∨",
        "Seo et al. 2023",
        _of_peer(lambda Q_CD, K_o: seo_moment(Q_CD, seo_stiffness(K_o))),
    ),
    "axis-angle": Spring("axis-angle", "K ϑr", "Lynch and Park 2017", _of_peer(axis_angle_moment)),
    "quaternion-vector": Spring(
        "quaternion vector", "2 K ε", "Yuan 1988", _of_peer(quaternion_vector_moment)
    ),
    "cross-products": Spring(
        "cross products",
        "K ½ Σ cᵢ × dᵢ",
        "Luh et al. 1980, Khatib 1987",
        _of_peer(cross_product_moment),
    ),
    "classical-euler": Spring(
        "classical Euler", "RᵀT⁻ᵀ K Δφ", "chapter (3.3)", _of_family("classical-euler")
    ),
    "alternative-euler": Spring(
        "alternative Euler", "T⁻ᵀ K φ", "chapter (3.6)", _of_family("alternative-euler")
    ),
}
