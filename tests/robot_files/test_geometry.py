"""A robot's shapes: for looks only, with their colours, each mesh converted once."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from published_arms import (
    RosArm,
    inertial_urdf,
    painted_dae,
    stl,
    write_mjcf,
    write_sdf,
)
from pydrake.geometry import Role, SceneGraph
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from geoimp_drake.robot_files.loading import load_robot
from geoimp_drake.robot_files.meshes import convert_mesh

CASES = Path(__file__).parent / "cases"


def loaded(file: Path, folder: Path, **options) -> tuple[MultibodyPlant, SceneGraph]:
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
    options = {"end_effector": "tool0", "geometry": "visual", "cache": folder / "cache", **options}
    load_robot(file, plant, **options)
    plant.Finalize()
    return plant, scene_graph


def links_with(plant: MultibodyPlant, scene_graph: SceneGraph, role: Role) -> list[str]:
    inspector = scene_graph.model_inspector()
    frames = (inspector.GetFrameId(shape) for shape in inspector.GetAllGeometryIds(role))
    return sorted(plant.GetBodyFromFrameId(frame).name() for frame in frames)


LINKS = ["base_link", *(f"link_{k}" for k in range(1, 7))]


def test_looks_only_leaves_no_collision(tmp_path):
    """A mesh for collision alone need not even be there."""
    file = RosArm().write(tmp_path)
    (file.parents[1] / "meshes" / "shell.STL").unlink()
    shown = loaded(file, tmp_path)
    assert links_with(*shown, Role.kIllustration) == LINKS
    assert links_with(*shown, Role.kProximity) == []


def test_links_that_have_shapes_for_collision_alone_are_seen_by_those(tmp_path):
    spheres = loaded(CASES / "spheres.urdf", tmp_path, end_effector="l6")
    assert links_with(*spheres, Role.kIllustration) == [f"l{k}" for k in range(1, 7)]
    sdf = loaded(write_sdf(tmp_path), tmp_path, end_effector="tcp")
    assert links_with(*sdf, Role.kIllustration) == LINKS
    for shown in (spheres, sdf):
        assert links_with(*shown, Role.kProximity) == []


def test_bodies_of_an_mjcf_show_what_mujoco_shows_or_else_what_collides(tmp_path):
    file = write_mjcf(tmp_path)
    text = file.read_text()
    geom = '<geom type="mesh" mesh="shell" contype="0" conaffinity="0"/>'
    both = '<geom class="seen" size="0.02"/><geom class="felt" size="0.03"/>'
    assert text.count(geom) == 6
    text = text.replace(geom, both, 2).replace(geom, '<geom class="felt" size="0.03"/>', 1)
    classes = """<default><default class="seen"><geom group="2" contype="0" conaffinity="0"/>
        </default><default class="felt"><geom group="3"/></default></default><worldbody>"""
    floor = '<geom type="plane" size="1 1 0.1"/>'
    file.write_text(text.replace("<worldbody>", classes + floor, 1))
    shown = loaded(file, tmp_path, end_effector="tcp")
    assert links_with(*shown, Role.kIllustration) == [*LINKS[1:], "world"]
    assert links_with(*shown, Role.kProximity) == []
    felt = loaded(file, tmp_path, end_effector="tcp", geometry="convert")
    assert links_with(*felt, Role.kProximity) == [*LINKS[1:4], "world"]


def test_looks_only_changes_no_mass(tmp_path):
    """Links without mass have that of their shapes of collision, whatever is done with these."""
    file = RosArm(
        inertial={"link_2": "", "link_6": inertial_urdf(0.0), "flange": ""},
        visual='<box size="0.1 0.1 0.1"/>',
        collision='<box size="0.1 0.2 0.3"/>',
    ).write(tmp_path)
    plant, scene_graph = loaded(file, tmp_path)
    assert plant.GetBodyByName("link_2").default_mass() == pytest.approx(6.0)
    assert links_with(plant, scene_graph, Role.kProximity) == []


def diffuse(obj: Path) -> list[list[float]]:
    lines = (obj.parent / "mesh.mtl").read_text().splitlines()
    return [[float(x) for x in line.split()[1:]] for line in lines if line.startswith("Kd ")]


def test_a_mesh_keeps_its_materials(tmp_path):
    mesh = tmp_path / "shell.dae"
    mesh.write_text(painted_dae(("1 0 0", "0 0 0.5")))
    obj = convert_mesh(mesh, tmp_path / "cache")
    np.testing.assert_allclose(diffuse(obj), [[1, 0, 0], [0, 0, 0.5]], atol=0.01)
    text = obj.read_text()
    assert [text.count(word) for word in ("usemtl", "mtllib mesh.mtl", "\no ")] == [2, 1, 0]


def test_a_mesh_with_a_broken_material_is_whole_and_without_colours(tmp_path, caplog):
    mesh = tmp_path / "shell.dae"
    mesh.write_text(
        painted_dae(("1 0 0", "0 0 0.5")).replace('<effect id="e1">', '<effect id="e7">')
    )
    obj = convert_mesh(mesh, tmp_path / "cache")
    assert obj.read_text().count("\nf ") == 4
    assert not (obj.parent / "mesh.mtl").exists()
    assert "shell.dae is shown without its materials: Effect not found: #e1." in caplog.text


def test_a_mesh_keeps_colours_of_vertices_and_textures(tmp_path):
    box = trimesh.creation.box((0.1, 0.2, 0.3))
    box.visual.vertex_colors = [10, 200, 30, 255]
    box.export(tmp_path / "box.ply")
    obj = convert_mesh(tmp_path / "box.ply", tmp_path / "cache")
    np.testing.assert_allclose(diffuse(obj), np.array([[10, 200, 30]]) / 255, atol=1e-6)
    image = pytest.importorskip("PIL.Image").new("RGB", (4, 4), (255, 0, 0))
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=image)
    box.visual = trimesh.visual.TextureVisuals(uv=np.zeros((8, 2)), material=material)
    box.export(tmp_path / "box.glb")
    obj = convert_mesh(tmp_path / "box.glb", tmp_path / "cache")
    picture = (obj.parent / "mesh.mtl").read_text().partition("map_Kd ")[2].split()[0]
    assert diffuse(obj) == [[1, 1, 1]]
    assert (obj.parent / picture).is_file()


def urdf_with_colour(folder: Path) -> Path:
    mesh = '<mesh filename="package://small_arm/meshes/shell.STL"/>'
    file = RosArm(visual=mesh).write(folder)
    shape = f"<visual><geometry>{mesh}</geometry>"
    material = '<material name="orange"><color rgba="1 0.5 0 1"/></material>'
    file.write_text(file.read_text().replace(shape, shape + material))
    return file


def sdf_with_colour(folder: Path) -> Path:
    file = write_sdf(folder)
    shape = """<visual name="v"><geometry><mesh><uri>shell.stl</uri></mesh></geometry>
        <material><diffuse>1 0.5 0 1</diffuse></material></visual><collision name="c">"""
    file.write_text(file.read_text().replace('<collision name="c">', shape))
    return file


def mjcf_with_colour(folder: Path) -> Path:
    file = write_mjcf(folder)
    text = file.read_text().replace('mesh="shell"', 'mesh="shell" material="orange"')
    material = '<asset><material name="orange" rgba="1 0.5 0 1"/>'
    file.write_text(text.replace("<asset>", material))
    return file


@pytest.mark.parametrize("write", [urdf_with_colour, sdf_with_colour, mjcf_with_colour])
def test_a_colour_of_the_description_is_that_of_a_mesh_without_one(tmp_path, write):
    end = "tool0" if write is urdf_with_colour else "tcp"
    _, scene_graph = loaded(write(tmp_path), tmp_path, end_effector=end)
    inspector = scene_graph.model_inspector()
    shapes = inspector.GetAllGeometryIds(Role.kIllustration)
    assert len(shapes) >= 6
    for shape in shapes:
        colour = inspector.GetIllustrationProperties(shape).GetProperty("phong", "diffuse")
        assert (colour.r(), colour.g(), colour.b()) == (1.0, 0.5, 0.0)
        obj = Path(inspector.GetShape(shape).source().path())
        assert not (obj.parent / "mesh.mtl").exists()


def test_a_mesh_is_converted_once_for_looks_collision_and_other_robots(tmp_path, monkeypatch):
    read = []
    load_scene = trimesh.load_scene
    monkeypatch.setattr(
        trimesh, "load_scene", lambda mesh: (read.append(mesh), load_scene(mesh))[1]
    )
    mesh = '<mesh filename="package://small_arm/meshes/shell.STL"/>'
    file = RosArm(visual=mesh, collision=mesh).write(tmp_path)
    other = RosArm(visual=mesh, collision=mesh).write(tmp_path / "other")
    assert (other.parents[1] / "meshes" / "shell.STL").read_text() == stl()
    for robot in (file, other):
        plant, scene_graph = loaded(robot, tmp_path, geometry="convert")
        assert len(links_with(plant, scene_graph, Role.kProximity)) == 7
    assert len(read) == 1
