"""One arm, its wrist sensor and a surface under six-DOF impedance control.

```
 desired_motion ──▶ compliant arm ◀──▶ plant: arm ═ sensor ═ tool: disk ▷ surface
```
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, Joint

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.diagrams.scene.cell import END_EFFECTOR, add_cell
from geoimp_drake.diagrams.scene.colliding_body import ContactForce
from geoimp_drake.diagrams.scene.surface import surface_plane
from geoimp_drake.diagrams.scene.surface_placement import check_clear
from geoimp_drake.diagrams.setups.compliant_arm import add_compliant_arm, sensor_joint_of
from geoimp_drake.diagrams.setups.posture import start_posture
from geoimp_drake.diagrams.setups.setup import Setup
from geoimp_drake.diagrams.setups.setup_builder import SetupBuilder
from geoimp_drake.diagrams.setups.single_arm_scenario import CELL_OF_ARM, SingleArmScenario
from geoimp_drake.diagrams.setups.true_plant import add_friction

__all__ = ["add_single_arm", "build_single_arm", "model_of_single_arm"]

AddHand = Callable[[SetupBuilder[Any], Frame, RigidTransform], None]


def build_single_arm(
    scenario: SingleArmScenario,
    meshcat: Meshcat | None = None,
    *,
    live: bool = False,
    logged: bool = True,
    add_hand: AddHand | None = None,
) -> Setup:
    """Builds the diagram of a scenario.

    Args:
        scenario: its open fields are filled in.
        meshcat: draws the run; None for no drawing.
        live: add sliders there, see `SetupBuilder`.
        logged: with its log, see there.
        add_hand: adds anything else that acts on E; it gets E's pose at the start.

    Raises:
        ConfigurationError: the scenario cannot be used; the message says why.
    """
    setup = SetupBuilder(
        scenario, lambda plant: add_single_arm(plant, scenario), meshcat, live=live, logged=logged
    )
    plant, (E, sensor_joint) = setup.plant, setup.models
    arm = plant.GetModelInstanceByName(scenario.arm)
    model = ControlModel.of_arm(plant, arm, E)
    posture, X_WE = start_posture(model, scenario.start, regular=scenario.limits is None)
    plant.SetDefaultPositions(arm, model.in_plant_order(posture))
    scenario.start.posture = posture.tolist()
    setup.warn_of_start(arm, E)
    if scenario.surface is not None:
        check_clear(X_WE, surface_plane(scenario.surface.pose()), "start.position")

    desired = setup.add_desired_motion(X_WE, scenario.segments)
    hand = add_compliant_arm(setup, scenario.arm, E, sensor_joint, desired, scenario)
    setup.add_external_wrench(E, X_WE.rotation(), scenario.external)
    if add_hand is not None:
        add_hand(setup, E, X_WE)
    if setup.is_logged:
        hand.record(setup)
    if scenario.body is not None and setup.is_logged:
        _record_contact(setup)
    setup.record_surface(scenario.surface, np.zeros(3))
    setup.add_views(hand.name, "DCE", hand.controller.GetOutputPort("wrench"), hand.controller, E)
    if scenario.robot is not None:
        setup.frame_models(E)
    return setup.build(loop=hand.loop, surface=scenario.surface)


def _record_contact(setup: SetupBuilder[Any]) -> None:
    """Logs the force on the body that the hand runs into."""
    force = setup.builder.AddSystem(ContactForce())
    setup.builder.Connect(setup.plant.get_contact_results_output_port(), force.get_input_port())
    setup.recorder.record("body/force", force.get_output_port())


def model_of_single_arm(scenario: SingleArmScenario) -> ControlModel:
    """Returns the arm as a scenario's controller knows it, without weight if the robot holds it.

    Raises:
        ConfigurationError: the scenario cannot be used.
    """
    plant = MultibodyPlant(scenario.plant.time_step)
    E, _ = add_single_arm(plant, replace(scenario, surface=None, body=None))
    robot = scenario.robot
    has_weight = robot is None or robot.driver.kind == "plant"
    arm = plant.GetModelInstanceByName(scenario.arm)
    return ControlModel.of_arm(plant, arm, E, gravity=has_weight)


def add_single_arm(plant: MultibodyPlant, scenario: SingleArmScenario) -> tuple[Frame, Joint]:
    """Adds arm, sensor, tool and surface; returns E and the weld that the sensor reads."""
    E, sensor_joint = _add_arm(plant, scenario)
    if scenario.surface is not None:
        scenario.surface.add(
            plant, E.body(), E.GetFixedPoseInBodyFrame(), scenario.disk_resolution_hint
        )
    for actuator in map(plant.get_joint_actuator, plant.GetJointActuatorIndices()):
        actuator.set_effort_limit(scenario.effort_scale * actuator.effort_limit())
    if scenario.body is not None:
        scenario.body.add(plant, E.body(), E.GetFixedPoseInBodyFrame().translation())
    add_friction(plant, scenario.world)
    plant.Finalize()
    return E, sensor_joint


def _add_arm(plant: MultibodyPlant, scenario: SingleArmScenario) -> tuple[Frame, Joint]:
    if scenario.robot is not None:
        robot = scenario.robot.load(plant, scenario.arm)
        return robot.end_effector_frame, robot.sensor_joint
    add_cell(plant, CELL_OF_ARM[scenario.arm])
    tool = plant.GetModelInstanceByName(f"{scenario.arm}_tool")
    return plant.GetFrameByName(END_EFFECTOR, tool), sensor_joint_of(plant, scenario.arm)
