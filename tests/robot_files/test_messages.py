"""What is wrong in a robot's file is said with the file and the line, and each kind once."""

import logging

import pytest
from published_arms import JOINTS, RosArm, write_mjcf, write_sdf
from pydrake.multibody.plant import MultibodyPlant

from geoimp_drake.errors import ConfigurationError, ModelError
from geoimp_drake.robot_files.loading import load_robot


def line_of(text: str, piece: str) -> int:
    return text[: text.index(piece)].count("\n") + 1


def refused(file, end_effector="tool0") -> str:
    with pytest.raises(ConfigurationError) as raised:
        load_robot(file, MultibodyPlant(1e-3), end_effector=end_effector, geometry="leave-out")
    said = str(raised.value)
    assert "\n" not in said
    assert "string>" not in said
    return said


def changed(file, old: str, new: str) -> int:
    """Changes a file once; returns the line."""
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    return line_of(text, old)


@pytest.mark.parametrize(
    ("write", "old", "new"),
    [
        (RosArm().write, '<joint name="joint_4" type="revolute"', '<joint name="j" type="odd"'),
        (write_sdf, '<joint name="joint_4" type="revolute"', '<joint name="j" type="gearbox"'),
        (write_mjcf, '<joint name="joint_4"', '<joint name="joint_4" type="odd"'),
    ],
)
def test_an_error_of_drakes_has_the_users_line(tmp_path, write, old, new):
    file = write(tmp_path)
    file.write_text(file.read_text().replace("><", ">\n\n<"))
    line = changed(file, old, new)
    assert f"{file}:{line}: error: " in refused(file)


def test_a_line_of_an_included_file_is_its_own(tmp_path):
    file = write_mjcf(tmp_path)
    changed(file, "<worldbody>", '<include file="more.xml"/><worldbody>')
    odd = '<worldbody><body name="b"><joint name="j" type="odd"/></body></worldbody>'
    (tmp_path / "more.xml").write_text(f"<mujoco>\n\n{odd}</mujoco>")
    assert f"{tmp_path / 'more.xml'}:3: error: " in refused(file, "tcp")


def test_a_file_that_includes_itself_is_named(tmp_path):
    file = write_mjcf(tmp_path)
    (tmp_path / "motors.xml").write_text('<mujoco><include file="motors.xml"/></mujoco>')
    assert "includes" in refused(file, "tcp")


def test_elements_within_each_other_without_end_are_refused(tmp_path):
    file = tmp_path / "deep.xml"
    file.write_text("<mujoco>" + "\n<body>" * 5000 + "</body>" * 5000 + "</mujoco>")
    assert f"{file}:201: " in refused(file)


@pytest.mark.parametrize(
    ("write", "old", "new", "match"),
    [
        (RosArm().write, 'effort="64.0"', 'effort="150 Nm"', "effort=…> of 'joint_4' is '150 Nm'"),
        (RosArm().write, 'lower="-2.9"', 'lower="-2,9"', "lower=…> of 'joint_1' is '-2,9'"),
        (RosArm().write, 'xyz="0.03 0.01', 'xyz="nan 0.01', "xyz=…> of 'base_link' is 'nan"),
        (
            RosArm().write,
            'xyz="0.03 0.01',
            'xyz="0.03 0.01 1',
            "'0.03 0.01 1 0.02'; give 3 numbers",
        ),
        (RosArm().write, 'mass value="9.0"', 'mass value="1e200"', "'1e200'; give a number below"),
        (RosArm().write, 'mass value="9.0"', 'mass value="9 0"', "'9 0'; give 1 number"),
        (write_sdf, "<effort>310.0<", "<effort>310 Nm<", "<effort> of 'joint_1' is '310 Nm'"),
        (write_sdf, "<mass>10.0<", "<mass>10_0<", "<mass> of 'base_link' is '10_0'"),
        (write_mjcf, 'range="-2.9 2.9"', 'range="-2.9 2.9rad"', "range=…> of 'joint_1' is"),
        (write_mjcf, 'pos="0.07 0 0"', 'pos="0.07 0"', "pos=…> of 'tcp' is '0.07 0'; give 3"),
    ],
)
def test_what_is_no_number_is_not_cut_down_to_one(tmp_path, write, old, new, match):
    """Drake reads "150 Nm" as 150 and "-2,9" as -2."""
    file = write(tmp_path)
    line = changed(file, old, new)
    said = refused(file, "tcp")
    assert said.startswith(f"{file}:{line}: <")
    assert match in said


