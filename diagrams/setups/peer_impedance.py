"""An impedance with another controller's orientation spring, only for experiments."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.controllers.impedance_config import ImpedanceConfig
from geoimp_drake.diagrams.experiments.peer_springs import PEERS
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.impedance import compliant_rotation
from geoimp_drake.laws.impedance.families import OrientationImpedance, QuaternionImpedance
from geoimp_drake.rotations.quaternion import relative, to_rotation
from geoimp_drake.typing import Array
from geoimp_drake.validation import choice, key

__all__ = ["PeerImpedance", "PeerImpedanceConfig"]


@cache
def _angular_acceleration(moment: Callable[..., Array]) -> Callable[..., Array]:
    """Returns the quaternion family's law for ω̇_c with another moment instead of K′_oᶜε_dc."""

    @compilable
    def law(
        Q_WD: Array,
        w_WD: Array,
        dw_WD: Array,
        Q_WC: Array,
        w_WC: Array,
        mu_W: Array,
        M_inv: Array,
        D_o: Array,
        K_o: Array,
    ) -> Array:
        R_WC = to_rotation(Q_WC)
        w_CD_C = compliant_rotation.relative_angular_velocity(R_WC, w_WD, w_WC)
        elastic = moment(relative(Q_WC, Q_WD), K_o)
        dw_CD_C = M_inv @ (R_WC.T @ mu_W - D_o @ w_CD_C - elastic)
        return compliant_rotation.angular_acceleration(dw_WD, R_WC, w_WC, w_CD_C, dw_CD_C)

    return law


@cache
def _elastic_moment_W(moment: Callable[..., Array]) -> Callable[..., Array]:
    @compilable
    def law(Q_WD: Array, Q_WC: Array, K_o: Array) -> Array:
        return to_rotation(Q_WC) @ moment(relative(Q_WC, Q_WD), K_o)

    return law


class PeerImpedance(QuaternionImpedance):
    """The quaternion family with the spring of another controller, which has no potential."""

    def __init__(self, name: str, M_o: Array, D_o: Array, K_o: Array):
        super().__init__(M_o, D_o, K_o)
        self.name, self._moment = name, PEERS[name]
        self.law = _angular_acceleration(self._moment)
        self.elastic_law = _elastic_moment_W(self._moment)

    def _elastic_moment_C(self, Q_CD: Array) -> Array:
        return self._moment(Q_CD, self.K_o)

    def potential_energy(self, Q_WD: Array, Q_WC: Array) -> float:
        """Zero: this spring's work depends on the path; an audit shows it as its error."""
        return 0.0


@dataclass
class PeerImpedanceConfig(ImpedanceConfig):
    """An impedance that may have another controller's orientation spring."""

    spring: str | None = None  # of `PEERS`, instead of the orientation family's

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        super().validate(name)
        if self.spring is None:
            return
        choice(self.spring, key(name, "spring"), PEERS)
        if self.orientation != "quaternion":
            raise ConfigurationError(
                f"{key(name, 'spring')} is '{self.spring}', and {key(name, 'orientation')} is "
                f"'{self.orientation}': one of them says what the spring is. Give the orientation "
                f"quaternion, or leave the spring out."
            )

    def make_rotation(self) -> OrientationImpedance:
        """Returns the orientation family, or the spring that replaces it, with its gains."""
        if self.spring is None:
            return super().make_rotation()
        return PeerImpedance(self.spring, *self.gains("rotation"))
