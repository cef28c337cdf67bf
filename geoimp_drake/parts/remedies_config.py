"""What an inner loop does against errors of its model: nothing unless it is configured."""

import logging
from dataclasses import dataclass, field

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.typing import Array
from geoimp_drake.validation import key, non_negative, positive

__all__ = [
    "DisturbanceObserverConfig",
    "FrictionConfig",
    "IntegralConfig",
    "RemediesConfig",
]

_log = logging.getLogger("drake")


@dataclass
class IntegralConfig:
    """Integral action on the deviation of E from C."""

    rate: float = 2.0  # K_I = rate K_P: it takes over from the proportional action [1/s]
    largest: float = 0.05  # error whose proportional action is its bound, per axis [rad, m]
    in_contact: bool = False  # false: the integral stays as it is while the hand touches something

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        positive(self.rate, key(name, "rate"), "1/s")
        positive(self.largest, key(name, "largest"))


@dataclass
class DisturbanceObserverConfig:
    """A momentum observer whose residual is subtracted from the torques."""

    gain: float = 30.0  # a disturbance is compensated with a time constant of 1/gain [1/s]
    in_contact: bool = False  # false: the residual stays as it is while the hand touches something

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        positive(self.gain, key(name, "gain"), "1/s")


@dataclass
class FrictionConfig:
    """Friction that is fed forward: one number for all joints, or one each from base to hand."""

    coulomb: Array = field(default_factory=lambda: np.array(0.0))  # F_c of (R.2) [Nm, N]
    viscous: Array = field(default_factory=lambda: np.array(0.0))  # F_v, beyond the model's
    slow: float = 0.01  # v_s, below which the sign of a motion is uncertain [rad/s, m/s]
    share: float = 1.0  # of that friction which is fed forward

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        for value in np.ravel(self.coulomb):
            non_negative(value, key(name, "coulomb"))
        positive(self.slow, key(name, "slow"))
        non_negative(self.share, key(name, "share"))


@dataclass
class RemediesConfig:
    """What an inner loop does against errors of its model; null for nothing."""

    integral: IntegralConfig | None = None
    disturbance_observer: DisturbanceObserverConfig | None = None
    friction: FrictionConfig | None = None
    touch_force: float = 3.0  # force at the wrist that counts as touching something [N]
    touch_moment: float = 0.3  # moment that counts the same [Nm]

    @property
    def is_on(self) -> bool:
        """Whether anything is configured."""
        return any((self.integral, self.disturbance_observer, self.friction))

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        positive(self.touch_force, key(name, "touch_force"), "N")
        positive(self.touch_moment, key(name, "touch_moment"), "Nm")

    def check_rate(self, name: str, damping: float) -> None:
        """Raises ConfigurationError if the integral makes the inner loop of K_D [1/s] unstable."""
        if self.integral is not None and self.integral.rate >= damping:
            raise ConfigurationError(
                f"{key(name, 'integral.rate')} is {self.integral.rate:g} 1/s; from the smaller of "
                f"motion.K_Dp and motion.K_Do on, {damping:g}, the inner loop is unstable."
            )

    def check_scheme(self, name: str, scheme: str, *, is_natural: bool) -> None:
        """Raises ConfigurationError if a remedy has nothing to act on under a scheme."""
        if not self.is_on:
            return
        if scheme == "admittance" or is_natural:
            words = "inertia: natural" if is_natural else f"scheme: {scheme}"
            why = (
                "a contact would count as a disturbance, and be pushed away"
                if is_natural
                else "the arm's own servos make the torques"
            )
            raise ConfigurationError(f"{name} is given, but with {words} {why}. Leave it out.")
        if scheme == "direct" and self.integral is not None:
            raise ConfigurationError(
                f"{key(name, 'integral')} is given, but with scheme: direct C is E itself, and "
                f"there is no error to be integrated. Leave it out, or give disturbance_observer."
            )

    def warn_of_contact(self) -> None:
        """Warns of a remedy that is known to do harm as it is configured."""
        for name in ("integral", "disturbance_observer"):
            remedy = getattr(self, name)
            if remedy is not None and remedy.in_contact:
                _log.warning(
                    f"remedies.{name}.in_contact is true: on joints with Coulomb friction the hand "
                    f"then hunts in contact, with 2 N (standard deviation) where the friction is "
                    f"2 % of the effort limits. Without Coulomb friction it is harmless."
                )
