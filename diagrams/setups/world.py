"""Properties of a run's plant that its controller does not know; by default none."""

from dataclasses import dataclass, field

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.typing import Array
from geoimp_drake.validation import (
    LARGEST_SEED,
    finite_vector,
    key,
    non_negative,
    positive,
    whole_number,
)

__all__ = ["JointErrors", "KinematicErrors", "LinkErrors", "PayloadError", "WorldConfig"]

_LONGEST_DELAY = 1.0  # [s]


def _fill_in(
    drawn: dict[str, list[float]],
    names: list[str],
    nominal: Array,
    largest: Array,
    seed: int | list[int],
    of: tuple[str, str],
) -> None:
    """Draws numbers for each name, uniformly within `largest` of the nominal ones.

    If there are some already, or nothing is to be drawn, they stay as they are.

    Args:
        drawn: gets the numbers, by name.
        names: of all that need numbers.
        nominal: numbers (k,).
        largest: largest distance of each from the nominal one (k,).
        seed: of the draws.
        of: the configuration's name, and the kind of the names, for errors.

    Raises:
        ConfigurationError: there are numbers for other names.
    """
    if drawn and set(drawn) != set(names):
        raise ConfigurationError(
            f"world.{of[0]}.drawn is given for {', '.join(sorted(drawn))}; the {of[1]} are "
            f"{', '.join(names)}. Give {len(nominal)} numbers for each, or leave it out."
        )
    if drawn or not largest.any():
        return
    rng = np.random.default_rng(seed)
    for name in names:
        drawn[name] = (nominal + largest * rng.uniform(-1.0, 1.0, len(nominal))).tolist()


@dataclass
class LinkErrors:
    """How the arms' links differ from the controller's model of them.

    With a spread, each link's own factor, or shift, is drawn uniformly within it. The draws are in
    `drawn`, where they can also be given.
    """

    mass: float = 1.0  # factor of every mass, its inertia included
    inertia: float = 1.0  # further factor of every inertia about the centre of mass
    centre: Array = field(default_factory=lambda: np.zeros(3))  # shift, in the link's axes [m]
    mass_spread: float = 0.0  # 0.1 for factors from 0.9 to 1.1
    inertia_spread: float = 0.0
    centre_spread: float = 0.0  # along each axis [m]
    # By link: factors of mass and inertia, and the shift (5).
    drawn: dict[str, list[float]] = field(default_factory=dict)

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        for factor in ("mass", "inertia"):
            positive(getattr(self, factor), key(name, factor))
            spread = f"{factor}_spread"
            non_negative(getattr(self, spread), key(name, spread))
            positive(1.0 - getattr(self, spread), f"1 less {key(name, spread)}")
        finite_vector(self.centre, key(name, "centre"), 3)
        non_negative(self.centre_spread, key(name, "centre_spread"), "m")
        for link, drawn in self.drawn.items():
            finite_vector(np.array(drawn), f"{key(name, 'drawn')}.{link}", 5)
            positive(min(drawn[:2]), f"a factor in {key(name, 'drawn')}.{link}")

    def is_none(self) -> bool:
        """Returns whether the links are as the controller knows them."""
        given = (self.mass - 1.0, self.inertia - 1.0, *self.centre)
        return not (any(given) or any(self._spreads()) or self.drawn)

    def draw(self, links: list[str], seed: int) -> None:
        """Fills in `drawn` for these links, unless it is given or nothing is to be drawn.

        Raises:
            ConfigurationError: `drawn` is given for other links.
        """
        nominal = np.array([1.0, 1.0, 0.0, 0.0, 0.0])
        largest = np.repeat(self._spreads(), (1, 1, 3))
        _fill_in(self.drawn, links, nominal, largest, seed, ("links", "links"))

    def of(self, link: str) -> tuple[float, float, Array]:
        """Returns a link's factors of mass and of inertia, and the shift of its centre (3) [m]."""
        mass, inertia, *shift = self.drawn.get(link, [1.0, 1.0, 0.0, 0.0, 0.0])
        return self.mass * mass, self.inertia * inertia, self.centre + np.array(shift)

    def _spreads(self) -> tuple[float, float, float]:
        return self.mass_spread, self.inertia_spread, self.centre_spread


@dataclass
class JointErrors:
    """Friction of the arms' joints beyond the controller's model of them."""

    coulomb: float = 0.0  # friction as a share of each joint's effort limit
    stribeck: float = 0.0  # further friction of a joint at rest, as a share of the Coulomb friction
    stribeck_velocity: float = 0.05  # where 1/e of that is left [rad/s, m/s]
    viscous: float = 1.0  # factor of the joint's damping

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        for field_name in ("coulomb", "stribeck", "viscous"):
            non_negative(getattr(self, field_name), key(name, field_name))
        positive(self.stribeck_velocity, key(name, "stribeck_velocity"))
        if self.stribeck and not self.coulomb:
            raise ConfigurationError(
                f"{key(name, 'stribeck')} is {self.stribeck:g}, a share of a Coulomb friction that "
                f"is zero; give {key(name, 'coulomb')}."
            )


