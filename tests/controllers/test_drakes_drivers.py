"""The controller on Drake's own simulated iiwa driver, which holds the arm's weight itself."""

from pathlib import Path

import numpy as np
import pytest
from driven_arm import LIGHT, STIFFNESS, gains
from pydrake.manipulation import IiwaDriver, SimIiwaDriver
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder
from pydrake.systems.primitives import Demultiplexer

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.state import evaluate_arm
from geoimp_drake.controllers.config import FORMS
from geoimp_drake.controllers.gravity_check import check_gravity
from geoimp_drake.controllers.impedance_controller import make_impedance_controller
from geoimp_drake.controllers.wrist_sensor import add_wrist_sensor
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.frame_motion import POSITION
from geoimp_drake.systems.hand_over import HandOver
from geoimp_drake.systems.sources.desired_motion import DesiredMotion
from geoimp_drake.systems.sources.external_wrench import ExternalWrench, WrenchRamp

PUSH = WrenchRamp(force=np.array([0.0, 0.0, 15.0]), start=0.1, duration=0.2, blend=0.05)
WAY = [0.0, 0.0, 15.0 / STIFFNESS]
POSTURE = np.array([0.2, 0.6, -0.3, -1.2, 0.4, 0.9, 0.1])
DURATION = 6.0
# Of the driver's position mode: k_p / B [1/s²].
DRIVERS_RATES = np.array([2000.0, 1500.0, 1500.0, 1500.0, 1500.0, 500.0, 500.0])
HAND = """
  <joint name="wrist" type="fixed"><parent link="l7"/><child link="hand"/></joint>
  <link name="hand"><inertial><origin xyz="0 0 0.03"/><mass value="0.3"/>
    <inertia ixx="4e-4" iyy="4e-4" izz="4e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
  JOINTS
</robot>"""


@pytest.fixture
def urdf(tmp_path: Path) -> Path:
    """A seven-joint arm with a hand that is welded to it, for a sensor to read."""
    motors = "".join(
        f'<transmission name="t{k}"><type>transmission_interface/SimpleTransmission</type>'
        f'<joint name="j{k}"><hardwareInterface>EffortJointInterface</hardwareInterface></joint>'
        f'<actuator name="a{k}"/></transmission>'
        for k in range(1, 8)
    )
    file = tmp_path / "arm.urdf"
    text = LIGHT.read_text().replace('"light"', '"iiwa"')
    file.write_text(text.replace("</robot>", HAND.replace("JOINTS", motors)))
    return file


def controller(
    plant: MultibodyPlant, gravity: str, form: str = "compiled", scheme: str = "inner-loop"
):
    """Returns the controller of the arm in a plant."""
    config = gains()
    config.scheme = scheme
    config.impedance.translation.damping = np.array(200.0)
    config.form = form
    arm, E = plant.GetModelInstanceByName("iiwa"), plant.GetFrameByName("hand")
    return make_impedance_controller(plant, arm, E, config, gravity=gravity)


def pose(plant: MultibodyPlant) -> RigidTransform:
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, plant.GetModelInstanceByName("iiwa"), POSTURE)
    return plant.GetFrameByName("hand").CalcPoseInWorld(context)


def way_of_the_hand(diagram: Diagram, plant: MultibodyPlant) -> np.ndarray:
    """Returns how far the hand has gone after a push [m]."""
    return hand(plant, after_a_push(diagram, plant)) - pose(plant).translation()


def hand(plant: MultibodyPlant, root: Context) -> np.ndarray:
    """Returns where the hand is [m]."""
    context = plant.GetMyContextFromRoot(root)
    return plant.GetFrameByName("hand").CalcPoseInWorld(context).translation()


def after_a_push(diagram: Diagram, plant: MultibodyPlant) -> Context:
    """Returns the diagram's context after a push."""
    root = diagram.CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(root)
    plant.SetPositions(context, plant.GetModelInstanceByName("iiwa"), POSTURE)
    Simulator(diagram, root).AdvanceTo(DURATION)
    return root


