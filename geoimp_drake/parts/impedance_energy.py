"""Energies and powers of the six-DOF impedance."""

from typing import Any

import numpy as np
from pydrake.common.containers import namedview

from geoimp_drake.laws.frame_motion import (
    ANGULAR_VELOCITY,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
)
from geoimp_drake.laws.impedance import (
    coupled_damping,
    coupled_stiffness,
    translational_impedance,
)
from geoimp_drake.laws.impedance.compliant_rotation import relative_angular_velocity
from geoimp_drake.laws.impedance.families import OrientationImpedance
from geoimp_drake.parts.impedance_gains import LawGains
from geoimp_drake.rotations import quaternion
from geoimp_drake.typing import Array

__all__ = ["Energies", "ImpedanceEnergy", "dissipated_power", "stored_energy"]

ImpedanceEnergy = namedview(
    "ImpedanceEnergy",
    [
        f"{part}_{quantity}"
        for part in ("translational", "rotational")
        for quantity in ("kinetic", "potential", "supplied_power", "dissipated_power")
    ]
    + ["coupling_potential"],
)


class Energies:
    """Evaluates energies and powers of (3.1), and of an orientation family as (3.15)-(3.21).

    Args:
        M: M_p (3×3), in the axes of the gains [kg].
        rotation: the orientation family with its inertia.
    """

    def __init__(self, M: Array, rotation: OrientationImpedance):
        self._M, self._rotation = M, rotation

    def evaluate(self, D: Array, C: Array, wrench: Array, gains: LawGains) -> Array:
        """Returns ImpedanceEnergy (9,) [J, W].

        Args:
            D: motion of D (19,).
            C: motion of C (19,).
            wrench: at the end effector (6,).
            gains: as `ImpedanceGains.at` returns them.
        """
        translation, (_, D_o, K_o), (K_c, D_c), (*_, couples, turns, damps) = gains
        rotation = self._rotation.with_gains(D_o, K_o)
        energy = ImpedanceEnergy(
            np.array(
                [
                    *self._translational_energy(C, D, wrench[3:], translation, (couples, turns)),
                    *_rotational_energy(rotation, C, D, wrench),
                    _coupling_energy(C, D, K_c) if couples else 0.0,
                ]
            )
        )
        if damps:
            power = _coupled_power(C, D, D_c, turns=turns)
            energy.translational_dissipated_power += power
            energy.rotational_dissipated_power += power
        return np.asarray(energy)

    def _translational_energy(
        self, C: Array, D: Array, force: Array, gains: Array, parts: tuple[bool, bool]
    ) -> tuple[float, ...]:
        (couples, turns), (_, D_p, K_p) = parts, gains
        dp = D[POSITION] - C[POSITION]
        dv = D[LINEAR_VELOCITY] - C[LINEAR_VELOCITY]
        power = translational_impedance.supplied_power(dv, force)
        R_WD = quaternion.to_rotation(D[QUATERNION])
        if turns or couples:
            dp = R_WD.T @ dp
        if turns:
            dv = R_WD.T @ dv
        return (
            translational_impedance.kinetic_energy(dv, self._M),
            translational_impedance.potential_energy(dp, K_p),
            power,
            translational_impedance.dissipated_power(dv, D_p),
        )


def stored_energy(energy: Array) -> Any:
    """Returns the potential in an ImpedanceEnergy (9,), or in several (9, N) [J]."""
    view = ImpedanceEnergy(energy)
    return view.translational_potential + view.rotational_potential + view.coupling_potential


def dissipated_power(energy: Array) -> Any:
    """Returns the power that damping dissipates, of one ImpedanceEnergy (9,) or more (9, N) [W]."""
    view = ImpedanceEnergy(energy)
    return view.translational_dissipated_power + view.rotational_dissipated_power


def _coupling_energy(C: Array, D: Array, K_c: Array) -> float:
    R_WD = quaternion.to_rotation(D[QUATERNION])
    Q_CD = quaternion.relative(C[QUATERNION], D[QUATERNION])
    return coupled_stiffness.coupling_energy(Q_CD, R_WD.T @ (D[POSITION] - C[POSITION]), K_c)


def _coupled_power(C: Array, D: Array, D_c: Array, *, turns: bool) -> float:
    R_WC = quaternion.to_rotation(C[QUATERNION])
    w = relative_angular_velocity(R_WC, D[ANGULAR_VELOCITY], C[ANGULAR_VELOCITY])
    dv = D[LINEAR_VELOCITY] - C[LINEAR_VELOCITY]
    if turns:
        dv = quaternion.to_rotation(D[QUATERNION]).T @ dv
    return coupled_damping.coupled_power(w, dv, D_c)


def _rotational_energy(
    rotation: OrientationImpedance, C: Array, D: Array, wrench: Array
) -> tuple[float, ...]:
    relative = (D[QUATERNION], D[ANGULAR_VELOCITY], C[QUATERNION], C[ANGULAR_VELOCITY])
    return (
        rotation.kinetic_energy(*relative),
        rotation.potential_energy(D[QUATERNION], C[QUATERNION]),
        rotation.supplied_power(*relative, wrench[:3]),
        rotation.dissipated_power(*relative),
    )
