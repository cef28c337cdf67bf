"""Published files that Drake's parser refuses, or would read as something else, are read."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from published_arms import LINKS, RosArm, inertial_urdf, write_dual_urdf, write_mjcf, write_sdf
from pydrake.geometry import Role
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import PlanarJoint
from pydrake.systems.framework import DiagramBuilder

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ConfigurationError, ModelError
from geoimp_drake.robot_files.config import RobotConfig
from geoimp_drake.robot_files.loading import load_robot

CASES = Path(__file__).parent / "cases"
BOX = '<box size="0.1 0.2 0.3"/>'


def loaded(file, end_effector="tool0", **options):
    plant = MultibodyPlant(1e-3)
    robot = load_robot(file, plant, end_effector=end_effector, geometry="leave-out", **options)
    plant.Finalize()
    return plant, robot


def test_an_inertia_on_the_way_of_any_of_several_arms_is_refused(tmp_path):
    text = write_dual_urdf(tmp_path).read_text()
    old = 'izz="0.027"'
    for k, place in enumerate((text.index(old), text.rindex(old))):
        file = tmp_path / f"{k}.urdf"
        file.write_text(f'{text[:place]}izz="0.127"{text[place + len(old) :]}')
        with pytest.raises(ModelError, match=r"link_1' has mass 9 kg .* no body can have"):
            load_robot(
                file,
                MultibodyPlant(1e-3),
                end_effectors=["left_tool0", "right_tool0"],
                geometry="leave-out",
            )


def moments_of(plant, link):
    body = plant.GetBodyByName(link)
    M_BBo_B = body.default_spatial_inertia()
    I_Bcm = M_BBo_B.Shift(M_BBo_B.get_com()).CalcRotationalInertia()  # about the centre of mass
    assert I_Bcm.CouldBePhysicallyValid()
    return I_Bcm.CopyToFullMatrix3()


# Inertias


def test_an_inertia_off_by_rounding_becomes_the_nearest(tmp_path):
    inertial = inertial_urdf(2.0, 0.1, 0.1, 0.2018)
    plant, robot = loaded(RosArm(inertial={"link_3": inertial}).write(tmp_path))
    assert "inertias replaced by the nearest of a body: link_3 (0.89% off)" in robot.changes
    # Σ = diag(0.1009, 0.1009, -0.0009), and without what is negative:
    np.testing.assert_allclose(
        moments_of(plant, "link_3"), np.diag([0.1009, 0.1009, 0.2018]), atol=1e-12
    )


@pytest.mark.parametrize("write", [RosArm().write, write_sdf, write_mjcf])
def test_on_the_arms_way_more_than_rounding_is_refused_unless_repair_is_asked_for(tmp_path, write):
    file = write(tmp_path)
    end = "tool0" if file.suffix == ".urdf" else "tcp"
    old = {
        ".urdf": 'ixx="0.036000000000000004" iyy="0.045" izz="0.027"',
        ".sdf": "<ixx>0.036000000000000004</ixx><iyy>0.045</iyy><izz>0.027</izz>",
        ".xml": "0.036000000000000004 0.045 0.027",
    }[file.suffix]
    text = file.read_text()
    assert text.count(old) == 1  # link_1
    file.write_text(text.replace(old, old.replace("0.027", "0.127")))
    line = text[: text.index(old)].count("\n") + 1
    match = rf"{file.name}:\d+: Link 'link_1'.*izz 0\.127.*inertia 'repair'"
    with pytest.raises(ModelError, match=match) as raised:
        loaded(file, end)
    assert abs(int(str(raised.value).split(":")[1]) - line) <= 1
    plant, robot = loaded(file, end, inertia="repair")
    # Σ = (0.068, 0.059, -0.023), and without what is negative:
    np.testing.assert_allclose(
        moments_of(plant, "link_1"), np.diag([0.059, 0.068, 0.127]), atol=1e-12
    )
    assert "inertias replaced by the nearest of a body: link_1 (36.22% off)" in robot.changes


def test_a_scenario_may_ask_for_repair_and_inertia_without_mass_is_that_of_shapes(
    tmp_path,
):
    inertial = inertial_urdf(0.0, 0.1, 0.1, 0.1)
    arm = RosArm(inertial={"link_3": inertial}, visual=BOX, collision=BOX)
    config = RobotConfig(file=str(arm.write(tmp_path)), end_effector="tool0", geometry="leave-out")
    with pytest.raises(ModelError, match=r"'link_3'.*without mass there is no inertia"):
        config.load(MultibodyPlant(1e-3))
    config.inertia, plant = "repair", MultibodyPlant(1e-3)
    config.load(plant)
    assert plant.GetBodyByName("link_3").default_mass() == pytest.approx(6.0)


def test_the_nearest_inertia_is_physical_however_it_is_turned(tmp_path):
    numbers = np.random.default_rng(3)
    for k in range(20):
        A = numbers.normal(size=(3, 3))
        xx, yy, zz, xy, xz, yz = (A + A.T)[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        inertial = (
            f'<inertial><origin rpy="0.3 {k} 1"/><mass value="2"/><inertia ixx="{xx}" iyy="{yy}" '
            f'izz="{zz}" ixy="{xy}" ixz="{xz}" iyz="{yz}"/></inertial>'
        )
        file = RosArm(inertial={"link_3": inertial}).write(tmp_path / str(k))
        plant, _ = loaded(file, inertia="repair")
        assert plant.GetBodyByName("link_3").default_mass() == 2.0
        assert np.linalg.eigvalsh(moments_of(plant, "link_3"))[0] > -1e-12


BESIDE = """<link name="antenna">{inertial}</link><joint name="glued" type="fixed">
    <parent link="link_4"/><child link="antenna"/></joint>"""


@pytest.mark.parametrize("moments", [(0.1, 0.1, 0.9), (-0.1, 0.1, 0.1), (-0.1, -0.1, -0.1)])
def test_beside_the_arm_an_inertia_is_repaired_however_far_off_it_is(tmp_path, moments):
    arm = RosArm(extra=BESIDE.format(inertial=inertial_urdf(0.1, *moments)))
    plant, robot = loaded(arm.write(tmp_path))
    assert any(change.startswith("inertias replaced") for change in robot.changes)
    assert plant.GetBodyByName("antenna").default_mass() == 0.1
    moments_of(plant, "antenna")


def test_a_base_that_stands_still_may_have_any_inertia(tmp_path):
    """It does not matter; also if it has no mass, as mass0_base.urdf."""
    for k, inertial in enumerate((inertial_urdf(0.0, 0.1, 0.1, 0.1), inertial_urdf(1.0, 0, 0, 1))):
        plant, robot = loaded(RosArm(inertial={"base_link": inertial}).write(tmp_path / str(k)))
        assert any("base_link" in change for change in robot.changes)
        assert plant.GetBodyByName("base_link").default_mass() == k


def test_a_hand_without_mass_in_an_mjcf_is_none(tmp_path):
    """Drake would end the process, see mjcf_massless_hand.xml."""
    file = write_mjcf(tmp_path)
    inertial = '<inertial pos="0 0 0" mass="0" diaginertia="0 0 0"/><geom size=".1"/>'
    hand = f'<body name="hand">{inertial}</body>'
    file.write_text(file.read_text().replace("<site", f"{hand}<site"))
    for geometry in ("leave-out", "convert"):
        plant = MultibodyPlant(1e-3)
        load_robot(file, plant, end_effector="hand", geometry=geometry, cache=tmp_path / "cache")
        assert plant.GetBodyByName("hand").default_mass() == 0.0


def test_without_geometry_links_keep_the_inertia_of_their_shapes(tmp_path):
    """Estimated in a URDF, Drake's in an MJCF; and nothing of the shapes stays."""
    arm = RosArm(inertial={"link_2": ""}, visual=BOX, collision=BOX)
    plant, robot = loaded(arm.write(tmp_path))
    assert plant.GetBodyByName("link_2").default_mass() == pytest.approx(6.0)
    assert any("link_2 6 kg" in change for change in robot.changes)
    assert plant.GetBodyByName("link_2").default_spatial_inertia().get_com() == pytest.approx(0)

    file = write_mjcf(tmp_path)
    text = file.read_text()
    first = text.index("<inertial", text.index('name="link_2"'))
    file.write_text(text[:first] + text[text.index("<joint", first) :])
    raw = MultibodyPlant(1e-3)
    whole = load_robot(file, raw, end_effector="tcp", cache=tmp_path / "cache")
    expected = raw.GetBodyByName("link_2", whole.model_instance).default_spatial_inertia()
    assert expected.get_mass() == pytest.approx(1000.0 / 6e3)  # a tetrahedron of 0.1 m
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
    load_robot(file, plant, end_effector="tcp", geometry="leave-out", cache=tmp_path / "cache")
    found = plant.GetBodyByName("link_2").default_spatial_inertia()
    np.testing.assert_allclose(found.CopyToFullMatrix6(), expected.CopyToFullMatrix6(), atol=1e-12)
    assert not scene_graph.model_inspector().GetAllGeometryIds(Role.kProximity)
    assert not scene_graph.model_inspector().GetAllGeometryIds(Role.kIllustration)


