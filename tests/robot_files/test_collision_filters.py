"""Links that do not collide in the file as it stands do not collide after loading."""

from pathlib import Path

import pytest
from pydrake.geometry import SceneGraph, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction, MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from geoimp_drake.robot_files.collision_filters import filter_neighbours
from geoimp_drake.robot_files.loading import load_robot

CASES = Path(__file__).parent / "cases"
AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")


def urdf() -> str:
    """Returns an arm with two fingers, whose links 2 and 5 are filtered explicitly."""
    text = _urdf_link("l0")
    links = [f"l{k}" for k in range(7)]
    joints = list(zip(links, links[1:], AXES, strict=False))
    joints += [("l6", "left", "0 1 0"), ("l6", "right", "0 1 0")]
    for parent, child, axis in joints:
        text += f"""{_urdf_link(child)}<joint name="to_{child}" type="revolute">
            <parent link="{parent}"/><child link="{child}"/><origin xyz="0.05 0 0.05"/>
            <axis xyz="{axis}"/><limit lower="-1" upper="1" effort="9" velocity="1"/></joint>"""
    return f"""<robot name="arm">{text}<drake:collision_filter_group name="chosen">
        <drake:member link="l2"/><drake:member link="l5"/>
        <drake:ignored_collision_filter_group name="chosen"/></drake:collision_filter_group>
        </robot>"""


def _urdf_link(name: str) -> str:
    return f"""<link name="{name}"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1"
        izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry><sphere radius="0.1"/>
        </geometry></collision></link>"""


def sdf() -> str:
    text = _sdf_link("l0", 0.0)
    for k, axis in enumerate(AXES, 1):
        text += f"""{_sdf_link(f"l{k}", 0.1 * k)}<joint name="j{k}" type="revolute">
            <parent>l{k - 1}</parent><child>l{k}</child><axis><xyz>{axis}</xyz></axis></joint>"""
    return f'<sdf version="1.9"><model name="arm">{text}</model></sdf>'


def _sdf_link(name: str, z: float) -> str:
    return f"""<link name="{name}"><pose>0 0 {z} 0 0 0</pose><collision name="c"><geometry>
        <sphere><radius>0.1</radius></sphere></geometry></collision></link>"""


def mjcf() -> str:
    """Returns an arm whose links 2 and 5 are excluded explicitly; the last one has no name."""
    text = ""
    for k in range(6, 0, -1):
        name = f'name="l{k}"' if k < 6 else ""
        place = '<site name="tip"/>' if k == 5 else ""
        text = f"""<body {name} pos="0.05 0 0.05"><joint name="j{k}" axis="{AXES[k - 1]}"/>
            <geom size="0.1"/>{place}{text}</body>"""
    return f"""<mujoco model="arm"><worldbody><body name="l0"><geom size="0.1"/>{text}</body>
        </worldbody><contact><exclude body1="l2" body2="l5"/></contact></mujoco>"""


def candidates(plant: MultibodyPlant, scene_graph: SceneGraph) -> set[frozenset[str]]:
    """Returns the links, in pairs, between which Drake looks for contact."""
    plant.Finalize()
    return links_that_may_touch(plant, scene_graph)


def links_that_may_touch(plant: MultibodyPlant, scene_graph: SceneGraph) -> set[frozenset[str]]:
    inspector = scene_graph.model_inspector()

    def link(geometry) -> str:
        return plant.GetBodyFromFrameId(inspector.GetFrameId(geometry)).name()

    return {frozenset(map(link, pair)) for pair in inspector.GetCollisionCandidates()}


def before_and_after(file: Path, end_effector: str) -> tuple[set, set]:
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
    Parser(plant).AddModels(str(file))
    before = candidates(plant, scene_graph)
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
    load_robot(file, plant, end_effector=end_effector, name="an arm")
    return before, candidates(plant, scene_graph)


@pytest.mark.parametrize(
    ("text", "suffix", "end_effector"),
    [(urdf, "urdf", "l6"), (sdf, "sdf", "l6"), (mjcf, "xml", "body7")],
)
def test_links_are_filtered_as_in_the_file(tmp_path, text, suffix, end_effector):
    """A cut link and its neighbour, two locked fingers, and what the file itself filters."""
    file = tmp_path / f"arm.{suffix}"
    file.write_text(text())
    before, after = before_and_after(file, end_effector)
    assert len(before) > 10
    # Fingers that are locked do not touch each other any more; nothing else is lost or added.
    assert before - after == ({frozenset({"left", "right"})} if suffix == "urdf" else set())
    assert after <= before


def two_arms() -> str:
    """Returns a torso with two arms, each of which ends in its sixth link."""
    one = urdf().partition('<joint name="to_left"')[0].rpartition("<link")[0]
    chain = one.partition("<link")[2]
    right = f"<link{chain}".replace('"l', '"r').replace('"to_l', '"to_r').replace('"r0"', '"l0"')
    return f"{one}{right.partition('</link>')[2]}</robot>"


def test_links_of_two_arms_that_are_cut_are_filtered_as_in_the_file(tmp_path):
    file = tmp_path / "arms.urdf"
    file.write_text(two_arms())
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
    Parser(plant).AddModels(str(file))
    before = candidates(plant, scene_graph)
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
    load_robot(file, plant, end_effectors=["l6", "r6"])
    assert candidates(plant, scene_graph) == before


def test_a_link_that_is_cut_does_not_touch_its_neighbour():
    assert before_and_after(CASES / "six_touching.urdf", "l6") == (set(), set())


def test_what_is_added_to_a_cut_link_does_not_touch_its_neighbour_either():
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
    load_robot(CASES / "spheres.urdf", plant, end_effector="l6")
    hand = plant.GetBodyByName("l6")
    for k, friction in enumerate((0.5, 0.6)):
        X_BG = RigidTransform([0.0, 0.0, 0.1 * k])
        plant.RegisterCollisionGeometry(
            hand, X_BG, Sphere(0.1), f"tool_{k}", CoulombFriction(friction, friction)
        )
    found = candidates(plant, scene_graph)
    assert frozenset({"l5", "l6"}) in found
    filter_neighbours(plant, scene_graph)
    assert found - links_that_may_touch(plant, scene_graph) == {frozenset({"l5", "l6"})}


def test_a_plant_that_filters_no_neighbours_keeps_to_that(tmp_path):
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
    plant.set_adjacent_bodies_collision_filters(False)
    load_robot(CASES / "six_touching.urdf", plant, end_effector="l6")
    assert candidates(plant, scene_graph) == {frozenset({"l5", "l6"})}
