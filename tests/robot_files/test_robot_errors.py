"""What cannot be used is refused by name and number, with what to do."""

import builtins
import re
from pathlib import Path

import numpy as np
import pytest
from published_arms import RosArm, inertial_urdf, write_sdf
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import LinearBushingRollPitchYaw

from geoimp_drake.errors import ConfigurationError, ModelError
from geoimp_drake.robot_files.config import RobotConfig
from geoimp_drake.robot_files.description import read_description
from geoimp_drake.robot_files.loading import load_robot
from geoimp_drake.robot_files.parsing import parse
from geoimp_drake.robot_files.source import read_xml
from geoimp_drake.validation import check

CASES = Path(__file__).parent / "cases"


def refused(error, match, file, folder, **options):
    options = {"end_effector": "tool0", "cache": folder / "cache", **options}
    plant = options.pop("plant", None) or MultibodyPlant(1e-3)
    with pytest.raises(error, match=match):
        load_robot(file, plant, **options)


def test_missing_file(tmp_path):
    refused(ConfigurationError, r"no_arm\.urdf cannot be read: .*No such", "no_arm.urdf", tmp_path)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("<robot>\n<link name='a'>\n</robot>", "is not XML: mismatched tag: line 3"),
        ("", "no element found"),
        ("<scene/>", r"begins with <scene>.*URDF.*SDF.*MJCF"),
        (
            '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arm/></robot>',
            "xacro arm.urdf > robot.urdf",
        ),
        ("<robot name='r'><link name='a'/><joint name='j'/></robot>", r"Drake cannot read.*'j'"),
    ],
)
def test_unreadable_descriptions(tmp_path, text, match):
    file = tmp_path / "arm.urdf"
    file.write_text(text)
    refused(ConfigurationError, match, file, tmp_path)


@pytest.mark.parametrize(
    "comment", ["<!-- ===\n<!-- twice begun -->", "<!-- a -- b --->", "<!---->", "<!------>"]
)
def test_a_comment_may_hold_hyphens_as_drakes_parser_lets_pass(tmp_path, comment):
    file = RosArm().write(tmp_path)
    file.write_text(file.read_text().replace("<link", f"{comment}<link", 1))
    robot = load_robot(file, MultibodyPlant(1e-3), end_effector="tool0", geometry="leave-out")
    assert robot.end_effector_frame.name() == "tool0"


