"""The driver of an arm in a scenario's YAML."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.robots.drive import DriveConfig
from geoimp_drake.robots.lcm_messages import LCM_MESSAGES
from geoimp_drake.robots.robot_arm import RobotArm
from geoimp_drake.validation import choice, key, positive

__all__ = ["DRIVERS", "DriverConfig"]

DRIVERS = ("plant", "franka", "lcm")


@dataclass
class DriverConfig(DriveConfig):
    """How an arm is reached, and how it is driven."""

    kind: str = "plant"  # the scenario's own plant, simulated; or franka, lcm
    address: str = ""  # of a Franka arm
    messages: str = "iiwa"  # on LCM; or panda
    url: str = ""  # of LCM; its own default if empty
    channel: str | None = None  # prefix of the LCM channels' names, by default IIWA or PANDA
    period: float = 5e-3  # of the statuses on LCM [s]
    patience: float | None = None  # of each status on LCM; null for one and a half periods [s]
    joints: list[str] = field(default_factory=list)  # in the robot's order; from base to hand

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        super().validate(name)
        choice(self.kind, key(name, "kind"), DRIVERS)
        choice(self.messages, key(name, "messages"), LCM_MESSAGES)
        positive(self.period, key(name, "period"), "s")
        if self.patience is not None:
            positive(self.patience, key(name, "patience"), "s")
        if (self.kind == "franka") != bool(self.address):
            raise ConfigurationError(
                f"{key(name, 'address')} is '{self.address}' and {key(name, 'kind')} is "
                f"'{self.kind}': the address of a Franka arm goes with 'franka', and with no other."
            )

    def drive_config(self, takes: str) -> DriveConfig:
        """Returns how it is driven: a simulated arm has a wrist sensor, others an observer.

        Args:
            takes: see `RobotArm`; a robot that takes positions must report the wrench.
        """
        own = "robot" if self.kind == "plant" or takes == "position" else "observer"
        return replace(self, wrench=own if self.wrench is None else self.wrench)

    def make(
        self, joints: tuple[str, ...], simulated: Callable[[], RobotArm], takes: str = "torque"
    ) -> RobotArm:
        """Returns the driver.

        Args:
            joints: the arm's, from base to hand.
            simulated: makes the driver of the scenario's own plant.
            takes: kind of the commands, see `RobotArm`.

        Raises:
            ConfigurationError: a package that the driver needs is not installed, or the robot does
                not take such commands.
        """
        if self.kind == "plant":
            return simulated()
        names = tuple(self.joints) or joints
        if self.kind == "franka":
            from geoimp_drake.robots.franka_arm import FrankaArm

            if takes != "torque":
                raise ConfigurationError(
                    "scheme is 'admittance', which gives positions, and this driver of a Franka "
                    "arm sends torques. Give scheme: inner-loop or direct."
                )
            return FrankaArm(self.address, names)
        from geoimp_drake.robots.lcm_arm import LcmArm

        kept = self.period, self.channel, self.patience
        return LcmArm(self.messages, self.url, names, *kept, takes)
