"""The scenario of a run with one arm whose end effector somebody turns, see `turned_arm`."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from geoimp_drake.diagrams.scene.turning_hand import HandConfig
from geoimp_drake.diagrams.setups.peer_impedance import PeerImpedanceConfig
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.systems.sources.desired_motion import MotionSegment
from geoimp_drake.validation import key

__all__ = ["TurnedArmScenario"]


@dataclass
class TurnedArmScenario(SingleArmScenario):
    """A run with one arm, and the motion of somebody's hand on its end effector."""

    impedance: PeerImpedanceConfig = field(default_factory=PeerImpedanceConfig)
    hand: HandConfig = field(default_factory=HandConfig)

    @property
    def length(self) -> float:
        """Length of the run [s]: its duration, or until the hand has finished its laps."""
        return self.hand.duration if self.duration is None else self.duration

    def check_moves(self, segments: Sequence[MotionSegment]) -> None:
        """Raises ConfigurationError if D is to move, or the run is too long."""
        if segments:
            raise ConfigurationError(
                f"There are {len(segments)} segments; D rests while a hand turns the end effector "
                f"about it. Leave segments out."
            )
        self.check_length(self.length)

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        super().validate(name)
        if self.external is not None:
            raise ConfigurationError(
                f"{key(name, 'external')} is given, but the plant takes one wrench on the end "
                f"effector, and that is the hand's. Leave it out."
            )
        if self.engine != "drake":
            raise ConfigurationError(
                f"{key(name, 'engine')} is '{self.engine}', where no hand turns the end effector; "
                f"use drake."
            )
