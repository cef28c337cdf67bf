"""The controller on arms that are not ours, with other models around, wired as a user would."""

import numpy as np
import pytest
from arms import ArmPlant, make_arm_plant, relative_error
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import PortDataType
from rigs import K_O, K_P, make_controlled_arm, quick_config

from geoimp_drake.controllers.impedance_controller import make_impedance_controller
from geoimp_drake.errors import ConfigurationError, ModelError
from geoimp_drake.rotations import so3

FORCE = np.array([20.0, -10.0, 15.0])
ARMS = {
    "six": {"joints": 6},
    "six among others, motors in another order": {
        "joints": 6,
        "company": True,
        "actuator_order": [4, 2, 6, 1, 3, 5],
    },
    "six declared from the hand": {"joints": 6, "from_hand": True},
    "seven among others": {"joints": 7, "company": True},
}
PORTS = {
    "estimated_state": lambda n: 2 * n,
    "desired_motion": lambda n: 19,
    "wrench": lambda n: 6,
    "stiffness_scale": lambda n: 2,
    "actuation": lambda n: n,
    "compliant_motion": lambda n: 19,
}


def holding_torque(rig: ArmPlant, context) -> np.ndarray:
    """Returns what the arm's motors must give to hold it, by the user's own plant."""
    tau = -rig.plant.CalcGravityGeneralizedForces(context)
    S = rig.plant.MakeActuationMatrix()
    columns = [
        rig.plant.get_joint_actuator(index).input_start()
        for index in rig.plant.GetJointActuatorIndices(rig.arm)
    ]
    return S[:, sorted(columns)].T @ tau


@pytest.mark.parametrize("name", ARMS)
def test_a_push_displaces_the_hand_by_the_inverse_stiffness(name: str) -> None:
    arm = make_controlled_arm(**ARMS[name])
    arm.push(FORCE)
    arm.simulator.AdvanceTo(1.2)
    moved = arm.pose().translation() - arm.X_WD.translation()
    expected = np.linalg.solve(K_P, FORCE)
    print(f"\n{name}: {relative_error(moved, expected):.2%} from the inverse stiffness")
    assert relative_error(moved, expected) < 0.01
    np.testing.assert_allclose(arm.wrench()[3:], -FORCE, atol=0.02)
    assert so3.log(turned(arm)) == pytest.approx(np.zeros(3), abs=1e-3)


@pytest.mark.parametrize("name", ["six", "seven among others"])
def test_a_twist_turns_the_hand_by_the_inverse_stiffness(name: str) -> None:
    arm = make_controlled_arm(**ARMS[name])
    moment_D = np.array([0.15, -0.10, 0.2])
    arm.push(np.zeros(3), arm.X_WD.rotation().matrix() @ moment_D)
    arm.simulator.AdvanceTo(1.4)
    R_DE = arm.X_WD.rotation().matrix().T @ arm.pose().rotation().matrix()
    # 0.03 rad is small: the stiffness is K_o in the axes of the hand, whatever its attitude.
    np.testing.assert_allclose(K_O @ so3.log(R_DE), moment_D, rtol=0.02, atol=1e-3)
    assert np.linalg.norm(arm.pose().translation() - arm.X_WD.translation()) < 1e-3


def turned(arm) -> np.ndarray:
    return arm.X_WD.rotation().matrix().T @ arm.pose().rotation().matrix()


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("initialized", [False, True])
def test_first_torque_is_the_static_holding_torque(name: str, initialized: bool) -> None:
    arm = make_controlled_arm(**ARMS[name])
    if initialized:
        arm.simulator.Initialize()
    expected = holding_torque(arm.rig, arm.plant_context)
    assert np.abs(expected).max() > 5.0
    assert relative_error(arm.read("actuation"), expected) < 1e-9


def test_arm_stands_still_where_it_is_told_to() -> None:
    arm = make_controlled_arm(7, company=True)
    arm.simulator.AdvanceTo(0.3)
    np.testing.assert_allclose(arm.pose().translation(), arm.X_WD.translation(), atol=1e-6)
    wrench = np.abs(arm.wrench())
    assert wrench[3:].max() < 0.02
    assert wrench[:3].max() < 0.002
    expected = holding_torque(arm.rig, arm.plant_context)
    assert relative_error(arm.read("actuation"), expected) < 1e-4


@pytest.mark.parametrize("joints", [6, 7])
def test_ports_have_the_documented_names_and_sizes(joints: int) -> None:
    rig = make_arm_plant(joints=joints, company=True)
    controller = make_impedance_controller(rig.plant, rig.arm, rig.E)
    for k, (name, size) in enumerate(PORTS.items()):
        get = controller.GetInputPort if k < 4 else controller.GetOutputPort
        assert get(name).get_data_type() == PortDataType.kVectorValued
        assert get(name).size() == size(joints)
    assert controller.num_input_ports() == 4


def test_default_configuration_is_the_chapters_first_experiment() -> None:
    rig = make_arm_plant()
    make_impedance_controller(rig.plant, rig.arm, rig.E)
    gains = quick_config().motion
    assert (gains.K_Pp, gains.K_Dp, gains.K_Po, gains.K_Do) == (2025.0, 65.0, 4500.0, 65.0)


def test_users_plant_is_left_as_it_is() -> None:
    rig = make_arm_plant(company=True)
    before = rig.plant.num_frames(), rig.plant.num_joints(), rig.plant.num_bodies()
    make_impedance_controller(rig.plant, rig.arm, rig.E)
    assert (rig.plant.num_frames(), rig.plant.num_joints(), rig.plant.num_bodies()) == before


def test_a_plant_in_continuous_time_will_do() -> None:
    rig = make_arm_plant(MultibodyPlant(0.0))
    controller = make_impedance_controller(rig.plant, rig.arm, rig.E)
    assert controller.GetOutputPort("actuation").size() == 6


def test_errors_of_the_model_and_of_the_configuration_reach_the_caller() -> None:
    rig = make_arm_plant()
    with pytest.raises(ModelError, match=r"'base'.*'joint1'|'joint1'.*'base'"):
        make_impedance_controller(rig.plant, rig.arm, rig.plant.GetFrameByName("base"))
    config = quick_config()
    config.impedance.rotation.stiffness = np.diag([1.0, -2.0, 1.0])
    with pytest.raises(ConfigurationError, match=r"impedance\.rotation\.stiffness.*-2"):
        make_impedance_controller(rig.plant, rig.arm, rig.E, config)
