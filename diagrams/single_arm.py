"""One arm, its wrist sensor and a surface under six-DOF impedance control.

```
 desired_motion ──▶ compliant arm ◀──▶ plant: arm ═ sensor ═ tool: disk ▷ surface
```
"""

from dataclasses import dataclass, field

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant
from pydrake.multibody.tree import Frame
from pydrake.systems.framework import Diagram, DiagramBuilder

from geoimp_drake.control_model import ControlModel
from geoimp_drake.diagrams.cell import END_EFFECTOR, SEVEN, SIX, add_cell
from geoimp_drake.diagrams.compliant_arm import add_compliant_arm
from geoimp_drake.diagrams.posture import StartConfig, start_posture
from geoimp_drake.diagrams.run_settings import RunSettings
from geoimp_drake.diagrams.surface import (
    DISK_RADIUS,
    SurfaceConfig,
    add_disk_contact,
    add_surface,
    surface_plane,
)
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.simulation.recorder import Recorder
from geoimp_drake.simulation.visualization import add_visualization
from geoimp_drake.systems.desired_motion import DesiredMotion, MotionSegment
from geoimp_drake.systems.external_wrench import ExternalWrench, WrenchRamp
from geoimp_drake.systems.force_torque_sensor import ForceTorqueSensor
from geoimp_drake.typing import Array
from geoimp_drake.validation import choice, finite_vector, positive

__all__ = [
    "SingleArmScenario",
    "SingleArmSetup",
    "SurfacePlacement",
    "build_single_arm",
    "phases_of",
]


@dataclass
class SurfacePlacement:
    """A surface and where it stands."""

    point: Array = field(default_factory=lambda: np.array([0.9, 0.0, 0.52]))  # in W [m]
    normal: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  # outward, in W
    properties: SurfaceConfig = field(default_factory=SurfaceConfig)

    def validate(self) -> None:
        """Raises ConfigurationError if a field cannot be used."""
        finite_vector(self.point, "surface.point", 3)
        normal = finite_vector(self.normal, "surface.normal", 3)
        if np.linalg.norm(normal) < 1e-6:
            raise ConfigurationError(
                "surface.normal is zero; give the direction out of the surface."
            )
        self.properties.validate()

    def pose(self) -> RigidTransform:
        """Returns X_WS: z along the normal, origin at the point."""
        z = np.asarray(self.normal, dtype=float)
        return RigidTransform(RotationMatrix.MakeFromOneVector(z, 2), self.point)


@dataclass
class SingleArmScenario(RunSettings):
    """Everything of a run with one arm; SI units, angles in degrees where the name says so."""

    arm: str = SIX
    start: StartConfig = field(default_factory=StartConfig)
    segments: list[MotionSegment] = field(default_factory=list)  # of the desired motion
    surface: SurfacePlacement | None = None
    external: WrenchRamp | None = None  # on the hand at E, in the axes of D at the start
    disk_resolution_hint: float = 0.05  # edge length of the disk's contact mesh [m]

    def validate(self) -> None:
        """Raises ConfigurationError if a field cannot be used."""
        choice(self.arm, "arm", CELL_OF_ARM)
        self.validate_run()
        for index, segment in enumerate(self.segments):
            segment.validate(f"segments.{index}")
        if not self.segments and self.duration is None:
            raise ConfigurationError("There is no motion; give a duration.")
        self.start.validate()
        for part in (self.surface, self.external):
            if part is not None:
                part.validate()
        positive(self.disk_resolution_hint, "disk_resolution_hint", "m")


CELL_OF_ARM = {SIX: "single_arm", SEVEN: "track_arm"}


@dataclass
class SingleArmSetup:
    """A scenario as Drake objects, ready to be simulated."""

    scenario: SingleArmScenario  # with the start posture and the duration filled in
    diagram: Diagram
    plant: MultibodyPlant
    controller: Diagram
    sensor: ForceTorqueSensor
    recorder: Recorder

    def add_plant(self, builder: DiagramBuilder) -> MultibodyPlant:
        """Adds the plant of this set-up alone to another builder, and returns it."""
        plant, _ = AddMultibodyPlant(self.scenario.plant, builder)
        _add_models(plant, self.scenario)
        return plant