# Names, colours and addresses


@pytest.mark.parametrize("write", [RosArm().write, write_sdf, write_mjcf])
def test_a_robot_without_a_name_is_one(tmp_path, write):
    file = write(tmp_path)
    text = file.read_text().replace(' model="small_arm"', "").replace(' name="small_arm"', "")
    file.write_text(text)
    assert "small_arm" not in text.replace("package://small_arm", "")
    loaded(file, "link_6")


def with_shapes(file, folder):
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
    robot = load_robot(file, plant, end_effector="link_6", cache=folder / "cache")
    inspector = scene_graph.model_inspector()

    def look(link):
        (shape,) = plant.GetVisualGeometriesForBody(plant.GetBodyByName(link))
        return inspector.GetIllustrationProperties(shape)

    return robot, look


def test_materials_of_one_name_keep_their_colours_and_may_be_said_later(tmp_path):
    materials = {
        "base_link": '<material name="grey"/>',
        "link_1": '<material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>',
        "link_2": '<material name="grey"><color rgba="0.8 0.8 0.8 1"/></material>',
        "link_3": '<material name="grey"/>',
        "link_4": '<material name="nowhere"/>',
    }
    file = RosArm(visual=BOX, collision=BOX).write(tmp_path)
    parts = file.read_text().split("</geometry></visual>")
    ends = [materials.get(link, "") for link in LINKS]
    text = "".join(f"{p}</geometry>{end}</visual>" for p, end in zip(parts, ends, strict=False))
    file.write_text(text + parts[-1])
    _, look = with_shapes(file, tmp_path)
    shades = [look(link).GetProperty("phong", "diffuse").r() for link in LINKS[:4]]
    assert shades == [0.5, 0.5, 0.8, 0.5]
    assert not look("link_4").HasProperty("phong", "diffuse")


