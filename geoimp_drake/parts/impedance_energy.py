"""Energies and powers of the six-DOF impedance."""

import numpy as np
from pydrake.common.containers import namedview

from geoimp_drake.laws.frame_motion import (
    ANGULAR_VELOCITY,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
)
from geoimp_drake.laws.impedance import coupled_stiffness, translational_impedance
from geoimp_drake.laws.impedance.families import OrientationImpedance
from geoimp_drake.rotations import quaternion
from geoimp_drake.typing import Array

__all__ = ["Energies", "ImpedanceEnergy"]

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
    """Evaluates the energies and powers of section 3.2.

    Args:
        M, D, K: of translation (3×3) [kg, Ns/m, N/m].
        rotation: the orientation family with its gains.
        K_c: coupling (3×3) [N]; None for none. With one, K is in D.
        in_desired: whether M, D and K are in D; otherwise in W.
    """

    def __init__(
        self,
        M: Array,
        D: Array,
        K: Array,
        rotation: OrientationImpedance,
        K_c: Array | None,
        *,
        in_desired: bool = False,
    ):
        self._M, self._D, self._K = M, D, K
        self._rotation, self._K_c = rotation, K_c
        self._turns, self._spring_turns = in_desired, in_desired or K_c is not None

    def evaluate(self, D: Array, C: Array, wrench: Array, scale: Array) -> Array:
        """Returns ImpedanceEnergy (9,) [J, W].

        Args:
            D: motion of D (19,).
            C: motion of C (19,).
            wrench: at the end effector (6,).
            scale: factors of K_p and K_o (2,).
        """
        energy = ImpedanceEnergy(
            np.array(
                [
                    *self._translational_energy(C, D, wrench[3:]),
                    *self._rotational_energy(C, D, wrench),
                    self._coupling_energy(C, D),
                ]
            )
        )
        energy.translational_potential *= scale[0]
        energy.rotational_potential *= scale[1]
        return np.asarray(energy)

    def _coupling_energy(self, C: Array, D: Array) -> float:
        if self._K_c is None:
            return 0.0
        R_WD = quaternion.to_rotation(D[QUATERNION])
        Q_CD = quaternion.relative(C[QUATERNION], D[QUATERNION])
        return coupled_stiffness.coupling_energy(
            Q_CD, R_WD.T @ (D[POSITION] - C[POSITION]), self._K_c
        )

    def _translational_energy(self, C: Array, D: Array, force: Array) -> tuple[float, ...]:
        dp = D[POSITION] - C[POSITION]
        dv = D[LINEAR_VELOCITY] - C[LINEAR_VELOCITY]
        power = translational_impedance.supplied_power(dv, force)
        R_WD = quaternion.to_rotation(D[QUATERNION])
        if self._spring_turns:
            dp = R_WD.T @ dp
        if self._turns:
            dv = R_WD.T @ dv
        return (
            translational_impedance.kinetic_energy(dv, self._M),
            translational_impedance.potential_energy(dp, self._K),
            power,
            translational_impedance.dissipated_power(dv, self._D),
        )

    def _rotational_energy(self, C: Array, D: Array, wrench: Array) -> tuple[float, ...]:
        relative = (D[QUATERNION], D[ANGULAR_VELOCITY], C[QUATERNION], C[ANGULAR_VELOCITY])
        return (
            self._rotation.kinetic_energy(*relative),
            self._rotation.potential_energy(D[QUATERNION], C[QUATERNION]),
            self._rotation.supplied_power(*relative, wrench[:3]),
            self._rotation.dissipated_power(*relative),
        )
