"""The scenario of a run with one arm, see `single_arm`."""

from dataclasses import dataclass, field
from typing import Any

from geoimp_drake.diagrams.scene.cell import SEVEN, SIX
from geoimp_drake.diagrams.scene.colliding_body import CollidingBody
from geoimp_drake.diagrams.scene.surface_config import disk_sides
from geoimp_drake.diagrams.scene.surface_placement import SurfacePlacement
from geoimp_drake.diagrams.setups.posture import StartConfig
from geoimp_drake.diagrams.setups.run_settings import CompliantArmSettings
from geoimp_drake.robot_files.config import RobotConfig
from geoimp_drake.systems.sources.desired_motion import MotionSegment, length_of
from geoimp_drake.systems.sources.external_wrench import WrenchRamp
from geoimp_drake.validation import choice, key, positive

__all__ = ["CELL_OF_ARM", "OWN_ARM", "SingleArmScenario"]

CELL_OF_ARM = {SIX: "single_arm", SEVEN: "track_arm"}
# The name of an arm from a file, unless it is given: its log has the same keys for any robot.
OWN_ARM = "arm"


@dataclass
class SingleArmScenario(CompliantArmSettings):
    """All settings of a run with one arm; SI units, angles in degrees where the name says so."""

    arm: str = SIX  # or seven; of a robot of your own its name in the log, by default `arm`
    robot: RobotConfig | None = None  # of your own, instead of the cell's arm
    start: StartConfig = field(default_factory=StartConfig)
    segments: list[MotionSegment] = field(default_factory=list)  # of the desired motion
    surface: SurfacePlacement | None = None
    body: CollidingBody | None = None  # one that the hand may run into
    external: WrenchRamp | None = None  # on the hand at E; its frame's axes are those of D
    disk_resolution_hint: float = 0.05  # edge length of the disk's contact mesh [m]
    effort_scale: float = 1.0  # factor of all effort limits, which the controller knows

    @staticmethod
    def complete_data(data: dict[str, Any], given: dict[str, Any]) -> None:
        """Gives YAML's data the name of an arm where a robot's file is `given`, and no name."""
        robot = given.get("robot")
        names_file = isinstance(robot, dict) and "file" in robot
        if names_file and "arm" not in given and data["arm"] in CELL_OF_ARM:
            data["arm"] = OWN_ARM

    @property
    def compliant(self) -> str:
        """Name of the compliant arm in the log."""
        return self.arm

    @property
    def length(self) -> float:
        """Length of the run [s]: its duration, or all of the motion."""
        if self.duration is not None:
            return self.duration
        return length_of(self.segments)

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        super().validate(name)
        if self.robot is None:
            choice(self.arm, key(name, "arm"), CELL_OF_ARM)
        self.check_moves(self.segments)
        positive(self.effort_scale, key(name, "effort_scale"))
        if self.surface is not None:
            self.surface.check_step(key(name, "surface"), self.plant.time_step)
        disk_sides(self.disk_resolution_hint, key(name, "disk_resolution_hint"))
