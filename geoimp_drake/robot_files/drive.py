"""The drive of a robot's joint: a motor's limit and inertia, and properties that Drake lacks."""

import math
from dataclasses import dataclass, replace

__all__ = ["Drive", "number"]


@dataclass(frozen=True)
class Drive:
    """The drive of a joint, as a robot's description states it.

    Attributes:
        actuator: its name in the description, None if the joint has none.
        is_servo: whether the actuator there follows something other than a torque.
        effort_limit: at the joint [Nm or N]; infinite if the description states none.
        rotor_inertia: before the gear [kg m² or kg].
        gear_ratio: of the rotor's speed to the joint's.
        friction: dry, which is lost since Drake has none [Nm or N].
        stiffness: of a spring at the joint, which is lost [Nm/rad or N/m].
        has_several: whether it was made of more than one actuator.
    """

    actuator: str | None = None
    is_servo: bool = False
    effort_limit: float = math.inf
    rotor_inertia: float = 0.0
    gear_ratio: float = 1.0
    friction: float = 0.0
    stiffness: float = 0.0
    has_several: bool = False

    def with_actuator(
        self,
        name: str,
        *,
        rotor: float,
        gear: float,
        limit: float = math.inf,
        is_servo: bool = False,
    ) -> "Drive":
        """Returns this drive with one more actuator; an actuator with a gear of zero does nothing.

        Reflected inertias at the joint add up. Of several limits the smallest holds: nothing says
        that actuators of one joint work at the same time.

        Args:
            name: the actuator's.
            rotor: its inertia before the gear [kg m² or kg].
            gear: its ratio.
            limit: of the effort at the joint [Nm or N].
            is_servo: whether it takes something other than a torque.
        """
        if gear**2 == 0:
            return self
        felt = self.rotor_inertia * self.gear_ratio**2 + rotor * gear**2
        ratio = gear if self.actuator is None else self.gear_ratio
        return replace(
            self,
            actuator=self.actuator or name,
            is_servo=self.is_servo or is_servo,
            effort_limit=min(self.effort_limit, limit),
            rotor_inertia=felt / ratio**2 if ratio else rotor,
            gear_ratio=ratio,
            has_several=self.actuator is not None,
        )


def number(text: str | None, default: float = 0.0) -> float:
    """Returns a text as a number, the default if there is none; `check_numbers` has checked it."""
    return default if text is None else float(text)
