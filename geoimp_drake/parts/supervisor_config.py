"""When a supervised arm is started, held, braked and stopped."""

from dataclasses import dataclass, field

import numpy as np

from geoimp_drake.validation import UNBOUNDED, key, non_negative, positive

__all__ = ["SupervisorConfig", "SupervisorLimits"]


def _limit(value: float) -> float:
    limit: float = field(default=value, metadata=UNBOUNDED)
    return limit


@dataclass
class SupervisorLimits:
    """Beyond these a supervised arm is braked; .inf is no limit."""

    force: float = _limit(100.0)  # at E [N]
    moment: float = _limit(20.0)  # at E [Nm]
    speed: float = _limit(1.0)  # of E [m/s]
    turning_speed: float = _limit(3.0)  # of E [rad/s]
    tracking: float = _limit(0.02)  # from C to E [m]
    tracking_turn: float = _limit(0.1)  # from C to E [rad]
    torque: float = _limit(1.0)  # requested, as a fraction of a joint's limit
    torque_rate: float = _limit(np.inf)  # sent; braked if too slow for longer than `hold` [Nm/s]
    desired_step: float = _limit(0.01)  # of D between two ticks [m, rad]
    desired_speed_step: float = _limit(0.02)  # of D between two ticks [m/s, rad/s]
    stuck: float = _limit(1e-3)  # path of D over which reading and wrench must change [m, rad]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        for limit, value in vars(self).items():
            if value != np.inf:
                positive(value, key(name, limit))


@dataclass
class SupervisorConfig:
    """When a supervised arm is started, held and stopped."""

    limits: SupervisorLimits = field(default_factory=SupervisorLimits)
    soft_start: float = 0.5  # the torques fade in [s]
    hold: float = 0.02  # longest time without a valid reading or wrench [s]
    brake: float = 0.15  # until D rests [s]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        positive(self.soft_start, key(name, "soft_start"), "s")
        non_negative(self.hold, key(name, "hold"), "s")
        positive(self.brake, key(name, "brake"), "s")
