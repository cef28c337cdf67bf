"""One arm, its wrist sensor and a surface under six-DOF impedance control.

```
 desired_motion ──▶ compliant arm ◀──▶ plant: arm ═ sensor ═ tool: disk ▷ surface
```
"""

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant
from pydrake.multibody.tree import Frame, Joint
from pydrake.systems.framework import DiagramBuilder

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.diagrams.scene.cell import END_EFFECTOR, add_cell
from geoimp_drake.diagrams.scene.surface import add_disk_contact, add_surface, surface_plane
from geoimp_drake.diagrams.scene.surface_placement import check_clear
from geoimp_drake.diagrams.setups.compliant_arm import add_compliant_arm, sensor_joint_of
from geoimp_drake.diagrams.setups.posture import start_posture
from geoimp_drake.diagrams.setups.setup import Setup
from geoimp_drake.diagrams.setups.single_arm_scenario import CELL_OF_ARM, SingleArmScenario
from geoimp_drake.simulation.live import add_live_controls
from geoimp_drake.simulation.recorder import Recorder
from geoimp_drake.simulation.visualization import add_visualization
from geoimp_drake.systems.sources.desired_motion import DesiredMotion
from geoimp_drake.systems.sources.external_wrench import ExternalWrench
from geoimp_drake.validation import check

__all__ = ["build_single_arm"]


def build_single_arm(
    scenario: SingleArmScenario,
    meshcat: Meshcat | None = None,
    *,
    live: bool = False,
    logged: bool = True,
) -> Setup:
    """Builds the diagram of a scenario.

    Args:
        scenario: its open fields are filled in.
        meshcat: where it is drawn, None for nowhere.
        live: add sliders there.
        logged: with its log. Off, for a loop that is timed, neither that nor what only it and
            Meshcat need is there; with Meshcat there is a log all the same.

    Raises:
        ConfigurationError: the scenario cannot be used; the message says why.
    """
    check(scenario)
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(scenario.plant, builder)
    E, sensor_joint = _add_models(plant, scenario)
    arm = plant.GetModelInstanceByName(scenario.arm)
    model = ControlModel.of_arm(plant, arm, E)
    posture, X_WE = start_posture(model, scenario.start)
    plant.SetDefaultPositions(arm, model.in_plant_order(posture))
    scenario.start.posture = posture.tolist()
    if scenario.surface is not None:
        check_clear(X_WE, surface_plane(scenario.surface.pose()), "start.position")

    desired = builder.AddNamedSystem("desired_motion", DesiredMotion(X_WE, scenario.segments))
    if scenario.duration is None:
        scenario.duration = desired.duration()
    hand = add_compliant_arm(
        builder, plant, scenario.arm, E, sensor_joint, desired.GetOutputPort("motion"), scenario
    )
    if scenario.external is not None:
        external = builder.AddNamedSystem(
            "external_wrench", ExternalWrench(E, X_WE.rotation().matrix(), scenario.external)
        )
        builder.Connect(external.get_output_port(), plant.get_applied_spatial_force_input_port())
    recorder = Recorder(builder, scenario.log_period)
    if logged or meshcat is not None:
        hand.record(builder, recorder, plant)
    if scenario.surface is not None:
        recorder.constant("surface/plane", surface_plane(scenario.surface.pose()))
        recorder.constant("surface/disk", np.zeros(3))
    if meshcat is not None:
        add_visualization(
            builder,
            scene_graph,
            meshcat,
            plant,
            frames=hand.frames(recorder),
            wrench=hand.controller.GetOutputPort("wrench"),
        )
        if live:
            add_live_controls(
                builder, meshcat, plant, hand.controller, E, push=scenario.external is None
            )
    return Setup(
        scenario, recorder.build(), plant, recorder, lambda bare: _add_models(bare, scenario)
    )


def _add_models(plant: MultibodyPlant, scenario: SingleArmScenario) -> tuple[Frame, Joint]:
    """Adds arm, sensor, tool and surface; returns E and the weld that the sensor reads."""
    E, sensor_joint = _add_arm(plant, scenario)
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
    return E, sensor_joint


def _add_arm(plant: MultibodyPlant, scenario: SingleArmScenario) -> tuple[Frame, Joint]:
    if scenario.robot is not None:
        robot = scenario.robot.load(plant, scenario.arm)
        return robot.end_effector_frame, robot.sensor_joint
    add_cell(plant, CELL_OF_ARM[scenario.arm])
    tool = plant.GetModelInstanceByName(f"{scenario.arm}_tool")
    return plant.GetFrameByName(END_EFFECTOR, tool), sensor_joint_of(plant, scenario.arm)
