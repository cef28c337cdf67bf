"""Names of systems in a user's diagram: two that are alike end the process in `Build()`."""

import numpy as np
import pytest
from arms import make_arm_plant
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.trajectories import PiecewisePolynomial
from two_arms import POSTURE

from geoimp_drake import (
    add_wrist_sensor,
    add_wrist_sensors,
    load_robot,
    make_cooperative_controller,
    make_impedance_controller,
    wrist_sensor_at,
)
from geoimp_drake.diagrams.scene.cell import add_cell
from geoimp_drake.models import model_path
from geoimp_drake.simulation.live import add_live_controls
from geoimp_drake.simulation.recorder import Recorder
from geoimp_drake.simulation.visualization import add_visualization
from geoimp_drake.systems.arm.industrial_controller import make_industrial_controller


class Diagram:
    def __init__(self):
        self.builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(self.builder, 1e-3)

    def built(self) -> list[str]:
        """Builds the diagram and returns the names of its systems."""
        names = [system.get_name() for system in self.builder.GetSystems()]
        assert sorted(set(names)) == sorted(names)
        self.builder.Build()
        return names


@pytest.fixture
def diagram() -> Diagram:
    return Diagram()


@pytest.fixture
def cell(diagram: Diagram) -> tuple[list, list, list]:
    """Returns arms, sensor joints and hands of the library's two-arm cell, added to the diagram."""
    plant, added = diagram.plant, add_cell(diagram.plant, "two_arms")
    plant.Finalize()
    mounts = [added["seven_sensor"], added["six_sensor"]]
    wrists = [plant.GetJointByName("wrist_sensor", mount) for mount in mounts]
    hands = [plant.GetFrameByName("tool_side", mount) for mount in mounts]
    return [added["seven"], added["six"]], wrists, hands


def test_one_file_loaded_twice_has_two_sensors(diagram: Diagram) -> None:
    plant, file = diagram.plant, model_path("six_joint_arm")
    robots = [
        load_robot(file, plant, end_effector="flange", name="left"),
        load_robot(
            file,
            plant,
            end_effector="flange",
            name="right",
            base_pose=RigidTransform([0.0, 2.0, 0.0]),
        ),
    ]
    plant.Finalize()
    for robot in robots:
        arm, E = robot.model_instance, robot.end_effector_frame
        diagram.builder.AddSystem(make_impedance_controller(plant, arm, E))
        add_wrist_sensor(diagram.builder, plant, robot.sensor_joint, E)
    names = diagram.built()
    assert {"left_wrist_sensor_sensor", "right_wrist_sensor_sensor"} <= set(names)
    assert {"left_impedance_controller", "right_impedance_controller"} <= set(names)


def test_both_wrists_of_the_cell_have_a_sensor_and_one_has_a_second(diagram, cell) -> None:
    _, wrists, hands = cell
    for wrist, hand in zip([*wrists, wrists[0]], [*hands, hands[0]], strict=True):
        add_wrist_sensor(diagram.builder, diagram.plant, wrist, hand)
    expected = ["seven_sensor_wrist_sensor_sensor", "six_sensor_wrist_sensor_sensor"]
    assert diagram.built()[2:] == [*expected, f"{expected[0]}_2"]


def test_several_systems_of_sensors_stand_in_one_diagram(diagram, cell) -> None:
    _, wrists, hands = cell
    for wrist, hand in zip(wrists, hands, strict=True):
        sensor = wrist_sensor_at(diagram.plant, wrist, hand)
        add_wrist_sensors(diagram.builder, diagram.plant, [sensor])
    assert diagram.built()[2:] == ["wrist_sensors", "wrist_sensors_2"]


def test_controllers_of_one_arm_have_names_of_their_own(diagram, cell) -> None:
    arms, _, hands = cell
    plant, add = diagram.plant, diagram.builder.AddSystem
    rest = PiecewisePolynomial(POSTURE)
    for _ in range(2):
        add(make_impedance_controller(plant, arms[1], hands[1]))
        add(make_cooperative_controller(plant, arms, hands))
        add(make_industrial_controller(plant, arms[1], hands[1], rest))
    kinds = ["six_impedance_controller", "seven_six_cooperative_controller"]
    kinds.append("six_industrial_controller")
    assert diagram.built()[2:] == [*kinds, *(f"{kind}_2" for kind in kinds)]


def test_a_plants_first_controller_has_no_number_whatever_was_made_before() -> None:
    rigs = [make_arm_plant(joints=6) for _ in range(2)]
    names = [make_impedance_controller(rig.plant, rig.arm, rig.E).get_name() for rig in rigs]
    assert names[0] == names[1]
    assert not names[0].endswith("_2")


def test_views_logs_and_controls_of_two_arms_stand_in_one_diagram(diagram, cell) -> None:
    arms, _, hands = cell
    builder, plant = diagram.builder, diagram.plant
    motion = builder.AddSystem(ConstantVectorSource(np.eye(19)[0])).get_output_port()
    wrench = builder.AddSystem(ConstantVectorSource(np.zeros(6))).get_output_port()
    for k in range(2):
        meshcat = Meshcat()
        controller = builder.AddSystem(make_impedance_controller(plant, arms[k], hands[k]))
        add_live_controls(builder, meshcat, plant, controller, hands[k], push=k == 0)
        add_visualization(builder, diagram.scene_graph, meshcat, plant, {"E": motion}, wrench)
    # Systems of the user's.
    builder.AddNamedSystem("log", ConstantVectorSource(np.zeros(1)))
    recorder = Recorder(builder, 0.01)
    recorder.record("E", motion)
    names = {system.get_name() for system in recorder.build().GetSystems()}
    assert {f"{name}_2" for name in ("stiffness_sliders", "frame_triads", "wrench_arrow")} <= names
    assert {"log", "logged_signals", "log_2"} <= names