def test_a_comment_that_nothing_closes_is_refused_at_once(tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_text("<robot>" + "<!--" * 500_000)
    refused(ConfigurationError, "is not XML", file, tmp_path)


def test_hyphens_beside_comments_stay(tmp_path):
    file = tmp_path / "arm.xml"
    file.write_text("<robot a='--'><![CDATA[<!-- a--b -->]]><b/><!-- c--d --></robot>")
    root = read_xml(file)
    assert (root.text, root.get("a"), len(root)) == ("<!-- a--b -->", "--", 1)


def test_too_few_joints(tmp_path):
    file = RosArm(joints=5).write(tmp_path)
    refused(ModelError, r"arm\.urdf: .* 5 joints.*joint_1, .*joint_5.*at least 6", file, tmp_path)
    refused(
        ModelError, "No joint moves frame 'base_link'", file, tmp_path, end_effector="base_link"
    )


def test_unknown_frame(tmp_path):
    refused(
        ModelError,
        r"arm\.urdf: Unknown frame 'tool'\. Did you mean 'tool0'\? Valid: base_link, .*tool0",
        RosArm().write(tmp_path),
        tmp_path,
        end_effector="tool",
    )


def test_frames_that_drake_adds_are_not_listed(tmp_path):
    valid = r"Valid: base_link, link_1, link_2, link_3, link_4, link_5, link_6, tcp\.$"
    refused(ModelError, valid, write_sdf(tmp_path), tmp_path, end_effector="hand")


def test_unknown_sensor_joint(tmp_path):
    refused(
        ModelError,
        r"'joint_6' is not a fixed joint.*Valid: to_flange, to_tool0",
        RosArm().write(tmp_path),
        tmp_path,
        sensor_joint="joint_6",
    )


@pytest.mark.parametrize(
    ("mass", "moments", "match"),
    [
        (2.0, (0.1, 0.1, 0.5), r"'link_3' has mass 2 kg.*izz 0\.5.*moments 0\.1, 0\.1, 0\.5"),
        (2.0, (-0.1, 0.1, 0.1), r"'link_3'.*ixx -0\.1"),
        (-2.0, (0.1, 0.1, 0.1), r"'link_3' has mass -2 kg"),
        (0.0, (0.1, 0.1, 0.1), r"'link_3' has mass 0 kg.*Give its mass"),
    ],
)  # fmt: skip
def test_unphysical_inertia_of_a_urdf(tmp_path, mass, moments, match):
    inertial = inertial_urdf(1.0, *moments).replace('mass value="1.0"', f'mass value="{mass}"')
    refused(ModelError, match, RosArm(inertial={"link_3": inertial}).write(tmp_path), tmp_path)


def test_joint_that_carries_nothing(tmp_path):
    inertial = {"link_6": "", "flange": ""}
    file = RosArm(inertial=inertial).write(tmp_path)
    file.write_text(re.sub("<visual>.*?</collision>", "", file.read_text()))
    match = "Joint 'joint_6' of arm.urdf carries no inertia: link 'link_6'"
    refused(ModelError, match, file, tmp_path)


def test_arm_joint_that_follows_another(tmp_path):
    limit = '<limit effort="9" lower="-1" upper="1" velocity="1"/><mimic joint="joint_2"/>'
    match = "Joint 'joint_3'.*follows another joint"
    refused(ModelError, match, RosArm(limits={3: limit}).write(tmp_path), tmp_path)


def test_missing_mesh_and_missing_package(tmp_path):
    file = RosArm().write(tmp_path)
    (file.parents[1] / "meshes" / "shell.dae").unlink()
    match = r"arm\.urdf:2 names 'package://small_arm/meshes/shell\.dae'.*no file .*leave-out"
    refused(ConfigurationError, match, file, tmp_path)
    (file.parents[1] / "package.xml").unlink()
    match = r"package 'small_arm'.*neither above nor beside.*small_arm: FOLDER"
    refused(ConfigurationError, match, file, tmp_path)
    refused(
        ConfigurationError,
        r"packages\.small_arm is .*nowhere, which is not a folder",
        file,
        tmp_path,
        packages={"small_arm": tmp_path / "nowhere"},
    )


def test_unreadable_mesh(tmp_path):
    file = RosArm().write(tmp_path)
    (file.parents[1] / "meshes" / "shell.dae").write_text("no mesh")
    refused(ConfigurationError, r"shell\.dae cannot be read: .*Repair it", file, tmp_path)


def test_mesh_without_triangles(tmp_path):
    file = RosArm().write(tmp_path)
    (file.parents[1] / "meshes" / "shell.STL").write_text("solid t\nendsolid t\n")
    refused(ConfigurationError, r"shell\.STL has no triangles", file, tmp_path)


@pytest.mark.parametrize("package", ["trimesh", "collada", "platformdirs"])
def test_missing_extra_is_named(tmp_path, monkeypatch, package):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    _hide(monkeypatch, package)
    match = rf"needs the package {package}: pip install 'geoimp-drake\[robots\]'"
    refused(ConfigurationError, match, RosArm().write(tmp_path), tmp_path, cache=None)


def _hide(monkeypatch, package):
    real = builtins.__import__

    def no_package(name, *args, **kwargs):
        if name == package:
            raise ModuleNotFoundError(name, name=name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", no_package)


def test_cache_that_cannot_be_written(tmp_path):
    file = RosArm().write(tmp_path)
    (tmp_path / "cache").write_text("a file")
    refused(ConfigurationError, r"converted mesh .* cannot be written: .*cache=", file, tmp_path)


def test_plants_that_take_no_robot(tmp_path):
    file = RosArm().write(tmp_path)
    plant = MultibodyPlant(1e-3)
    plant.AddModelInstance("robot")
    refused(ModelError, "model instance 'robot' already", file, tmp_path, plant=plant)
    W = plant.world_frame()
    plant.AddForceElement(
        LinearBushingRollPitchYaw(W, W, np.ones(3), np.ones(3), np.ones(3), np.ones(3))
    )
    refused(ModelError, "1 force elements beside", file, tmp_path, plant=plant, name="other")
    plant.Finalize()
    refused(ModelError, "is finalized", file, tmp_path, plant=plant)


def test_unknown_way_with_geometry(tmp_path):
    match = "geometry 'left-out'. Did you mean 'leave-out'"
    refused(ConfigurationError, match, "arm.urdf", tmp_path, geometry="left-out")


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"file": ""}, "robot.file is empty"),
        ({"end_effector": ""}, "robot.end_effector is empty"),
        ({"geometry": "none"}, "robot.geometry"),
        ({"inertia": "mend"}, "robot.inertia"),
        ({"base_position": np.zeros(2)}, "robot.base_position"),
        ({"offset_attitude_deg": np.array([0.0, np.nan, 0.0])}, "robot.offset_attitude_deg"),
    ],
)
def test_configuration_names_the_field(change, match):
    config = RobotConfig(file="arm.urdf", end_effector="tool0")
    check(config, "robot")
    for name, value in change.items():
        setattr(config, name, value)
    with pytest.raises(ConfigurationError, match=match):
        check(config, "robot")


def test_what_drake_would_abort_on_is_an_error_with_the_file():
    """A body that says that it has no mass, for example, if it is left as it is."""
    file = CASES / "mjcf_massless_hand.xml"
    with pytest.raises(ConfigurationError, match=r"read .*mjcf_massless_hand\.xml: .*mass > 0"):
        parse(read_description(file), MultibodyPlant(1e-3), {})
    refused(
        ModelError, "1 joints between the world and frame 'hand'", file, Path(), end_effector="hand"
    )