def test_textures_are_found_in_packages_and_missed_without_harm(tmp_path):
    there, gone = "package://small_arm/meshes/t.png", "package://elsewhere/t.png"
    for k, uri in enumerate((there, gone)):
        folder = tmp_path / str(k)
        file = RosArm(visual=BOX, collision=BOX).write(folder)
        (file.parents[1] / "meshes" / "t.png").write_bytes(b"")
        material = f"</geometry><material name='m'><texture filename='{uri}'/></material></visual>"
        file.write_text(file.read_text().replace("</geometry></visual>", material))
        robot, look = with_shapes(file, folder)
        found = look("link_2").HasProperty("phong", "diffuse_map")
        assert found == (uri == there)
        assert (f"textures not found: {gone}" in robot.changes) == (uri == gone)


def test_a_package_goes_by_its_own_name_or_its_folders(tmp_path):
    """As in ws/: its package.xml says foo_description, its addresses say foo."""
    shutil.copytree(CASES / "ws", tmp_path / "ws")
    file = tmp_path / "ws" / "foo" / "urdf" / "r.urdf"
    for name in ("foo", "foo_description"):
        file.write_text(file.read_text().replace("package://foo/", f"package://{name}/"))
        load_robot(file, MultibodyPlant(1e-3), end_effector="l6", cache=tmp_path / "cache")


def test_an_mjcfs_materials_stay(tmp_path):
    file = write_mjcf(tmp_path)
    text = file.read_text().replace("<asset>", '<asset><material name="red" rgba="1 0 0 1"/>')
    file.write_text(text.replace('mesh="shell"', 'mesh="shell" material="red"'))
    _, look = with_shapes(file, tmp_path)
    assert look("link_2").GetProperty("phong", "diffuse").b() == 0.0


# Joints of the base