@dataclass
class KinematicErrors:
    """Displacements of the arms' joints from the controller's model of them.

    Each joint's own shift along the axes of its frame, and its rotation about them in turn, are
    drawn uniformly. The draws are in `drawn`, where they can also be given.
    """

    position_spread: float = 0.0  # along each axis [m]
    rotation_spread_deg: float = 0.0  # about each axis
    # By joint: the shift [m] and the angles x, y, z [°] (6).
    drawn: dict[str, list[float]] = field(default_factory=dict)

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        non_negative(self.position_spread, key(name, "position_spread"), "m")
        non_negative(self.rotation_spread_deg, key(name, "rotation_spread_deg"), "°")
        for joint, drawn in self.drawn.items():
            finite_vector(np.array(drawn), f"{key(name, 'drawn')}.{joint}", 6)

    def is_none(self) -> bool:
        """Returns whether the joints are where the controller believes them."""
        return not (self.position_spread or self.rotation_spread_deg or self.drawn)

    def draw(self, joints: list[str], seed: int) -> None:
        """Fills in `drawn` for these joints, unless it is given or nothing is to be drawn.

        Raises:
            ConfigurationError: `drawn` is given for other joints.
        """
        largest = np.repeat([self.position_spread, self.rotation_spread_deg], 3)
        # Other random numbers than those of the links.
        _fill_in(self.drawn, joints, np.zeros(6), largest, [seed, 1], ("kinematics", "joints"))


@dataclass
class PayloadError:
    """A mass on an arm of which its controller does not know."""

    mass: float = 0.0  # [kg]
    centre: Array = field(default_factory=lambda: np.zeros(3))  # in the sensor's frame S [m]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        non_negative(self.mass, key(name, "mass"), "kg")
        finite_vector(self.centre, key(name, "centre"), 3)


@dataclass
class WorldConfig:
    """The true plant, where it differs from what the controller knows.

    The errors of the wrist sensor (bias, noise, resolution, filter, delay) are in `sensor`.
    """

    seed: int = 0  # of the draws; the run's is added
    links: LinkErrors = field(default_factory=LinkErrors)
    joints: JointErrors = field(default_factory=JointErrors)
    kinematics: KinematicErrors = field(default_factory=KinematicErrors)
    payload_before: PayloadError = field(default_factory=PayloadError)  # before the wrist sensor
    payload_beyond: PayloadError = field(default_factory=PayloadError)  # on the tool
    torque_delay: float = 0.0  # whole steps of the plant [s]
    encoder_resolution: float = 0.0  # of each joint's reading, zero for none [rad, m]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        whole_number(self.seed, key(name, "seed"), 0, LARGEST_SEED)
        delay = key(name, "torque_delay")
        non_negative(self.torque_delay, delay, "s")
        non_negative(_LONGEST_DELAY - self.torque_delay, f"{_LONGEST_DELAY:g} s less {delay}", "s")
        non_negative(self.encoder_resolution, key(name, "encoder_resolution"))

    def check_step(self, name: str, time_step: float) -> None:
        """Raises ConfigurationError if a plant's time step does not allow something [s]."""
        if self.joints.coulomb and time_step == 0.0:
            raise ConfigurationError(
                f"{key(name, 'joints.coulomb')} is {self.joints.coulomb:g}, but the plant is "
                f"continuous; Coulomb friction needs a plant.time_step."
            )
        if self.torque_delay and self.delay_steps(time_step) == 0:
            raise ConfigurationError(
                f"{key(name, 'torque_delay')} is {self.torque_delay:g} s, which is not a whole "
                f"number of the plant's steps of {time_step:g} s. Give a multiple of "
                "plant.time_step."
            )

    def delay_steps(self, time_step: float) -> int:
        """Returns the torque's delay in steps; zero if that is not a whole number [s]."""
        steps = round(self.torque_delay / time_step) if time_step else 0
        return steps if abs(steps * time_step - self.torque_delay) < 1e-9 else 0

    def is_none(self) -> bool:
        """Returns whether the plant is as the controller knows it."""
        others = (
            self.joints.coulomb,
            self.joints.viscous - 1.0,
            self.payload_before.mass,
            self.payload_beyond.mass,
            self.torque_delay,
            self.encoder_resolution,
        )
        return self.links.is_none() and self.kinematics.is_none() and not any(others)
