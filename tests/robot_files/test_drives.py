"""Effort limits, rotor inertias and gear ratios of a file are those of the arm; the rest is said.

The numbers of MJCF files are MuJoCo's own: `dof_armature`, and the ranges of `jnt_actfrcrange`,
`actuator_forcerange` and, of motors, `actuator_ctrlrange` times gain and gear.
"""

from pathlib import Path

import numpy as np
import pytest
from published_arms import RosArm, write_sdf
from pydrake.multibody.plant import MultibodyPlant

from geoimp_drake.arm.chain import chain_arrays
from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.robot_files.config import RobotConfig
from geoimp_drake.robot_files.loading import LoadedRobot, load_robot

CASES = Path(__file__).parent / "cases"
INERTIAL = '<inertial pos="0 0 0" mass="1" diaginertia=".1 .1 .1"/>'


def loaded(file: Path, end_effector: str) -> tuple[MultibodyPlant, LoadedRobot]:
    plant = MultibodyPlant(1e-3)
    robot = load_robot(file, plant, end_effector=end_effector, geometry="leave-out")
    return plant, robot


def drives(plant: MultibodyPlant, joints: list[str]) -> tuple[list[float], list[float]]:
    """Returns what limits each joint's effort, and the rotor's inertia that is felt there."""
    actuators = [plant.get_joint_actuator(k) for k in plant.GetJointActuatorIndices()]
    by_joint = {actuator.joint().name(): actuator for actuator in actuators}
    assert len(by_joint) == len(actuators)
    assert not any(actuator.has_controller() for actuator in actuators)
    chosen = [by_joint[name] for name in joints]
    felt = [a.default_rotor_inertia() * a.default_gear_ratio() ** 2 for a in chosen]
    return [actuator.effort_limit() for actuator in chosen], felt


def test_servos_and_motors_of_an_mjcf():
    plant, robot = loaded(CASES / "servo_armature.xml", "hand")
    limits, felt = drives(plant, [f"j{k}" for k in range(1, 7)])
    assert limits == [80.0, 87.0, np.inf, 12.0, 12.0, 50.0]
    np.testing.assert_allclose(felt, 0.1, rtol=1e-12)
    assert plant.GetJointActuatorByName("a6").default_gear_ratio() == 50.0
    assert "servos replaced by torque actuators: j1, j2, j3, j4, j5" in robot.changes
    assert "no effort limit known: j3" in robot.changes


def mjcf(defaults: str, joints: list[str], actuators: str) -> str:
    """Returns an arm whose joints are given by their attributes, `childclass` before a bar."""
    body = ""
    for k in range(6, 0, -1):
        childclass, _, joint = joints[k - 1].rpartition("|")
        held = f'childclass="{childclass}"' if childclass else ""
        axis = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")[k - 1]
        body = f"""<body name="l{k}" pos=".1 0 .2" {held}><joint axis="{axis}" {joint}/>{INERTIAL}
            {body}</body>"""
    return f"""<mujoco model="arm"><default>{defaults}</default><worldbody><body name="base">
        {INERTIAL}{body}</body></worldbody><actuator>{actuators}</actuator></mujoco>"""


def test_classes_give_what_elements_leave_out(tmp_path):
    """Nested classes, a body's childclass, and kinds of actuator that share one set."""
    defaults = """<joint armature="0.1"/><position kp="400" forcerange="-30 30"/>
        <default class="big"><joint armature="0.4" actuatorfrcrange="-80 80"/>
        <motor gear="3" ctrlrange="-2 5"/><default class="stiff"><joint frictionloss="2"/>
        <general forcerange="-7 7"/></default></default>"""
    joints = ['name="j1"', 'big|name="j2"', 'stiff|name="j3" armature="0"', 'main|name="j4"']
    joints += ['name="j5" class="stiff" stiffness="9"', ""]
    actuators = """<general joint="j1" ctrlrange="-1 1"/>
        <motor joint="j2" class="big" ctrlrange="-50 50"/>
        <motor joint="j3" class="stiff" forcelimited="false"/><motor joint="j4" gear="-2"/>
        <general joint="j5" class="big" gainprm="4" armature="0.2"/>"""
    file = tmp_path / "arm.xml"
    file.write_text(mjcf(defaults, joints, actuators))
    plant, robot = loaded(file, "l6")
    limits, felt = drives(plant, ["j1", "j2", "j3", "j4", "j5", "l5-l6"])
    assert limits == [30.0, 80.0, 6.0, 60.0, 24.0, np.inf]
    np.testing.assert_allclose(felt, [0.1, 0.4, 0.0, 0.1, 2.2, 0.1], rtol=1e-12)
    assert "servos replaced by torque actuators: j1" in robot.changes
    assert "dry friction left out: j3 2, j5 2" in robot.changes
    assert "springs left out: j5 9" in robot.changes


