"""Elastic coupling K_c between the translation and the rotation of the quaternion impedance.

The displacement Δp = R_dᵀ(p_d − p_c) and the force are in D, and so is K_p here. ε is the same in C
and in D. With Δp in C the moment would need an extra Δp × f. `Q_CD` is {η_dc, ᶜε_dc}.
"""

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.impedance import quaternion_impedance, translational_impedance
from geoimp_drake.rotations.quaternion import E, relative, to_rotation
from geoimp_drake.typing import Array

__all__ = [
    "check_positive_definite",
    "coupling_energy",
    "coupling_force",
    "coupling_moment",
    "elastic_force",
    "elastic_moment",
    "potential_energy",
    "stiffness_matrix",
    "without_coupling",
]


@compilable
def coupling_energy(Q_CD: Array, dp_D: Array, K_c: Array) -> float:
    """(3.31 coupled) 2η εᵀK_cΔp [J], the coupling's part of the potential; K_c (3, 3) in [N]."""
    return 2.0 * Q_CD[0] * (Q_CD[1:] @ (K_c @ dp_D))


@compilable
def coupling_force(Q_CD: Array, K_c: Array) -> Array:
    """(3.31 coupled) 2η K_cᵀε (3,), in D [N], the coupling's part of the force."""
    return (2.0 * Q_CD[0]) * (K_c.T @ Q_CD[1:])


@compilable
def coupling_moment(Q_CD: Array, dp_D: Array, K_c: Array) -> Array:
    """(3.31 coupled) (ηEᵀ − εεᵀ)K_cΔp (3,), in C [Nm], the coupling's part of the moment."""
    force = K_c @ dp_D
    epsilon = Q_CD[1:]
    return Q_CD[0] * (E(Q_CD).T @ force) - epsilon * (epsilon @ force)


@compilable
def without_coupling(
    Q_WD: Array, Q_WC: Array, dp_W: Array, mu_W: Array, f_W: Array, K_p: Array, K_c: Array
) -> tuple[Array, Array, Array]:
    """(3.31 coupled) The load that is left for (3.1) and (3.30), in W.

    Args:
        Q_WD: orientation of D (4,).
        Q_WC: orientation of C (4,).
        dp_W: Δp_dc (3,), in W [m].
        mu_W: moment by the end effector on the environment (3,), in W [Nm].
        f_W: force by the end effector on the environment (3,), in W [N].
        K_p: stiffness (3, 3), in D [N/m].
        K_c: coupling (3, 3), in D [N].

    Returns:
        Moment and force (3,) without the coupling's part, and K_p (3, 3) in W.
    """
    R_WD, Q_CD = to_rotation(Q_WD), relative(Q_WC, Q_WD)
    moment_C = coupling_moment(Q_CD, R_WD.T @ dp_W, K_c)
    force_D = coupling_force(Q_CD, K_c)
    return mu_W - to_rotation(Q_WC) @ moment_C, f_W - R_WD @ force_D, R_WD @ K_p @ R_WD.T


def potential_energy(Q_CD: Array, dp_D: Array, K_p: Array, K_o: Array, K_c: Array) -> float:
    """(3.31 coupled) ½ΔpᵀK_pΔp + 2εᵀK_oε + 2η εᵀK_cΔp [J]."""
    translation = translational_impedance.potential_energy(dp_D, K_p)
    rotation = quaternion_impedance.potential_energy(Q_CD, K_o)
    return translation + rotation + coupling_energy(Q_CD, dp_D, K_c)


@compilable
def elastic_force(Q_CD: Array, dp_D: Array, K_p: Array, K_c: Array) -> Array:
    """(3.31 coupled) K_pΔp + 2η K_cᵀε (3,), in D [N]: the potential's gradient in Δp."""
    return K_p @ dp_D + coupling_force(Q_CD, K_c)


@compilable
def elastic_moment(Q_CD: Array, dp_D: Array, K_o: Array, K_c: Array) -> Array:
    """(3.31 coupled) 2EᵀK_oε + (ηEᵀ − εεᵀ)K_cΔp (3,), in C [Nm]: its gradient in rotation."""
    return quaternion_impedance.elastic_moment(Q_CD, K_o) + coupling_moment(Q_CD, dp_D, K_c)


def stiffness_matrix(K_p: Array, K_o: Array, K_c: Array) -> Array:
    """(3.31 coupled) The linearised stiffness [[K_o, K_c], [K_cᵀ, K_p]] (6, 6), [angular; linear].

    It maps a small displacement [rotation; translation] to [moment; force].
    """
    return np.block([[K_o, K_c], [K_c.T, K_p]])


def check_positive_definite(K_p: Array, K_o: Array, K_c: Array) -> None:
    """Refuses a coupling with which the spring would push away from D; floats only.

    Raises:
        ConfigurationError: the linearised 6×6 stiffness is not positive definite.
    """
    smallest = float(np.linalg.eigvalsh(stiffness_matrix(K_p, K_o, K_c))[0])
    if not smallest > 0.0:
        raise ConfigurationError(
            f"the coupling makes the 6×6 stiffness indefinite: its smallest eigenvalue is "
            f"{smallest:.4g}, not positive. Reduce K_c, or raise K_p or K_o."
        )
