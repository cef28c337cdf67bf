"""The interface of every family of rotational impedances, whatever represents the displacement."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from copy import copy
from typing import Self

import numpy as np

from geoimp_drake.laws.impedance import angle_axis_impedance
from geoimp_drake.rotations.quaternion import to_rotation
from geoimp_drake.typing import Array

__all__ = ["OrientationImpedance"]


class OrientationImpedance(ABC):
    """A rotational impedance M_o ẍ + D_o ẋ + K(x) = m, in the coordinates x of its family.

    x is the displacement (Δφ_dc, φ_dc, ᶜo_dc or ᶜε_dc), and m is the moment Tᵀ(φ_c)μ, Tᵀ(φ_dc)ᶜμ or
    ᶜμ. The velocity ẋ is the dual of m (Δφ̇_dc, φ̇_dc or Δᶜω_dc). So for every family d(kinetic +
    potential)/dt = supplied power − dissipated power, also while D moves.

    Every method takes the state common to all families, in W. Orientations `Q_WD`, `Q_WC` are unit
    quaternions (4,), and `w_WD`, `w_WC` are angular velocities (3,) [rad/s]. `mu_W` is the moment
    (3,) [Nm] by the end effector on the environment. An object has parameters and no state.

    Attributes:
        name: the family's name in scenarios.
        law: what `angular_acceleration` computes, as a function of the same arguments followed by
            `M_inv`, `D_o` and `K_o`; marked as compilable.
        elastic_law: what `elastic_moment_W` computes, as a function of the same arguments followed
            by `K_o`; compilable.
        axes_law: A as a function of `Q_WC`; compilable. The columns of A are the axes in which the
            family's moment is written. A K_o Aᵀ is the stiffness in W where D equals C.
        has_domain: whether there are attitudes that `check_domain` refuses.
        has_conditioning: whether `conditioning` is ever above 1.
        M_o: inertia (3, 3) [kg m²], symmetric positive definite.
        M_inv: its inverse.
        D_o: damping (3, 3) [Nms/rad], symmetric positive definite.
        K_o: stiffness (3, 3) [Nm/rad], symmetric positive definite.
    """

    name: str
    law: Callable[..., Array]
    elastic_law: Callable[..., Array]
    axes_law: Callable[..., Array] = staticmethod(to_rotation)
    has_domain = False
    has_conditioning = False

    def __init__(self, M_o: Array, D_o: Array, K_o: Array) -> None:
        self.M_o, self.D_o, self.K_o = M_o, D_o, K_o
        self.M_inv = np.linalg.inv(M_o)

    def with_gains(self, D_o: Array, K_o: Array) -> Self:
        """Returns the same family with another damping and stiffness."""
        family = copy(self)
        family.D_o, family.K_o = D_o, K_o
        return family

    def angular_acceleration(
        self, Q_WD: Array, w_WD: Array, dw_WD: Array, Q_WC: Array, w_WC: Array, mu_W: Array
    ) -> Array:
        """ω̇_c (3,), in W [rad/s²]: the family's law solved for the acceleration of C."""
        return self.law(Q_WD, w_WD, dw_WD, Q_WC, w_WC, mu_W, self.M_inv, self.D_o, self.K_o)

    @abstractmethod
    def displacement(self, Q_WD: Array, Q_WC: Array) -> Array:
        """The displacement x (3,): Δφ_dc, φ_dc, ᶜo_dc or ᶜε_dc."""

    @abstractmethod
    def dual_velocity(self, Q_WD: Array, w_WD: Array, Q_WC: Array, w_WC: Array) -> Array:
        """The velocity dual to the family's moment (3,) [rad/s]: Δφ̇_dc, φ̇_dc or Δᶜω_dc."""

    @abstractmethod
    def dual_step(self, before: tuple[Array, Array], after: tuple[Array, Array]) -> Array:
        """The integral of the dual velocity (3,) [rad] from Q_WD, Q_WC to others close by."""

    @abstractmethod
    def generalized_moment(self, Q_WD: Array, Q_WC: Array, mu_W: Array) -> Array:
        """The right side of the family's law (3,) [Nm]: Tᵀ(φ_c)μ, Tᵀ(φ_dc)ᶜμ or ᶜμ."""

    @abstractmethod
    def elastic_moment(self, Q_WD: Array, Q_WC: Array) -> Array:
        """The elastic term of the family's law (3,) [Nm], in the coordinates of its right side."""

    def elastic_moment_W(self, Q_WD: Array, Q_WC: Array) -> Array:
        """The moment `mu_W` (3,), in W [Nm], that holds the spring at rest."""
        return self.elastic_law(Q_WD, Q_WC, self.K_o)

    @abstractmethod
    def potential_energy(self, Q_WD: Array, Q_WC: Array) -> float:
        """The energy in the spring [J]."""

    def kinetic_energy(self, Q_WD: Array, w_WD: Array, Q_WC: Array, w_WC: Array) -> float:
        """(3.15) ½ẋᵀM_oẋ [J]."""
        x_dot = self.dual_velocity(Q_WD, w_WD, Q_WC, w_WC)
        return angle_axis_impedance.kinetic_energy(x_dot, self.M_o)

    def dissipated_power(self, Q_WD: Array, w_WD: Array, Q_WC: Array, w_WC: Array) -> float:
        """(3.21) ẋᵀD_oẋ [W], never negative."""
        x_dot = self.dual_velocity(Q_WD, w_WD, Q_WC, w_WC)
        return np.dot(x_dot, angle_axis_impedance.damping_moment(x_dot, self.D_o))

    def supplied_power(
        self, Q_WD: Array, w_WD: Array, Q_WC: Array, w_WC: Array, mu_W: Array
    ) -> float:
        """(3.17) mᵀẋ [W], the power of the moment on its dual velocity; ᶜμᵀΔᶜω for (3.22)."""
        x_dot = self.dual_velocity(Q_WD, w_WD, Q_WC, w_WC)
        return np.dot(self.generalized_moment(Q_WD, Q_WC, mu_W), x_dot)

    @abstractmethod
    def conditioning(self, Q_WD: Array, Q_WC: Array) -> float:
        """cond(T) of the Euler families, which grows near a singularity; 1 for the others."""

    @abstractmethod
    def check_domain(self, Q_WD: Array, Q_WC: Array) -> None:
        """Refuses attitudes at which the family is not defined; the quaternion takes them all.

        Raises:
            SingularityError: |cos pitch| < 1e-3 in an Euler family.
            OutOfDomainError: the relative orientation has reached ϑ_M of an angle/axis family.
        """