def test_what_acts_on_no_joint_and_what_drake_has_not_is_said(tmp_path):
    text = mjcf("", [f'name="j{k}"' for k in range(1, 7)], """<motor name="m" joint="j1" gear="0"/>
        <position joint="j2" forcerange="-9 9"/><motor name="both" joint="j2" ctrlrange="-4 4"/>
        <position name="hand" tendon="split"/><general name="jet" site="s"/>""")  # fmt: skip
    text = text.replace('name="l4"', 'name="l4" gravcomp="1"')
    tendon = '<tendon><fixed name="split"><joint joint="j6" coef="1"/></fixed></tendon>'
    file = tmp_path / "arm.xml"
    file.write_text(text.replace("</mujoco>", f"{tendon}</mujoco>"))
    plant, robot = loaded(file, "l6")
    limits, _ = drives(plant, [f"j{k}" for k in range(1, 7)])
    assert limits == [np.inf, 4.0, np.inf, np.inf, np.inf, np.inf]
    for said in (
        "actuators left out: hand, jet",
        "tendons left out: split",
        "gravity compensation left out: l4",
        "smallest limit of several actuators taken: j2",
        "actuators added: j1, j3, j4, j5, j6",
    ):
        assert said in robot.changes


def test_limits_hold_by_themselves_only_where_the_compiler_says_so(tmp_path):
    actuators = """<motor joint="j1" ctrlrange="-4 4"/>
        <motor joint="j2" ctrllimited="true" ctrlrange="-5 5"/>"""
    text = mjcf("", [f'name="j{k}"' for k in range(1, 7)], actuators)
    for automatic, expected in (("true", [4.0, 5.0]), ("false", [np.inf, 5.0])):
        file = tmp_path / f"{automatic}.xml"
        compiler = f'<compiler autolimits="{automatic}"/><default>'
        file.write_text(text.replace("<default>", compiler, 1))
        plant, _ = loaded(file, "l6")
        assert drives(plant, ["j1", "j2"])[0] == expected


def transmission(joint: int, actuator: str) -> str:
    return f"""<transmission name="t{joint}"><type>transmission_interface/SimpleTransmission</type>
        <joint name="joint_{joint}"/><actuator name="{actuator}"><drake:rotor_inertia value="1e-4"/>
        <drake:gear_ratio value="80"/><drake:controller_gains p="100" d="1"/></actuator>
        </transmission>"""


def test_transmissions_of_a_urdf(tmp_path):
    """Also on the joint that is cut, on one without effort, and two of one name."""
    motors = [transmission(k, f"m{k}") for k in (2, 6)] + [transmission(3, "m2")]
    motors.append(transmission(1, "m1").replace('"80"', '"0"'))
    limits = {2: '<limit effort="0" lower="-1" upper="1" velocity="1"/><dynamics friction="3"/>'}
    file = RosArm(tool=False, limits=limits, extra="".join(motors)).write(tmp_path)
    plant, robot = loaded(file, "link_6")
    limits, felt = drives(plant, [f"joint_{k}" for k in (1, 2, 3, 6)])
    assert limits == [310.0, np.inf, 230.0, 46.0]
    np.testing.assert_allclose(felt, [0.0, 0.64, 0.64, 0.64], rtol=1e-12)
    names = [plant.get_joint_actuator(k).name() for k in plant.GetJointActuatorIndices()]
    assert {"m2", "joint_3", "m6"} <= set(names)
    assert "dry friction left out: joint_2 3" in robot.changes


def test_joints_of_an_sdf(tmp_path):
    file = write_sdf(tmp_path)
    axis = "<axis><xyz>0 0 1</xyz>"
    more = """<drake:rotor_inertia>2e-4</drake:rotor_inertia><drake:gear_ratio>50</drake:gear_ratio>
        <axis><xyz>0 0 1</xyz><dynamics><friction>2</friction>
        <spring_stiffness>30</spring_stiffness></dynamics>"""
    text = file.read_text()
    assert axis in text
    file.write_text(text.replace(axis, more))
    plant, robot = loaded(file, "tcp")
    limits, felt = drives(plant, ["joint_1", "joint_2"])
    assert limits == [310.0, 320.0]
    np.testing.assert_allclose(felt, [0.5, 0.0], rtol=1e-12)
    assert "dry friction left out: joint_1 2" in robot.changes
    assert "springs left out: joint_1 30" in robot.changes


@pytest.mark.parametrize("effort", ["150 Nm", "many", "nan"])
def test_a_limit_that_is_no_number_is_named(tmp_path, effort):
    limit = f'<limit effort="{effort}" lower="-1" upper="1" velocity="1"/>'
    file = RosArm(limits={3: limit}).write(tmp_path)
    match = f"effort=…> of 'joint_3' is '{effort}'; give a number"
    with pytest.raises(ConfigurationError, match=match):
        loaded(file, "tool0")


def test_a_scenario_gives_rotor_inertias_that_the_file_does_not_have():
    """As an FR3's: its published file has none."""
    config = RobotConfig(file=str(CASES / "light7.urdf"), end_effector="l7", geometry="leave-out")
    config.rotor_inertia = {"j7": 0.074, "j2": 0.195}
    plant = MultibodyPlant(0.0)
    robot = config.load(plant)
    plant.Finalize()
    model = ControlModel.of_arm(plant, robot.model_instance, robot.end_effector_frame)
    np.testing.assert_array_equal(chain_arrays(model).rotors, [0, 0.195, 0, 0, 0, 0, 0.074])
    config.rotor_inertia = {"j8": 0.1}
    with pytest.raises(ConfigurationError, match=r"robot\.rotor_inertia 'j8'.*j1, j2"):
        config.load(MultibodyPlant(0.0))
    config.rotor_inertia = {"j1": -0.1}
    with pytest.raises(ConfigurationError, match=r"robot\.rotor_inertia\.j1 is -0\.1"):
        config.load(MultibodyPlant(0.0))
