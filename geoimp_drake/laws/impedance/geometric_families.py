"""The families whose displacement lies along the axis of the relative rotation.

They are the chapter's geometrically consistent impedances (3.22). The velocity in the law is dual
to the moment. At every attitude the stiffness at zero displacement is K_o, with its principal axes.
"""

from abc import abstractmethod

from geoimp_drake.laws.impedance import (
    angle_axis_impedance,
    compliant_rotation,
    quaternion_impedance,
)
from geoimp_drake.laws.impedance.orientation_impedance import OrientationImpedance
from geoimp_drake.rotations import angle_axis, quaternion
from geoimp_drake.rotations.angle_axis import Representation
from geoimp_drake.rotations.quaternion import relative, to_rotation
from geoimp_drake.typing import Array

__all__ = ["AngleAxisImpedance", "QuaternionImpedance"]


class _GeometricImpedance(OrientationImpedance):
    """(3.22) the law shared by every displacement along the axis of the relative rotation."""

    @abstractmethod
    def _elastic_moment_C(self, Q_CD: Array) -> Array: ...

    def dual_velocity(self, Q_WD: Array, w_WD: Array, Q_WC: Array, w_WC: Array) -> Array:
        """(3.17) Δᶜω_dc (3,), in C [rad/s]."""
        return compliant_rotation.relative_angular_velocity(to_rotation(Q_WC), w_WD, w_WC)

    def dual_step(self, before: tuple[Array, Array], after: tuple[Array, Array]) -> Array:
        """(3.17) ∫Δᶜω_dc dt (3,) [rad]: the rotation vector from ᶜR_d before to ᶜR_d after."""
        Q_CD, later = (relative(Q_WC, Q_WD) for Q_WD, Q_WC in (before, after))
        return quaternion.log(quaternion.product(later, quaternion.conjugate(Q_CD)))

    def generalized_moment(self, Q_WD: Array, Q_WC: Array, mu_W: Array) -> Array:
        """(3.22) ᶜμ (3,), in C [Nm]."""
        return to_rotation(Q_WC).T @ mu_W

    def elastic_moment(self, Q_WD: Array, Q_WC: Array) -> Array:
        """(3.20) K′_o ᶜo_dc (3,), in C [Nm]."""
        return self._elastic_moment_C(relative(Q_WC, Q_WD))

    def conditioning(self, Q_WD: Array, Q_WC: Array) -> float:
        """Returns 1: the law contains no inverse of a representation."""
        return 1.0


class QuaternionImpedance(_GeometricImpedance):
    """(3.30) M_o Δᶜω̇_dc + D_o Δᶜω_dc + K′_o ᶜε_dc = ᶜμ: defined at every attitude."""

    name = "quaternion"
    law = staticmethod(quaternion_impedance.angular_acceleration)
    elastic_law = staticmethod(quaternion_impedance.elastic_moment_W)

    def _elastic_moment_C(self, Q_CD: Array) -> Array:
        return quaternion_impedance.elastic_moment(Q_CD, self.K_o)

    def displacement(self, Q_WD: Array, Q_WC: Array) -> Array:
        """(3.30) ᶜε_dc (3,)."""
        return relative(Q_WC, Q_WD)[1:]

    def potential_energy(self, Q_WD: Array, Q_WC: Array) -> float:
        """(3.29) 2 ᶜεᵀK_oᶜε [J]."""
        return quaternion_impedance.potential_energy(relative(Q_WC, Q_WD), self.K_o)

    def check_domain(self, Q_WD: Array, Q_WC: Array) -> None:
        """Refuses no attitude."""


class AngleAxisImpedance(_GeometricImpedance):
    """(3.22) M_o Δᶜω̇_dc + D_o Δᶜω_dc + K′_o ᶜo_dc = ᶜμ: defined for |ϑ_dc| < ϑ_M of its f.

    Attributes:
        row: its function f, a row of Table 2.1.
        psi: ψ of (3.26).
    """

    has_domain = True

    def __init__(self, row: Representation, M_o: Array, D_o: Array, K_o: Array) -> None:
        super().__init__(M_o, D_o, K_o)
        self.name = f"angle-axis-{row.name}"
        self.law = angle_axis_impedance.angular_acceleration(row)
        self.elastic_law = angle_axis_impedance.elastic_moment_W(row)
        self.row = row
        self.psi = angle_axis_impedance.psi(row.f_prime_at_zero)

    def _elastic_moment_C(self, Q_CD: Array) -> Array:
        o, Omega = angle_axis.displacement(self.row, Q_CD), angle_axis.omega(self.row, Q_CD)
        return angle_axis_impedance.elastic_moment(o, Omega, self.K_o, self.psi)

    def displacement(self, Q_WD: Array, Q_WC: Array) -> Array:
        """(3.11) ᶜo_dc = f(ϑ_dc) ᶜr_dc (3,)."""
        return angle_axis.displacement(self.row, relative(Q_WC, Q_WD))

    def potential_energy(self, Q_WD: Array, Q_WC: Array) -> float:
        """(3.16) ψ ᶜoᵀK_oᶜo [J]."""
        o = self.displacement(Q_WD, Q_WC)
        return angle_axis_impedance.potential_energy(o, self.K_o, self.psi)

    def check_domain(self, Q_WD: Array, Q_WC: Array) -> None:
        """Raises OutOfDomainError where ϑ_dc has reached ϑ_M, within its tolerance."""
        angle_axis.check_domain(self.row, relative(Q_WC, Q_WD))
