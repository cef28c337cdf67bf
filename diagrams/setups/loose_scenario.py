"""The scenario of a loose cooperation, see `loose`."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from geoimp_drake.diagrams.scene.cell import SEVEN, SIX
from geoimp_drake.diagrams.scene.peg_hole_config import PegHoleConfig
from geoimp_drake.diagrams.setups.insertion_end import InsertionEnd
from geoimp_drake.diagrams.setups.posture import StartConfig
from geoimp_drake.diagrams.setups.run_settings import CompliantArmSettings
from geoimp_drake.models.robot_data import TOOL
from geoimp_drake.motion_program.plan import PlanConfig
from geoimp_drake.motion_program.taught import TaughtVariable, taught_values
from geoimp_drake.rotations import euler
from geoimp_drake.systems.arm.industrial_controller import IndustrialControllerConfig
from geoimp_drake.systems.sources.external_wrench import WrenchRamp
from geoimp_drake.typing import Array
from geoimp_drake.validation import PATH, choice, finite_vector, key, non_negative, positive

__all__ = [
    "PLANS",
    "ArmRoles",
    "LooseScenario",
    "PegGrasp",
    "PlannedInsertion",
    "ProgramSettings",
    "TaughtPose",
]

PLANS = ("nominal", "misplanned")


@dataclass
class PlannedInsertion:
    """How far the program pushes, and its error of the hole's pose."""

    path: float = 0.05  # along the tool's approach axis [m]
    rotation_deg: Array = field(default_factory=lambda: np.zeros(3))  # of the tool about W's axes
    offset: Array = field(default_factory=lambda: np.zeros(3))  # of the tip, in W [m]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        positive(self.path, key(name, "path"), "m")
        finite_vector(self.rotation_deg, key(name, "rotation_deg"), 3)
        finite_vector(self.offset, key(name, "offset"), 3)


@dataclass
class PegGrasp:
    """The pose of the peg in its hand, which its program and its arm's control unit do not know."""

    rotation_deg: Array = field(default_factory=lambda: np.zeros(3))  # about the tip's own axes
    offset: Array = field(default_factory=lambda: np.zeros(3))  # of the tip, in the hand [m]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        finite_vector(self.rotation_deg, key(name, "rotation_deg"), 3)
        finite_vector(self.offset, key(name, "offset"), 3)

    def is_none(self) -> bool:
        """Returns whether the peg sits as it is believed to."""
        return not (np.any(self.rotation_deg) or np.any(self.offset))

    def pose(self) -> RigidTransform:
        """Returns X_TP, the pose of the peg in the frame where it is believed to be."""
        return RigidTransform(
            RotationMatrix(euler.to_rotation(np.deg2rad(self.rotation_deg))), self.offset
        )


@dataclass
class TaughtPose:
    """A pose of the peg's tip, taught with respect to the hole: aligned with it, `offset` away."""

    offset: Array = field(default_factory=lambda: np.zeros(3))  # from H to P, in W [m]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        finite_vector(self.offset, key(name, "offset"), 3)


@dataclass
class ProgramSettings:
    """The motion program, and the taught values."""

    file: str = field(
        default="insertion.pdl", metadata=PATH
    )  # a path, or a file beside the experiments
    constants: dict[str, float] = field(default_factory=dict)  # replace the program's own
    path_constant: str = "dpt"  # gets the plan's path [mm]
    poses: dict[str, TaughtPose] = field(default_factory=dict)

    def path(self) -> Path:
        """Returns the path of the program."""
        beside = Path(__file__).resolve().parents[1] / "experiments" / self.file
        return beside if beside.exists() else Path(self.file)


@dataclass
class ArmRoles:
    """The data that an arm needs for either role."""

    hold: StartConfig = field(default_factory=StartConfig)  # of H, if this arm holds the hole
    start: list[float] = field(default_factory=list)  # posture, if it brings the peg [rad, m]
    taught: list[TaughtVariable] = field(default_factory=list)  # for the program, if it does

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        taught_values(self.taught, key(name, "taught"))


@dataclass
class LooseScenario(CompliantArmSettings):
    """All settings of a run of peg in hole; SI units, degrees and millimetres where named."""

    peg_arm: str = SEVEN
    plan: str = "misplanned"  # or nominal
    nominal: PlannedInsertion = field(default_factory=PlannedInsertion)
    misplanned: PlannedInsertion = field(
        default_factory=lambda: PlannedInsertion(0.09, np.array([2.0, 0.0, 2.0]))
    )
    hold: float = 5.0  # after the end of the program [s]
    until: InsertionEnd | None = None  # ends the run before that
    program: ProgramSettings = field(default_factory=ProgramSettings)
    speeds: PlanConfig = field(default_factory=PlanConfig)  # of the program at 100 per cent
    servo: IndustrialControllerConfig = field(default_factory=IndustrialControllerConfig)
    peg_hole: PegHoleConfig = field(default_factory=PegHoleConfig)
    grasp: PegGrasp = field(default_factory=PegGrasp)
    tip: float = 0.155  # of the peg, from S along its z axis [m]
    mouth: float = 0.165  # of the hole, from S along its z axis [m]
    # E in S [m]: the point about which the compliant hand turns.
    remote_centre: Array = field(default_factory=lambda: np.array([0.0, 0.0, 0.165]))
    six: ArmRoles = field(default_factory=ArmRoles)
    seven: ArmRoles = field(default_factory=ArmRoles)
    external: WrenchRamp | None = None  # on the block, at the hole's mouth H

    @property
    def compliant(self) -> str:
        """Name of the arm that holds the hole, in plant and log."""
        return SIX if self.peg_arm == SEVEN else SEVEN

    def pose_of_mouth(self) -> RigidTransform:
        """Returns X_SH."""
        return RigidTransform([0.0, 0.0, self.mouth])

    def planned(self) -> PlannedInsertion:
        """Returns the chosen plan."""
        plan: PlannedInsertion = getattr(self, self.plan)
        return plan

    def roles(self, arm: str) -> ArmRoles:
        """Returns the data for an arm of the cell."""
        return self.six if arm == SIX else self.seven

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        super().validate(name)
        choice(self.peg_arm, key(name, "peg_arm"), (SIX, SEVEN))
        choice(self.plan, key(name, "plan"), PLANS)
        non_negative(self.hold, key(name, "hold"), "s")
        # Between a hand and the part that it holds there is a rod on a mounting plate.
        plate, tip, mouth = TOOL.plate_thickness, key(name, "tip"), key(name, "mouth")
        positive(
            self.tip - self.peg_hole.peg_length - plate, f"{tip} less the peg and a plate", "m"
        )
        block = self.peg_hole.block_length
        positive(self.mouth - block - plate, f"{mouth} less the block and a plate", "m")
        finite_vector(self.remote_centre, key(name, "remote_centre"), 3)