def on_drakes_driver(
    urdf: Path,
    gravity: str,
    form: str = "compiled",
    *,
    driven: bool = True,
    handed: bool = False,
    scheme: str = "inner-loop",
) -> tuple[Diagram, MultibodyPlant]:
    """Returns a diagram of the arm behind Drake's driver, or on the plant's own actuation.

    Args:
        urdf: of the arm.
        gravity: who holds the weight, as the controller is told.
        form: of the controller.
        driven: by Drake's driver.
        handed: the torques pass through a hand-over.
        scheme: of the controller; admittance gives the driver positions.
    """
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    alone = MultibodyPlant(1e-3)  # the driver's own model
    for each in (plant, alone):
        Parser(each).AddModels(str(urdf))
        each.WeldFrames(each.world_frame(), each.GetFrameByName("base"))
        each.Finalize()
    arm, E = plant.GetModelInstanceByName("iiwa"), plant.GetFrameByName("hand")
    given = "position" if scheme == "admittance" else "torque"
    mode = IiwaDriver(control_mode=f"{given}_only")
    torque = plant.get_actuation_input_port(arm)
    if driven:
        driver = SimIiwaDriver.AddToBuilder(builder, plant, arm, mode, alone)
        torque = driver.GetInputPort(given)
    system = builder.AddSystem(controller(plant, gravity, form, scheme))
    if scheme == "admittance":
        split = builder.AddSystem(Demultiplexer([7, 7]))
        builder.Connect(system.GetOutputPort("joint_reference"), split.get_input_port())
        actuation = split.get_output_port(0)
    else:
        actuation = system.GetOutputPort("actuation")
    if handed:
        switch = builder.AddSystem(HandOver(7, 0.5, 1e-3))
        builder.Connect(actuation, switch.GetInputPort("torque_1"))
        actuation = switch.GetOutputPort("torque")
    sensor = add_wrist_sensor(builder, plant, plant.GetJointByName("wrist"), E)
    desired = builder.AddSystem(DesiredMotion(pose(plant)))
    push = builder.AddSystem(ExternalWrench(E, PUSH))
    for source, port in (
        (plant.get_state_output_port(arm), system.GetInputPort("estimated_state")),
        (desired.GetOutputPort("motion"), system.GetInputPort("desired_motion")),
        (sensor.GetOutputPort("wrench"), system.GetInputPort("wrench")),
        (actuation, torque),
        (push.get_output_port(), plant.get_applied_spatial_force_input_port()),
    ):
        builder.Connect(source, port)
    return builder.Build(), plant


def test_a_push_on_drakes_simulated_iiwa_driver(urdf):
    diagram, plant = on_drakes_driver(urdf, "robot")
    check_gravity(diagram)
    np.testing.assert_allclose(way_of_the_hand(diagram, plant), WAY, rtol=0, atol=1e-3 * WAY[2])


def test_a_push_on_drakes_driver_in_its_position_mode(urdf):
    """C goes as far as it should; the driver's servos give way to the push as well.

    They have k_p = k B(q), with Drake's k: by B⁻¹Jᵀf/k, 7.3 mm for this arm of 5.6 kg.
    """
    diagram, plant = on_drakes_driver(urdf, "robot", scheme="admittance")
    check_gravity(diagram)
    context = after_a_push(diagram, plant)
    controller = diagram.GetSubsystemByName("iiwa_impedance_controller")
    C = controller.GetOutputPort("compliant_motion").Eval(controller.GetMyContextFromRoot(context))
    np.testing.assert_allclose(
        C[POSITION] - pose(plant).translation(), WAY, rtol=0, atol=1e-3 * WAY[2]
    )
    arm = plant.GetModelInstanceByName("iiwa")
    q = plant.GetPositions(plant.GetMyContextFromRoot(context), arm)
    model = ControlModel.of_arm(plant, arm, plant.GetFrameByName("hand"))
    own = evaluate_arm(model, model.plant.CreateDefaultContext(), np.append(q, np.zeros(7)))
    gives = np.linalg.solve(own.B, own.Jv_V_WE.T @ [0.0, 0.0, 0.0, *PUSH.force]) / DRIVERS_RATES
    reference = controller.GetOutputPort("joint_reference")
    q_d = reference.Eval(controller.GetMyContextFromRoot(context))[:7]
    np.testing.assert_allclose(q - q_d, gives, rtol=0.03)
    way = hand(plant, context) - pose(plant).translation()
    assert way[2] / WAY[2] == pytest.approx(1.24, abs=0.01)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("handed", [False, True], ids=["straight", "through a hand-over"])
