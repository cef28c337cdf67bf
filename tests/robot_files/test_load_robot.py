"""Robots as they are published become arms ready for impedance, and what was done is said."""

import logging
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from published_arms import EFFORTS, LINKS, RosArm, inertial_urdf, write_mjcf, write_sdf
from pydrake.geometry import Role
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

import geoimp_drake
from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ModelError
from geoimp_drake.robot_files.config import RobotConfig
from geoimp_drake.robot_files.loading import LoadedRobot, load_robot

X_WB = RigidTransform(RollPitchYaw(0.2, -0.1, 0.7), [0.3, -0.5, 0.2])


def loaded(file: Path, folder: Path, **options) -> tuple[MultibodyPlant, LoadedRobot]:
    plant = MultibodyPlant(1e-3)
    options = {"end_effector": "tool0", "cache": folder / "cache", **options}
    robot = load_robot(file, plant, **options)
    plant.Finalize()
    return plant, robot


def model_of(plant: MultibodyPlant, robot: LoadedRobot) -> ControlModel:
    return ControlModel.of_arm(plant, robot.model_instance, robot.end_effector_frame)


def test_joints_without_transmissions_get_actuators_with_the_files_efforts(tmp_path):
    model = model_of(*loaded(RosArm().write(tmp_path), tmp_path))
    assert model.joint_names == tuple(f"joint_{k}" for k in range(1, 7))
    np.testing.assert_array_equal(model.effort_limits, EFFORTS)


def test_an_effort_of_zero_or_none_is_no_limit_and_is_told(tmp_path):
    limits = {2: '<limit effort="0" lower="-1" upper="1" velocity="0"/>', 5: ""}
    plant, robot = loaded(RosArm(limits=limits).write(tmp_path), tmp_path)
    model = model_of(plant, robot)
    assert list(np.isinf(model.effort_limits)) == [False, True, False, False, True, False]
    assert list(np.isinf(model.plant.GetPositionUpperLimits())) == [False] * 4 + [True, False]
    assert "no effort limit known: joint_2, joint_5" in robot.changes


def test_transmissions_of_the_file_are_kept(tmp_path):
    motor = """<transmission><type>transmission_interface/SimpleTransmission</type>
        <joint name="joint_3"/><actuator name="m3"><drake:gear_ratio value="80"/>
        </actuator></transmission>"""
    plant, robot = loaded(RosArm(extra=motor).write(tmp_path), tmp_path)
    motor = plant.GetJointActuatorByName("m3")
    assert (motor.effort_limit(), motor.default_gear_ratio()) == (EFFORTS[2], 80.0)
    assert "actuators added: joint_1, joint_2, joint_4, joint_5, joint_6" in robot.changes


def test_fixed_joints_in_a_chain_carry_the_sensor_at_the_first_or_where_it_is_named(tmp_path):
    file = RosArm().write(tmp_path)
    _, robot = loaded(file, tmp_path)
    assert robot.sensor_joint.name() == "to_flange"
    _, robot = loaded(file, tmp_path, sensor_joint="to_tool0")
    assert robot.sensor_joint.name() == "to_tool0"


def test_without_a_fixed_joint_the_last_link_is_cut_off_and_nothing_moves_differently(tmp_path):
    motor = """<transmission><type>transmission_interface/SimpleTransmission</type>
        <joint name="joint_6"/><actuator name="m6"><drake:rotor_inertia value="1e-4"/>
        <drake:gear_ratio value="80"/></actuator></transmission>"""
    file = RosArm(tool=False, extra=motor).write(tmp_path)
    plant, robot = loaded(file, tmp_path, end_effector="link_6", base_pose=X_WB)
    weld = robot.sensor_joint
    assert (weld.name(), weld.child_body().name()) == ("wrist_sensor", "link_6")
    # The same arm with a tool, whose E is put back by an offset.
    X_FE = RigidTransform([-0.07, 0.0, 0.0])
    whole = RosArm(inertial={"flange": ""}, extra=motor).write(tmp_path / "whole")
    other = model_of(*loaded(whole, tmp_path, base_pose=X_WB, offset=X_FE))
    model = model_of(plant, robot)
    q = np.array([0.4, 0.3, 0.9, 0.5, -0.9, 0.3])
    for a, b in zip(_motion(model, q), _motion(other, q), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-12)
    np.testing.assert_array_equal(model.effort_limits, EFFORTS)