@pytest.mark.parametrize(
    ("normal", "message"),
    [
        ("0 0 0", "joint 'rail' has the normal 0 0 0"),
        ("0 0 up", "xyz=.*'rail' is '0 0 up'; give a number"),
        ("0 1", "xyz=.*'rail' is '0 1'; give 3 numbers"),
    ],
)
def test_a_normal_of_a_planar_joint_that_is_none_is_refused(normal, message, tmp_path):
    text = (CASES / "planar.urdf").read_text().replace('xyz="0 0 1"', f'xyz="{normal}"', 1)
    (tmp_path / "planar.urdf").write_text(text)
    with pytest.raises(ConfigurationError, match=message):
        loaded(tmp_path / "planar.urdf", "l6")


def test_a_planar_base_is_three_joints_that_move_as_drakes_planar_joint(tmp_path):
    file = CASES / "planar.urdf"
    text = file.read_text().replace('axis xyz="0 0 1"', 'axis xyz="0.3 -0.4 0.8"', 1)
    text = text.replace('type="planar">', 'type="planar"><origin xyz="1 2 3" rpy="0.1 0.2 0.3"/>')
    (tmp_path / "planar.urdf").write_text(text)
    plant, robot = loaded(tmp_path / "planar.urdf", "l6")
    raw = MultibodyPlant(1e-3)
    (instance,) = Parser(raw).AddModelsFromString(text, "urdf")
    raw.WeldFrames(raw.world_frame(), raw.GetFrameByName("floor"))
    raw.Finalize()
    assert isinstance(raw.GetJointByName("rail"), PlanarJoint)
    q = np.array([0.5, -0.3, 0.8, 0.4, 0.3, 0.9, 0.5, -0.9, 0.3])
    found, expected = (_at(p, i, q) for p, i in ((plant, robot.model_instance), (raw, instance)))
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)
    assert "planar joint rail made of rail_x, rail_y, rail_turn" in robot.changes


def _at(plant, instance, q):
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, instance, q)
    yield plant.GetFrameByName("l6").CalcPoseInWorld(context).GetAsMatrix4()
    yield plant.CalcMassMatrix(context)
    yield plant.CalcGravityGeneralizedForces(context)


def test_a_floating_base_is_welded_and_nothing_else_may_float(tmp_path):
    plant, robot = loaded(CASES / "floating.urdf", "l6")
    assert "floating base welded: link base to floor" in robot.changes
    assert plant.num_positions() == 6
    text = (CASES / "floating.urdf").read_text()
    file = tmp_path / "r.urdf"
    file.write_text(text.replace('name="j4" type="revolute"', 'name="j4" type="floating"'))
    with pytest.raises(ConfigurationError, match=r"r\.urdf:1: joint 'j4' floats beyond joint 'j3'"):
        loaded(file, "l6")


def test_an_mjcfs_free_body_is_welded(tmp_path):
    file = write_mjcf(tmp_path)
    text = file.read_text()
    for joint in ("<freejoint/>", '<joint type="free"/>'):
        file.write_text(text.replace('<body name="base_link">', f'<body name="base_link">{joint}'))
        plant, robot = loaded(file, "tcp")
        assert "free bodies welded to the world: base_link" in robot.changes
        assert plant.num_positions() == 6


def test_a_prismatic_base_is_a_joint_of_the_arm(tmp_path):
    text = (CASES / "planar.urdf").read_text()
    limit = '<limit lower="-1" upper="1" effort="900" velocity="1"/>'
    file = tmp_path / "r.urdf"
    file.write_text(text.replace('type="planar">', f'type="prismatic">{limit}'))
    plant, robot = loaded(file, "l6")
    model = ControlModel.of_arm(plant, robot.model_instance, robot.end_effector_frame)
    assert model.joint_names[0] == "rail"
    assert model.effort_limits[0] == 900.0


def test_motors_of_one_name_and_several_of_one_joint_are_one_each(tmp_path):
    plant, _ = loaded(CASES / "twice_motor.urdf", "l6")
    assert plant.num_actuators() == 6
    file = write_mjcf(tmp_path)
    (tmp_path / "motors.xml").write_text(
        '<mujoco><motor name="m" joint="joint_4" ctrlrange="-50 50"/></mujoco>'
    )
    plant, _ = loaded(file, "tcp")
    assert plant.num_actuators() == 6
    assert not any(
        plant.get_joint_actuator(k).has_controller() for k in plant.GetJointActuatorIndices()
    )