def test_a_weight_that_drakes_driver_holds_is_not_held_twice(urdf, form, handed):
    diagram, _ = on_drakes_driver(urdf, "controller", form, handed=handed)
    with pytest.raises(ConfigurationError, match=r"compensated twice: '\w.*drives 'iiwa' through"):
        check_gravity(diagram)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("handed", [False, True], ids=["straight", "through a hand-over"])
def test_a_weight_on_the_plants_own_actuation_is_held_by_somebody(urdf, form, handed):
    diagram, _ = on_drakes_driver(urdf, "robot", form, driven=False, handed=handed)
    with pytest.raises(ConfigurationError, match=r"not be compensated: '\w.*gravity='controller'"):
        check_gravity(diagram)
    check_gravity(on_drakes_driver(urdf, "controller", form, driven=False, handed=handed)[0])


def on_a_station(urdf: Path, gravity: str) -> tuple[Diagram, MultibodyPlant]:
    """Returns a diagram of the arm in a station of the package manipulation."""
    from manipulation.station import LoadScenario, MakeHardwareStation

    scenario = LoadScenario(
        data=f"""
directives:
- add_model: {{name: iiwa, file: "file://{urdf}"}}
- add_weld: {{parent: world, child: "iiwa::base"}}
plant_config: {{time_step: 0.001}}
model_drivers:
  iiwa: !IiwaDriver {{control_mode: torque_only}}
"""
    )

    def add_sensor(builder: DiagramBuilder) -> None:
        plant = builder.GetSubsystemByName("plant")
        E = plant.GetFrameByName("hand")
        sensor = add_wrist_sensor(builder, plant, plant.GetJointByName("wrist"), E)
        builder.ExportOutput(sensor.GetOutputPort("wrench"), "wrench")

    builder = DiagramBuilder()
    station = builder.AddSystem(MakeHardwareStation(scenario, prebuild_callback=add_sensor))
    plant = station.GetSubsystemByName("plant")
    system = builder.AddSystem(controller(plant, gravity))
    desired = builder.AddSystem(DesiredMotion(pose(plant)))
    push = builder.AddSystem(ExternalWrench(plant.GetFrameByName("hand"), PUSH))
    for source, port in (
        (station.GetOutputPort("iiwa_state"), system.GetInputPort("estimated_state")),
        (desired.GetOutputPort("motion"), system.GetInputPort("desired_motion")),
        (station.GetOutputPort("wrench"), system.GetInputPort("wrench")),
        (system.GetOutputPort("actuation"), station.GetInputPort("iiwa.torque")),
        (push.get_output_port(), station.GetInputPort("applied_spatial_force")),
    ):
        builder.Connect(source, port)
    return builder.Build(), plant


def test_a_push_on_a_hardware_station_which_holds_the_weight(urdf):
    pytest.importorskip("manipulation", reason="pip install manipulation")
    with pytest.raises(ConfigurationError, match="compensated twice"):
        check_gravity(on_a_station(urdf, "controller")[0])
    diagram, plant = on_a_station(urdf, "robot")
    check_gravity(diagram)
    np.testing.assert_allclose(way_of_the_hand(diagram, plant), WAY, rtol=0, atol=1e-3 * WAY[2])
