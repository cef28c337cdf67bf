"""One arm, its wrist sensor and a surface under six-DOF impedance control.

```
 desired_motion ──▶ controller ──actuation──▶ plant: arm ═ sensor ═ tool: disk ▷ surface
                     ▲      ▲                  │ │
                     │      └── state ─────────┘ │
                     └── wrench ── wrist sensor ◀┘ reaction forces
```
"""

from dataclasses import dataclass, field

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import (
    AddMultibodyPlant,
    MultibodyPlant,
    MultibodyPlantConfig,
)
from pydrake.multibody.tree import Frame
from pydrake.systems.analysis import SimulatorConfig
from pydrake.systems.framework import Diagram, DiagramBuilder

from geoimp_drake.config import (
    ImpedanceConfig,
    ImpedanceControllerConfig,
    MotionConfig,
    RedundancyConfig,
    SamplingConfig,
)
from geoimp_drake.control_model import ControlModel
from geoimp_drake.controllers import make_impedance_controller
from geoimp_drake.diagrams.cell import END_EFFECTOR, SEVEN, SIX, WRIST_SENSOR, add_cell
from geoimp_drake.diagrams.drake_settings import check_plant_config, check_simulator_config
from geoimp_drake.diagrams.posture import StartConfig, start_posture
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
from geoimp_drake.systems.force_torque_sensor import ForceTorqueSensor, WristSensorConfig
from geoimp_drake.systems.frame_motion_sensor import FrameMotionSensor
from geoimp_drake.typing import Array
from geoimp_drake.validation import choice, finite_vector, positive
from geoimp_drake.wrist_sensor import add_wrist_sensor

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
class SingleArmScenario:
    """Everything of a run with one arm; SI units, angles in degrees where the name says so."""

    experiment: str = "plexiglas"  # names the claims and figures
    seed: int = 0  # of the sensor's noise
    duration: float | None = None  # [s]; all of the motion if not given
    log_period: float = 0.01  # [s]
    arm: str = SIX
    start: StartConfig = field(default_factory=StartConfig)
    segments: list[MotionSegment] = field(default_factory=list)  # of the desired motion
    impedance: ImpedanceConfig = field(default_factory=ImpedanceConfig)
    motion: MotionConfig = field(default_factory=MotionConfig)
    sampling: SamplingConfig = field(default_factory=lambda: SamplingConfig(velocity="differenced"))
    redundancy: RedundancyConfig = field(default_factory=RedundancyConfig)
    sensor: WristSensorConfig = field(default_factory=WristSensorConfig)
    surface: SurfacePlacement | None = None
    external: WrenchRamp | None = None  # on the hand at E, in the axes of D at the start
    disk_resolution_hint: float = 0.05  # edge length of the disk's contact mesh [m]
    plant: MultibodyPlantConfig = field(
        default_factory=lambda: MultibodyPlantConfig(
            time_step=1e-3,
            contact_model="hydroelastic",
            discrete_contact_approximation="sap",
        )
    )
    simulator: SimulatorConfig = field(
        default_factory=lambda: SimulatorConfig(
            integration_scheme="runge_kutta2", max_step_size=1e-3, use_error_control=False
        )
    )

    def controller(self) -> ImpedanceControllerConfig:
        """Returns the controller's part."""
        return ImpedanceControllerConfig(
            self.impedance, self.motion, self.sampling, self.redundancy
        )

    def validate(self) -> None:
        """Raises ConfigurationError if a field cannot be used."""
        choice(self.arm, "arm", CELL_OF_ARM)
        positive(self.log_period, "log_period", "s")
        if self.duration is not None:
            positive(self.duration, "duration", "s")
        if self.seed < 0:
            raise ConfigurationError(f"seed is {self.seed}; it must not be negative.")
        for index, segment in enumerate(self.segments):
            segment.validate(f"segments.{index}")
        if not self.segments and self.duration is None:
            raise ConfigurationError("There is no motion; give a duration.")
        self.start.validate()
        self.controller().validate()
        self.sensor.validate()
        for part in (self.surface, self.external):
            if part is not None:
                part.validate()
        positive(self.disk_resolution_hint, "disk_resolution_hint", "m")
        check_plant_config(self.plant)
        check_simulator_config(self.simulator)
        if self.log_period < self.plant.time_step:
            raise ConfigurationError(
                f"log_period is {self.log_period:g} s; it must not be shorter than "
                f"plant.time_step, {self.plant.time_step:g} s."
            )


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
    controller = builder.AddSystem(make_impedance_controller(plant, arm, E, scenario.controller()))
    scenario.sensor.seed = scenario.seed
    joint = plant.GetJointByName(
        WRIST_SENSOR, plant.GetModelInstanceByName(f"{scenario.arm}_sensor")
    )
    sensor = add_wrist_sensor(builder, plant, joint, E, scenario.sensor)

    # Desired motion, joint state and wrench go in, torques come out.
    builder.Connect(desired.GetOutputPort("motion"), controller.GetInputPort("desired_motion"))
    builder.Connect(plant.get_state_output_port(arm), controller.GetInputPort("estimated_state"))
    builder.Connect(sensor.GetOutputPort("wrench"), controller.GetInputPort("wrench"))
    builder.Connect(controller.GetOutputPort("actuation"), plant.get_actuation_input_port(arm))
    # The tool's inertial load, if it is to be removed by reference, is that of C's motion: D's
    # would leave 1e-3 of misalignment in the experiments whose hand is turned by a torque.
    builder.Connect(
        controller.GetOutputPort("compliant_motion"), sensor.GetInputPort("reference_motion")
    )
    if scenario.external is not None:
        external = builder.AddNamedSystem(
            "external_wrench", ExternalWrench(E, X_WE.rotation().matrix(), scenario.external)
        )
        builder.Connect(external.get_output_port(), plant.get_applied_spatial_force_input_port())
    recorder = _record(builder, scenario, plant, E, desired, controller, sensor)
    if meshcat is not None:
        add_visualization(
            builder,
            scene_graph,
            meshcat,
            frames={
                name: recorder.port(f"{scenario.arm}/motion_{name}") for name in ("D", "C", "E")
            },
            wrench=sensor.GetOutputPort("wrench"),
        )
    return SingleArmSetup(scenario, builder.Build(), plant, controller, sensor, recorder)


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