def _motion(model: ControlModel, q: np.ndarray):
    context = model.plant.CreateDefaultContext()
    model.plant.SetPositions(context, q)
    yield model.end_effector.CalcPoseInWorld(context).GetAsMatrix4()
    yield model.plant.CalcMassMatrix(context)
    yield model.plant.GetPositionLowerLimits()


def test_fingers_are_locked_within_their_limits_mimic_or_not(tmp_path):
    plant, robot = loaded(RosArm(gripper=True).write(tmp_path), tmp_path)
    assert plant.num_positions() == 6
    context = plant.CreateDefaultContext()
    fingers = [plant.GetFrameByName(f"finger{side}") for side in (1, -1)]
    flange = plant.GetFrameByName("flange")
    places = [finger.CalcPose(context, flange).translation() for finger in fingers]
    np.testing.assert_allclose(places, [[0.05, 0.01, 0.0], [0.05, -0.01, 0.0]], atol=1e-12)
    assert any("finger_joint at 0.01, finger_joint_mimic at 0.01" in c for c in robot.changes)


def test_base_is_welded_where_it_is_told_whether_the_file_has_a_world_or_not(tmp_path):
    world = """<link name="world"/><joint name="stand" type="fixed"><parent link="world"/>
        <child link="base_link"/><origin xyz="0 0 0.5"/></joint>"""
    for k, (extra, height) in enumerate((("", 0.0), (world, 0.5))):
        file = RosArm(extra=extra).write(tmp_path / str(k))
        plant, _ = loaded(file, tmp_path, base_pose=X_WB)
        base = plant.GetFrameByName("base_link").CalcPoseInWorld(plant.CreateDefaultContext())
        expected = X_WB @ RigidTransform([0.0, 0.0, height])
        np.testing.assert_allclose(base.GetAsMatrix4(), expected.GetAsMatrix4(), atol=1e-12)


def test_base_pose_moves_a_moving_first_joint_too(tmp_path):
    """A gantry's first joint is on the world itself."""
    file = RosArm().write(tmp_path)
    file.write_text(file.read_text().replace('"base_link"', '"world"'))
    poses = []
    for pose in (RigidTransform(), X_WB):
        plant, robot = loaded(file, tmp_path, base_pose=pose, geometry="leave-out")
        poses.append(robot.end_effector_frame.CalcPoseInWorld(plant.CreateDefaultContext()))
    np.testing.assert_allclose(
        poses[1].GetAsMatrix4(), (X_WB @ poses[0]).GetAsMatrix4(), atol=1e-12
    )


def with_geometry(file: Path, folder: Path, **options):
    """Returns what shapes the plant's scene graph then has: bounds of its meshes by role."""
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
    options = {"end_effector": "tool0", "cache": folder / "cache", **options}
    load_robot(file, plant, **options)
    inspector = scene_graph.model_inspector()
    return {
        role: [inspector.GetShape(g) for g in inspector.GetAllGeometryIds(role)]
        for role in (Role.kIllustration, Role.kProximity)
    }


def test_meshes_that_drake_does_not_read_are_converted_once_in_metres(tmp_path):
    file = RosArm().write(tmp_path)
    shapes = with_geometry(file, tmp_path)
    visual, collision = (shapes[role] for role in (Role.kIllustration, Role.kProximity))
    assert (len(visual), len(collision)) == (7, 7)
    for shape, size in ((visual[0], 1e-3), (collision[0], 0.1)):
        assert Path(shape.source().path()).suffix == ".obj"
        hull = shape.GetConvexHull()
        corners = np.array([hull.vertex(i) for i in range(hull.num_vertices())])
        np.testing.assert_allclose(np.ptp(corners, axis=0), size, rtol=1e-6)
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "cache").iterdir()}
    assert len(kept) == 2
    with_geometry(file, tmp_path)
    assert {p: p.stat().st_mtime_ns for p in (tmp_path / "cache").iterdir()} == kept


def test_geometry_left_out_needs_no_meshes_and_leaves_the_inertia(tmp_path):
    for name, write in (("urdf", RosArm().write), ("sdf", write_sdf), ("xml", write_mjcf)):
        folder = tmp_path / name
        folder.mkdir()
        file, end = write(folder), "tool0" if name == "urdf" else "tcp"
        whole, robot = loaded(file, tmp_path, end_effector=end)
        model = model_of(whole, robot).plant
        M = model.CalcMassMatrix(model.CreateDefaultContext())
        for mesh in [*folder.rglob("*.stl"), *folder.rglob("*.STL"), *folder.rglob("*.dae")]:
            mesh.unlink()
        bare, robot = loaded(file, tmp_path, end_effector=end, geometry="leave-out")
        assert "geometry left out" in robot.changes
        model = model_of(bare, robot).plant
        np.testing.assert_array_equal(model.CalcMassMatrix(model.CreateDefaultContext()), M)
        shapes = with_geometry(file, tmp_path, end_effector=end, geometry="leave-out")
        assert not any(shapes.values())