def build_single_arm(scenario: SingleArmScenario, meshcat: Meshcat | None = None) -> SingleArmSetup:
    """Builds the diagram of a scenario.

    Raises:
        ConfigurationError: the scenario cannot be used; the message says why.
    """
    scenario.validate()
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(scenario.plant, builder)
    E = _add_models(plant, scenario)
    arm = plant.GetModelInstanceByName(scenario.arm)
    posture, X_WE = start_posture(ControlModel.of_arm(plant, arm, E), scenario.start)
    plant.SetDefaultPositions(arm, posture)
    scenario.start.posture = posture.tolist()
    if scenario.surface is not None:
        _check_clear(X_WE, surface_plane(scenario.surface.pose()))

    desired = builder.AddNamedSystem("desired_motion", DesiredMotion(X_WE, scenario.segments))
    if scenario.duration is None:
        scenario.duration = desired.duration()
    hand = add_compliant_arm(
        builder, plant, scenario.arm, E, desired.GetOutputPort("motion"), scenario
    )
    if scenario.external is not None:
        external = builder.AddNamedSystem(
            "external_wrench", ExternalWrench(E, X_WE.rotation().matrix(), scenario.external)
        )
        builder.Connect(external.get_output_port(), plant.get_applied_spatial_force_input_port())
    recorder = Recorder(builder, scenario.log_period)
    motion_E = hand.record(builder, recorder, plant)
    if scenario.surface is not None:
        recorder.constant("surface/plane", surface_plane(scenario.surface.pose()))
        recorder.constant("surface/disk", np.zeros(3))
    if meshcat is not None:
        add_visualization(
            builder,
            scene_graph,
            meshcat,
            frames=hand.frames(motion_E),
            wrench=hand.sensor.GetOutputPort("wrench"),
        )
    return SingleArmSetup(scenario, builder.Build(), plant, hand.controller, hand.sensor, recorder)


def _add_models(plant: MultibodyPlant, scenario: SingleArmScenario) -> Frame:
    """Adds arm, sensor, tool and surface; returns E."""
    add_cell(plant, CELL_OF_ARM[scenario.arm])
    tool = plant.GetModelInstanceByName(f"{scenario.arm}_tool")
    E = plant.GetFrameByName(END_EFFECTOR, tool)
    if scenario.surface is not None:
        properties = scenario.surface.properties
        add_surface(plant, properties, scenario.surface.pose())
        add_disk_contact(
            plant,
            E.body(),
            E.GetFixedPoseInBodyFrame(),
            friction=properties.friction,
            resolution_hint=scenario.disk_resolution_hint,
        )
    plant.Finalize()
    return E


def _check_clear(X_WD: RigidTransform, plane: Array, radius: float = DISK_RADIUS) -> None:
    """Raises ConfigurationError if a disk at X_WD reaches into the surface."""
    n, offset = plane[:3], plane[3]
    tilt = n @ X_WD.rotation().matrix()[:, 2]
    lowest = n @ X_WD.translation() - offset - radius * np.sqrt(max(0.0, 1.0 - tilt * tilt))
    if lowest < 0:
        raise ConfigurationError(
            f"The disk starts {-lowest * 1e3:.1f} mm inside the surface; move start.position away "
            f"from it or surface.point back by at least that much."
        )


def phases_of(motion: list[MotionSegment]) -> list[tuple[str, float, float]]:
    """Returns name, begin and end [s] of each named segment."""
    ends = np.cumsum([segment.duration for segment in motion])
    return [
        (segment.name, float(end - segment.duration), float(end))
        for segment, end in zip(motion, ends, strict=True)
        if segment.name
    ]