def _record(
    builder: DiagramBuilder,
    scenario: SingleArmScenario,
    plant: MultibodyPlant,
    E: Frame,
    desired: DesiredMotion,
    controller: Diagram,
    sensor: ForceTorqueSensor,
) -> Recorder:
    """Logs what architecture and log contract name, under the arm's name."""
    arm = plant.GetModelInstanceByName(scenario.arm)
    measured = builder.AddNamedSystem("motion_of_E", FrameMotionSensor(E))
    for port in FrameMotionSensor.PLANT_PORTS:
        builder.Connect(plant.GetOutputPort(port), measured.GetInputPort(port))
    recorder = Recorder(builder, scenario.log_period)
    n = plant.num_positions(arm)
    state = plant.get_state_output_port(arm)
    recorder.record(f"{scenario.arm}/q", state, slice(0, n))
    recorder.record(f"{scenario.arm}/v", state, slice(n, None))
    for key, port in {
        "u": controller.GetOutputPort("actuation"),
        "motion_E": measured.GetOutputPort("motion"),
        "motion_D": desired.GetOutputPort("motion"),
        "motion_C": controller.GetOutputPort("compliant_motion"),
        "wrench": sensor.GetOutputPort("wrench"),
        "wrench_true": sensor.GetOutputPort("wrench_true"),
    }.items():
        recorder.record(f"{scenario.arm}/{key}", port)
    if scenario.surface is not None:
        recorder.constant("surface/plane", surface_plane(scenario.surface.pose()))
        recorder.constant("surface/disk", np.zeros(3))
    return recorder


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