def test_geometry_kept_is_drakes_own_affair(tmp_path):
    box = '<box size="0.1 0.1 0.1"/>'
    file = RosArm(visual=box, collision=box).write(tmp_path)
    shapes = with_geometry(file, tmp_path, geometry="keep")
    assert [len(found) for found in shapes.values()] == [7, 7]


def test_packages_are_found_above_beside_in_the_environment_or_where_told(tmp_path, monkeypatch):
    file = RosArm().write(tmp_path)
    package = file.parents[1]
    alone = tmp_path / "alone" / "deep" / "arm.urdf"
    alone.parent.mkdir(parents=True)
    alone.write_text(file.read_text())
    loaded(alone, tmp_path, packages={"small_arm": package})
    beside = package.rename(package.parent / "small_arm")
    neighbour = package.parent / "cell" / "urdf" / "arm.urdf"
    neighbour.parent.mkdir(parents=True)
    neighbour.write_text(alone.read_text())
    loaded(neighbour, tmp_path)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(beside.parent))
    loaded(alone, tmp_path)


def test_links_that_move_without_mass_are_estimated_from_their_shapes(tmp_path):
    box = '<box size="0.1 0.2 0.3"/>'
    zero = inertial_urdf(0.0)
    file = RosArm(
        inertial={"link_2": "", "link_6": zero, "flange": ""}, visual=box, collision=box
    ).write(tmp_path)
    shifted = file.read_text().replace("<collision>", '<collision><origin xyz="0.1 0 0"/>')
    file.write_text(shifted)
    plant, robot = loaded(file, tmp_path)
    assert any("link_2 6 kg, link_6 6 kg" in change for change in robot.changes)
    M = plant.GetBodyByName("link_2").default_spatial_inertia()
    np.testing.assert_allclose(M.get_com(), [0.1, 0.0, 0.0], atol=1e-9)
    about_origin = 6.0 / 12.0 * np.array([0.13, 0.10, 0.05]) + 6.0 * np.array([0.0, 0.01, 0.01])
    I = M.CalcRotationalInertia().CopyToFullMatrix3()  # noqa: E741  (the inertia's own letter)
    np.testing.assert_allclose(I, np.diag(about_origin), atol=1e-8)
    # Frames that are merely fixed to something with a mass stay without.
    assert plant.GetBodyByName("tool0").default_mass() == 0.0


# Which of the last three joints have an effort limit.
LAST_LIMITS = {write_sdf: [False, False, True], write_mjcf: [True, False, False]}


@pytest.mark.parametrize("write", [write_sdf, write_mjcf])
def test_sdf_and_mjcf_give_the_same_arm_as_the_urdf(tmp_path, write):
    (tmp_path / "other").mkdir()
    plant, robot = loaded(write(tmp_path / "other"), tmp_path, end_effector="tcp", base_pose=X_WB)
    model = model_of(plant, robot)
    urdf = RosArm(tool=False, inertial={}).write(tmp_path)
    tcp = RigidTransform([0.07, 0.0, 0.0])
    options = {"end_effector": "link_6", "offset": tcp, "base_pose": X_WB}
    expected = model_of(*loaded(urdf, tmp_path, **options))
    q = np.array([0.4, 0.3, 0.9, 0.5, -0.9, 0.3])
    (X, M, low), (X_expected, M_expected, low_expected) = _motion(model, q), _motion(expected, q)
    np.testing.assert_allclose(X[:3, 3], X_expected[:3, 3], atol=1e-9)
    np.testing.assert_allclose(low, low_expected)
    fingers = 0.0 if write is write_sdf else 0.1
    assert np.abs(M - M_expected).max() < 0.5 * fingers + 1e-9
    known = np.isfinite(model.effort_limits)
    assert list(known) == [True] * 3 + LAST_LIMITS[write]
    np.testing.assert_array_equal(model.effort_limits[known], np.array(EFFORTS)[known])


