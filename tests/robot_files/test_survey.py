"""Which arms and end effectors are found in a robot's file."""

from pathlib import Path

import pytest
from published_arms import RosArm

from geoimp_drake.errors import ConfigurationError, ModelError
from geoimp_drake.robot_files.survey import survey_robot

CASES = Path(__file__).parent / "cases"
INERTIAL = (
    '<inertial><mass value="1"/>'
    '<inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial>'
)


def chain(*names, parent="base", kind="revolute", child="{}_link"):
    """Returns the URDF elements of joints that follow one another, each with its link."""
    text = ""
    for name in names:
        link = child.format(name)
        limit = '<limit lower="-1" upper="1" effort="9" velocity="1"/>' * (kind != "fixed")
        text += (
            f'<link name="{link}">{INERTIAL}</link><joint name="{name}" type="{kind}">'
            f'<parent link="{parent}"/><child link="{link}"/><axis xyz="0 0 1"/>{limit}</joint>'
        )
        parent = link
    return text


def joints(prefix, count):
    return [f"{prefix}{k}" for k in range(1, count + 1)]


@pytest.fixture
def survey(tmp_path):
    def of(*elements):
        file = tmp_path / "robot.urdf"
        file.write_text(f'<robot name="r"><link name="base"/>{"".join(elements)}</robot>')
        return survey_robot(file)

    return of


def test_the_end_effector_is_named_like_one_where_there_is_such_a_frame(tmp_path):
    found = survey_robot(RosArm(gripper=True).write(tmp_path))
    (arm,) = found.arms
    assert arm.end_effector == "tool0"
    assert arm.others == ("flange", "link_6")
    assert len(arm.joints) == 6
    assert set(found.frames) >= {"base_link", "link_6", "tool0"}


@pytest.mark.parametrize("file", ["light6.urdf", "servo_armature.xml", "planar.urdf"])
def test_without_such_a_name_it_is_the_outermost_link(file):
    (arm,) = survey_robot(CASES / file).arms
    assert arm.end_effector == {"servo_armature.xml": "hand"}.get(file, "l6")


def test_a_site_of_an_mjcf_file_can_be_one(tmp_path):
    text = (CASES / "servo_armature.xml").read_text()
    file = tmp_path / "arm.xml"
    file.write_text(
        text.replace('<body name="hand"', '<site name="attachment_site"/><body name="hand"')
    )
    (arm,) = survey_robot(file).arms
    assert arm.end_effector == "attachment_site"


def test_several_arms_on_a_torso_are_listed_with_the_joints_that_move_them(survey):
    found = survey(
        chain("torso"),
        chain(*joints("left_", 7), parent="torso_link"),
        chain("left_tool0", parent="left_7_link", kind="fixed", child="{}"),
        chain(*joints("right_", 6), parent="torso_link"),
        chain(*joints("head_", 2), parent="torso_link"),
    )
    assert [(arm.end_effector, len(arm.joints)) for arm in found.arms] == [
        ("left_tool0", 8),
        ("right_6_link", 7),
    ]
    assert all(arm.joints[0] == "torso" for arm in found.arms)


HANDS = {
    "two fingers": chain("a", parent="j6_link") + chain("b", parent="j6_link"),
    "one jaw": chain("jaw_slide", parent="j6_link", kind="prismatic"),
    "a finger of four joints": chain(*joints("index_finger_", 4), parent="j6_link"),
    "five-joint fingers": chain(*joints("a", 5), parent="j6_link")
    + chain(*joints("b", 5), parent="j6_link"),
    "one joint that follows another": chain("a", parent="j6_link").replace(
        "<axis", '<mimic joint="j1"/><axis'
    ),
    "none": "",
}


@pytest.mark.parametrize("hand", HANDS)
def test_an_arm_ends_where_its_hand_begins(survey, hand):
    (arm,) = survey(chain(*joints("j", 6)), HANDS[hand]).arms
    assert arm.end_effector == "j6_link"
    assert arm.joints == tuple(joints("j", 6))


def test_a_seventh_joint_belongs_to_the_arm(survey):
    (arm,) = survey(chain(*joints("j", 7))).arms
    assert arm.end_effector == "j7_link"
    assert arm.others == ("j6_link",)


def test_a_wrist_that_moves_a_link_called_gripper_belongs_to_the_arm(survey):
    (arm,) = survey(chain(*joints("j", 5)), chain("j6", parent="j5_link", child="gripper")).arms
    assert arm.joints[-1] == "j6"


def test_a_frame_of_the_tool_is_preferred_to_a_camera_that_is_farther_out(survey):
    (arm,) = survey(
        chain(*joints("j", 6)),
        chain("camera", "camera_optical", parent="j6_link", kind="fixed", child="{}"),
    ).arms
    assert arm.end_effector == "j6_link"


def test_a_robot_without_six_joints_that_follow_one_another_is_refused(survey):
    with pytest.raises(ModelError, match=r"longest chain has 5 moving joints.*needs 6"):
        survey(chain(*joints("a", 5)), chain(*joints("b", 4)))


def test_a_file_that_is_not_there_is_named():
    with pytest.raises(ConfigurationError, match=r"nowhere\.urdf"):
        survey_robot("nowhere.urdf")


def test_a_long_finger_is_no_arm(survey):
    """Fingers of seven joints each, named after those of a hand; "middle" alone is an arm's."""
    hand = [chain(*joints(f"hand_{f}_", 7), parent="j6_link") for f in ("index", "middle")]
    (found,) = survey(chain(*joints("j", 6)), *hand).arms
    assert found.joints == tuple(joints("j", 6))
    (found,) = survey(chain(*joints("arm_middle_", 6))).arms
    assert found.joints == tuple(joints("arm_middle_", 6))
