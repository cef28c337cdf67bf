"""The families whose displacement is a triple of Euler angles, classical and alternative."""

from geoimp_drake.laws.impedance import (
    alternative_euler_impedance,
    compliant_rotation,
    euler_impedance,
)
from geoimp_drake.laws.impedance.orientation_impedance import OrientationImpedance
from geoimp_drake.rotations import euler
from geoimp_drake.rotations.quaternion import relative, to_rotation
from geoimp_drake.typing import Array

__all__ = ["AlternativeEulerImpedance", "ClassicalEulerImpedance"]


class _EulerImpedance(OrientationImpedance):
    """What the two Euler families share: a potential that is quadratic in their angles."""

    has_domain = True
    has_conditioning = True

    def dual_step(self, before: tuple[Array, Array], after: tuple[Array, Array]) -> Array:
        """(3.3), (3.6) The change of Δφ_dc or of φ_dc (3,) [rad]."""
        return euler.wrapped(self.displacement(*after) - self.displacement(*before))

    def elastic_moment(self, Q_WD: Array, Q_WC: Array) -> Array:
        """(3.3), (3.6) K_oΔφ_dc or K_oφ_dc (3,) [Nm]."""
        return self.K_o @ self.displacement(Q_WD, Q_WC)

    def potential_energy(self, Q_WD: Array, Q_WC: Array) -> float:
        """(3.3), (3.6) ½ΔφᵀK_oΔφ or ½φᵀK_oφ [J]."""
        phi = self.displacement(Q_WD, Q_WC)
        return 0.5 * (phi @ (self.K_o @ phi))


class ClassicalEulerImpedance(_EulerImpedance):
    """(3.3) M_o Δφ̈_dc + D_o Δφ̇_dc + K_o Δφ_dc = Tᵀ(φ_c) μ: singular at pitch ±π/2 of C or D."""

    name = "classical-euler"
    law = staticmethod(euler_impedance.compliant_angular_acceleration)
    elastic_law = staticmethod(euler_impedance.elastic_moment_W)
    axes_law = staticmethod(euler_impedance.moment_axes)

    def displacement(self, Q_WD: Array, Q_WC: Array) -> Array:
        """(3.3) Δφ_dc = φ_d − φ_c (3,), each angle in (−π, π] [rad]."""
        return euler.wrapped(_angles(Q_WD) - _angles(Q_WC))

    def dual_velocity(self, Q_WD: Array, w_WD: Array, Q_WC: Array, w_WC: Array) -> Array:
        """(3.3) Δφ̇_dc = T⁻¹(φ_d)ω_d − T⁻¹(φ_c)ω_c (3,) [rad/s]."""
        return euler.T_inverse(_angles(Q_WD)) @ w_WD - euler.T_inverse(_angles(Q_WC)) @ w_WC

    def generalized_moment(self, Q_WD: Array, Q_WC: Array, mu_W: Array) -> Array:
        """(3.3) Tᵀ(φ_c) μ (3,) [Nm]."""
        return euler.T(_angles(Q_WC)).T @ mu_W

    def conditioning(self, Q_WD: Array, Q_WC: Array) -> float:
        """(3.3) cond(T(φ_c))."""
        return euler.condition_number(_angles(Q_WC))

    def check_domain(self, Q_WD: Array, Q_WC: Array) -> None:
        """Raises SingularityError where |cos pitch| of D or of C is below 1e-3."""
        euler.check_regular(_angles(Q_WD), "classical-euler, attitude of D in W")
        euler.check_regular(_angles(Q_WC), "classical-euler, attitude of C in W")


class AlternativeEulerImpedance(_EulerImpedance):
    """(3.6) M_o φ̈_dc + D_o φ̇_dc + K_o φ_dc = Tᵀ(φ_dc) ᶜμ: singular at relative pitch ±π/2."""

    name = "alternative-euler"
    law = staticmethod(alternative_euler_impedance.angular_acceleration)
    elastic_law = staticmethod(alternative_euler_impedance.elastic_moment_W)

    def displacement(self, Q_WD: Array, Q_WC: Array) -> Array:
        """(3.6) φ_dc (3,), the angles of ᶜR_d [rad]."""
        return _angles(relative(Q_WC, Q_WD))

    def dual_velocity(self, Q_WD: Array, w_WD: Array, Q_WC: Array, w_WC: Array) -> Array:
        """(3.7) φ̇_dc = T⁻¹(φ_dc) Δᶜω_dc (3,) [rad/s]."""
        w_CD_C = compliant_rotation.relative_angular_velocity(to_rotation(Q_WC), w_WD, w_WC)
        return euler.T_inverse(self.displacement(Q_WD, Q_WC)) @ w_CD_C

    def generalized_moment(self, Q_WD: Array, Q_WC: Array, mu_W: Array) -> Array:
        """(3.6) Tᵀ(φ_dc) ᶜμ (3,) [Nm]."""
        return euler.T(self.displacement(Q_WD, Q_WC)).T @ (to_rotation(Q_WC).T @ mu_W)

    def conditioning(self, Q_WD: Array, Q_WC: Array) -> float:
        """(3.6) cond(T(φ_dc))."""
        return euler.condition_number(self.displacement(Q_WD, Q_WC))

    def check_domain(self, Q_WD: Array, Q_WC: Array) -> None:
        """Raises SingularityError where |cos pitch| of ᶜR_d is below 1e-3."""
        euler.check_regular(
            self.displacement(Q_WD, Q_WC), "alternative-euler, attitude of D seen from C"
        )


def _angles(Q: Array) -> Array:
    return euler.from_rotation(to_rotation(Q))