def test_mjcf_servos_become_torques_sites_frames_and_coupled_joints_locked(tmp_path):
    plant, robot = loaded(write_mjcf(tmp_path), tmp_path, end_effector="tcp")
    assert plant.num_positions() == 6
    motor = plant.GetJointActuatorByName("joint_4")
    assert (motor.effort_limit(), motor.has_controller()) == (64.0, False)
    X_BS = robot.end_effector_frame.GetFixedPoseInBodyFrame()
    np.testing.assert_allclose(X_BS.rotation().col(2), [1.0, 0.0, 0.0], atol=1e-7)
    assert "servos replaced by torque actuators: joint_4" in robot.changes
    assert "joints beside the arm locked: slide1, slide-1" in robot.changes
    assert "no effort limit known: joint_5, joint_6" in robot.changes


def test_one_line_says_what_was_done(tmp_path, caplog):
    file = RosArm(gripper=True).write(tmp_path)
    with caplog.at_level(logging.INFO, logger="drake"):
        _, robot = loaded(file, tmp_path, name="left")
    said = [record.getMessage() for record in caplog.records if "left" in record.getMessage()]
    assert said == [f"Robot 'left' from arm.urdf: {'; '.join(robot.changes)}."]
    assert "2 meshes converted (DAE, STL)" in said[0]


def test_two_of_the_same_robot_stand_in_one_plant(tmp_path):
    file, plant = RosArm().write(tmp_path), MultibodyPlant(1e-3)
    for name in ("left", "right"):
        load_robot(file, plant, end_effector="tool0", name=name, cache=tmp_path / "cache")
    plant.Finalize()
    names = [plant.GetModelInstanceName(body.model_instance()) for body in _bodies(plant)]
    assert {name: names.count(name) for name in ("left", "right")} == {"left": 9, "right": 9}


def _bodies(plant: MultibodyPlant):
    return [plant.GetBodyByName(n, plant.GetModelInstanceByName(i))
            for i in ("left", "right") for n in (*LINKS, "flange", "tool0")]  # fmt: skip


def test_a_robot_that_cannot_be_used_leaves_the_plant_as_it_was(tmp_path):
    plant = MultibodyPlant(1e-3)
    before = plant.num_model_instances(), plant.num_bodies(), plant.num_frames()
    with pytest.raises(ModelError):
        load_robot(RosArm(joints=5).write(tmp_path), plant, end_effector="tool0", cache=tmp_path)
    assert (plant.num_model_instances(), plant.num_bodies(), plant.num_frames()) == before


def test_configuration_reads_paths_from_its_own_folder(tmp_path, monkeypatch):
    file = RosArm().write(tmp_path / "robots")
    moved = tmp_path / "arm.urdf"
    moved.write_text(file.read_text())
    config = RobotConfig(
        file="arm.urdf",
        end_effector="tool0",
        packages={"small_arm": str(file.parents[1].relative_to(tmp_path))},
        offset_position=np.array([0.0, 0.0, 0.1]),
        base_position=X_WB.translation(),
        base_attitude_deg=np.rad2deg([0.2, 0.0, 0.0]),
    )
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    plant = MultibodyPlant(1e-3)
    robot = config.load(plant, "mine", tmp_path)
    plant.Finalize()
    assert plant.GetModelInstanceName(robot.model_instance) == "mine"
    E, context = robot.end_effector_frame, plant.CreateDefaultContext()
    X_FE = E.CalcPose(context, plant.GetFrameByName("tool0"))
    np.testing.assert_allclose(X_FE.translation(), [0.0, 0.0, 0.1], atol=1e-12)
    # Looks only: the mesh for collision is not needed.
    assert len(list((tmp_path / "cache" / "geoimp_drake" / "meshes").iterdir())) == 1
    base = plant.GetFrameByName("base_link").CalcPoseInWorld(context)
    expected = RigidTransform(RollPitchYaw(0.2, 0.0, 0.0), X_WB.translation())
    np.testing.assert_allclose(base.GetAsMatrix4(), expected.GetAsMatrix4(), atol=1e-12)


def test_load_robot_is_public_and_imported_only_when_asked_for():
    assert geoimp_drake.load_robot is load_robot
    code = "import geoimp_drake, sys; print([m for m in sys.modules if 'robot_files' in m])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    with pytest.raises(AttributeError, match="load_robots"):
        geoimp_drake.load_robots  # noqa: B018  (the look-up is what raises)
