"""The scenario of a tight cooperation, see `tight`."""

import dataclasses
from dataclasses import dataclass, field

import numpy as np

from geoimp_drake.controllers.config import SamplingConfig
from geoimp_drake.controllers.cooperative_config import CooperativeControllerConfig
from geoimp_drake.diagrams.scene.bar import BarConfig, GraspConfig
from geoimp_drake.diagrams.scene.cell import SEVEN, SIX
from geoimp_drake.diagrams.scene.surface_config import disk_sides
from geoimp_drake.diagrams.scene.surface_placement import SurfacePlacement
from geoimp_drake.diagrams.setups.run_settings import RunSettings, differenced
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.models.robot_data import TOOL
from geoimp_drake.parts.grasp import MutualPose
from geoimp_drake.parts.object_load import ObjectLoad
from geoimp_drake.rotations import euler, quaternion
from geoimp_drake.systems.sources.desired_motion import MotionSegment
from geoimp_drake.typing import Array
from geoimp_drake.validation import choice, finite_vector, key, positive

__all__ = ["ARMS", "OBJECT", "AssumedGeometry", "TightScenario"]

ARMS = (SEVEN, SIX)  # first and second hand
OBJECT = "object"  # in the log


@dataclass
class AssumedGeometry:
    """The controller's assumptions about the cell, where they differ from it."""

    # Whether the mutual pose is the assumed one, not the one measured at the start.
    prescribed: bool = False
    # Error of the assumed grasp: of the second hand's pose on the bar, in the axes of O.
    grasp_offset: Array = field(default_factory=lambda: np.zeros(3))  # [m]
    grasp_rotation_deg: Array = field(default_factory=lambda: np.zeros(3))  # about x, y, z of O
    # Error of the assumed base of the second arm, in W.
    base_offset: Array = field(default_factory=lambda: np.zeros(3))  # [m]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        for error in ("grasp_offset", "grasp_rotation_deg", "base_offset"):
            finite_vector(getattr(self, error), key(name, error), 3)


@dataclass
class TightScenario(CooperativeControllerConfig, RunSettings):
    """All settings of a run with a bar in two hands; SI units, degrees where the name says so."""

    sampling: SamplingConfig = field(default_factory=differenced)
    load: ObjectLoad | None = None  # the one that the controller removes; by default the bar's own
    segments: list[MotionSegment] = field(default_factory=list)  # of the object's desired motion
    centre: Array = field(default_factory=lambda: np.array([0.0, 1.7, 0.95]))  # of the bar, in W
    guesses: dict[str, list[float]] = field(default_factory=dict)  # start of the search, by arm
    rod: float = 0.1  # between wrist sensor and grasp [m]
    bar: BarConfig = field(default_factory=BarConfig)
    grasp: GraspConfig = field(default_factory=GraspConfig)
    carrier: str = SEVEN  # the hand that the bar is welded to; the other one has the grasp
    assumed: AssumedGeometry = field(default_factory=AssumedGeometry)
    release: float | None = None  # when the grasp opens [s]
    surface: SurfacePlacement | None = None
    disk_resolution_hint: float = 0.05  # edge length of the disk's contact mesh [m]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        CooperativeControllerConfig.validate(self, name)
        RunSettings.validate(self, name)
        self.check_moves(self.segments)
        finite_vector(self.centre, key(name, "centre"), 3)
        for arm in self.guesses:
            choice(arm, f"arm in {key(name, 'guesses')}", ARMS)
        plate = TOOL.plate_thickness
        positive(self.rod - plate, f"{key(name, 'rod')} less its mounting plate", "m")
        choice(self.carrier, key(name, "carrier"), ARMS)
        self._check_assumed(name)
        self._check_release(name)
        if self.surface is not None:
            self.surface.check_step(key(name, "surface"), self.plant.time_step)
        disk_sides(self.disk_resolution_hint, key(name, "disk_resolution_hint"))

    def _check_assumed(self, name: str) -> None:
        if self.assumed.prescribed and self.mutual_pose is not None:
            raise ConfigurationError(
                f"{key(name, 'mutual_pose')} and {key(name, 'assumed.prescribed')} both say what "
                f"mutual pose the controller is told; leave one of them out."
            )

    def _check_release(self, name: str) -> None:
        if self.release is None:
            return
        positive(self.release, key(name, "release"), "s")
        if self.grasp.kind != "bushing":
            raise ConfigurationError(
                f"{key(name, 'release')} is {self.release:g} s, but {key(name, 'grasp.kind')} is "
                f"'{self.grasp.kind}'; only a bushing can be opened."
            )

    @property
    def compliant(self) -> str:
        """Name of the compliant object in the log."""
        return OBJECT

    def ends(self) -> dict[str, Array]:
        """Returns where each arm's hand holds the bar at the start, in W (3) [m]."""
        half = np.array([0.0, self.bar.length / 2, 0.0])
        return {SEVEN: self.centre - half, SIX: self.centre + half}

    def told(self, load: ObjectLoad) -> CooperativeControllerConfig:
        """Returns the controller's configuration: with the bar's load unless another is given."""
        assumed = self.assumed
        told = dataclasses.replace(self, load=self.load or load, assumed=AssumedGeometry())
        if assumed.prescribed:
            R = euler.to_rotation(np.deg2rad(assumed.grasp_rotation_deg))
            grasp = np.array([0.0, self.bar.length, 0.0]) + assumed.grasp_offset
            told.mutual_pose = MutualPose(quaternion.from_rotation(R), grasp)
        return told