def test_warnings_of_one_kind_are_one_line_with_the_first_place_and_their_count(tmp_path, caplog):
    file = RosArm().write(tmp_path)
    text = file.read_text().replace("<axis", '\n<safety_controller k="1"/><axis')
    file.write_text(text.replace("<link", "\n<link"))
    with caplog.at_level(logging.WARNING, logger="drake"):
        load_robot(file, MultibodyPlant(1e-3), end_effector="tool0", geometry="leave-out")
    (said,) = [r.getMessage() for r in caplog.records if r.levelno == logging.WARNING]
    line = line_of(file.read_text(), "<safety_controller")
    assert said.startswith(f"{file}:{line}: warning: The tag 'safety_controller'")
    count = len(JOINTS) + 2  # the two fixed ones
    assert said.endswith(f"(the first of {count} of this kind)")


def test_warnings_of_two_kinds_are_two_lines(tmp_path, caplog):
    file = write_mjcf(tmp_path)
    two = 'springdamper="0 0" group="1" limited="true" margin="0" range='
    file.write_text(file.read_text().replace(" range=", " " + two))
    with caplog.at_level(logging.WARNING, logger="drake"):
        load_robot(file, MultibodyPlant(1e-3), end_effector="tcp", geometry="leave-out")
    said = [r.getMessage() for r in caplog.records if "(the first of 6 of" in r.getMessage()]
    assert len(said) == 2


@pytest.mark.parametrize(
    ("write", "old", "new"),
    [
        (RosArm().write, 'lower="-2.9" upper="2.9"', 'lower="2.9" upper="-2.9"'),
        (write_sdf, "<lower>-2.9</lower>", "<lower>3.9</lower>"),
        (write_mjcf, 'range="-2.9 2.9"', 'range="2.9 -2.9"'),
    ],
)  # fmt: skip
def test_limits_the_wrong_way_round_are_named_where_drake_would_abort(tmp_path, write, old, new):
    file = write(tmp_path)
    line = changed(file, old, new)
    said = refused(file, "tcp")
    assert "the lower above the upper" in said
    assert abs(int(said.split(":")[1]) - line) <= 1  # the joint's


def test_a_declaration_may_follow_blank_lines_as_with_drake(tmp_path):
    file = RosArm().write(tmp_path)
    file.write_text(f'\n\n<?xml version="1.0"?>\n{file.read_text()}')
    line = changed(file, 'type="revolute"', 'type="odd"')
    assert f"{file}:{line}: error: " in refused(file)


def test_sites_are_read_and_no_warning_says_otherwise(tmp_path, caplog):
    with caplog.at_level(logging.WARNING, logger="drake"):
        load_robot(
            write_mjcf(tmp_path), MultibodyPlant(1e-3), end_effector="tcp", geometry="leave-out"
        )
    assert not [r for r in caplog.records if r.levelno == logging.WARNING]


def test_a_robot_that_drake_reads_and_no_arm_is_made_of_is_named(tmp_path):
    file = write_sdf(tmp_path)
    changed(file, '<joint name="joint_3" type="revolute"', '<joint name="joint_3" type="ball"')
    with pytest.raises(ModelError, match="'joint_3' is of type 'ball_rpy'; an arm is made of"):
        load_robot(file, MultibodyPlant(1e-3), end_effector="tcp", geometry="leave-out")
