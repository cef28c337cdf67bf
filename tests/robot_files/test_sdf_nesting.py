"""An SDF of models within models is one arm, which moves as Drake's many model instances do."""

from pathlib import Path

import numpy as np
import pytest
from published_arms import write_sdf
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.robot_files.loading import load_robot

CASES = Path(__file__).parent / "cases"
Q = np.array([0.4, 0.3, 0.9, 0.5, -0.9, 0.3])

# A palm with a finger that is turned, and frames of every kind; its base is named like the arm's.
HAND = """<sdf version="1.9"><model name="hand"><pose>9 9 9 0 0 0</pose>
    <link name="base_link"><inertial><mass>0.4</mass><inertia><ixx>.001</ixx><iyy>.002</iyy>
    <izz>.002</izz></inertia></inertial></link>
    <frame name="knuckle" attached_to="base_link"><pose>0.02 0 0.01 0.3 0 0</pose></frame>
    <model name="finger"><pose relative_to="knuckle">0 0.03 0 0 0.2 0</pose>
    <link name="bone"><pose>0 0 0.02 0 0 0</pose><inertial><mass>0.1</mass><inertia><ixx>.0001</ixx>
    <iyy>.0002</iyy><izz>.0002</izz></inertia></inertial></link>
    <frame name="tip"><pose>0 0 0.05 0 0 0.4</pose></frame></model>
    <joint name="grown" type="fixed"><parent>knuckle</parent><child>finger::bone</child></joint>
    </model></sdf>"""
CELL = """<sdf version="1.9"><model name="cell"><link name="table"/>
    <include><uri>model://small</uri><name>left</name><pose>0 0 1 0 0 0.5</pose></include>
    <include {merge}><uri>hands/hand.sdf</uri>
    <pose relative_to="left::link_6">0.06 0 0 0 0.1 0</pose></include>
    <joint name="stand" type="fixed"><parent>table</parent><child>left::base_link</child></joint>
    <joint name="mount" type="fixed"><parent>left::tcp</parent><child>{hand}base_link</child>
    </joint>    </model></sdf>"""


def write_cell(folder: Path, merge: bool = False) -> Path:
    (folder / "small").mkdir()
    (folder / "hands").mkdir()
    write_sdf(folder / "small")
    (folder / "small" / "model.config").write_text(
        "<model><name>small</name><sdf version='1.5'>old.sdf</sdf><sdf>arm.sdf</sdf></model>"
    )
    (folder / "hands" / "hand.sdf").write_text(HAND)
    file = folder / "cell.sdf"
    words = {"merge": "merge='true'", "hand": ""} if merge else {"merge": "", "hand": "hand::"}
    file.write_text(CELL.format(**words))
    return file


def by_drake(file: Path, base: str, frame: str, arm: str):
    """What Drake makes of a file, its base welded: E's pose, mass matrix, gravity."""
    plant = MultibodyPlant(1e-3)
    parser = Parser(plant)
    if (small := file.parent / "small").is_dir():
        for folder in (small, file.parent / "hands"):
            parser.package_map().Add(folder.name, str(folder))
        # Drake wants files of packages and no folders.
        text = file.read_text().replace("model://small<", "model://small/arm.sdf<")
        text = text.replace("<uri>hands", "<uri>model://hands")
        file = file.with_name("raw.sdf")
        file.write_text(text)
    parser.AddModels(str(file))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(base))
    plant.Finalize()
    E = _scoped_frame(plant, frame)
    return plant, list(_motion(plant, E, plant.GetModelInstanceByName(arm)))


def _scoped_frame(plant, frame):
    *scope, name = frame.split("::")
    return plant.GetFrameByName(name, plant.GetModelInstanceByName("::".join(scope)))


def _motion(plant, E, arm):
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, arm, Q)
    yield E.CalcPoseInWorld(context).GetAsMatrix4()
    yield plant.CalcMassMatrix(context)
    yield plant.CalcGravityGeneralizedForces(context)


def loaded(file, end_effector, **options):
    plant = MultibodyPlant(1e-3)
    robot = load_robot(file, plant, end_effector=end_effector, geometry="leave-out", **options)
    plant.Finalize()
    return plant, robot


def agrees(file, end_effector, raw):
    plant, robot = loaded(file, end_effector)
    found = _motion(plant, robot.end_effector_frame, robot.model_instance)
    for one, other in zip(found, raw, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)
    return robot


def test_the_nested_case_moves_as_in_drake():
    file = CASES / "nested.sdf"
    _, raw = by_drake(file, "base", "cell::hand::palm", "cell::arm")
    for end_effector in ("hand::palm", "palm"):
        robot = agrees(file, end_effector, raw)
        assert robot.sensor_joint.name() == "mount"


def test_axes_of_old_files_are_turned_with_their_model(tmp_path):
    text = (CASES / "nested.sdf").read_text().replace('version="1.7"', 'version="1.6"')
    old = "<xyz>0 1 0</xyz><use_parent_model_frame>1</use_parent_model_frame>"
    text = text.replace("<xyz>0 1 0</xyz>", old)
    text = text.replace('"arm">', '"arm"><pose>0.1 0.2 0.3 0.4 0.5 0.6</pose>')
    file = tmp_path / "old.sdf"
    file.write_text(text.replace("0.4 0 0.5 0 0 0", "0.4 0 0.5 0.3 0 0.2"))
    _, raw = by_drake(file, "base", "cell::hand::palm", "cell::arm")
    agrees(file, "palm", raw)


def test_included_models_move_as_in_drake_and_names_are_scoped_where_they_must_be(tmp_path):
    file = write_cell(tmp_path)
    shell = tmp_path / "small" / "shell.stl"
    shell.unlink()
    without = (tmp_path / "small" / "arm.sdf").read_text()
    (tmp_path / "small" / "arm.sdf").write_text(_without_shapes(without))
    _, raw = by_drake(file, "table", "cell::hand::finger::tip", "cell::left")
    robot = agrees(file, "hand::finger::tip", raw)
    assert robot.sensor_joint.name() == "mount"
    assert agrees(file, "tip", raw).changes == robot.changes
    plant, _ = loaded(file, "tip", sensor_joint="mount")
    names = {plant.get_body(k).name() for k in plant.GetBodyIndices(robot.model_instance)}
    assert {"table", "left_base_link", "hand_base_link", "link_6", "bone"} <= names


def _without_shapes(sdf: str) -> str:
    parts = sdf.split("<collision")
    return parts[0] + "".join(part.split("</collision>")[1] for part in parts[1:])


def test_merged_models_have_no_scope_as_in_drake(tmp_path):
    file = write_cell(tmp_path, merge=True)
    arm = tmp_path / "small" / "arm.sdf"
    arm.write_text(_without_shapes(arm.read_text()))
    _, raw = by_drake(file, "table", "cell::finger::tip", "cell::left")
    agrees(file, "finger::tip", raw)


def test_meshes_of_included_models_are_beside_them(tmp_path):
    load_robot(
        write_cell(tmp_path), MultibodyPlant(1e-3), end_effector="tip", cache=tmp_path / "cache"
    )


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        (
            "hands/hand.sdf",
            "hands/none.sdf",
            r"cell\.sdf:3: <include> names 'hands/none",
        ),
        ("hands/hand.sdf", "cell.sdf", r"cell\.sdf:3: .*cell\.sdf includes itself"),
        ("model://small", "model://big", "package 'big', which is neither above nor beside"),
        (
            "<name>left",
            "<placement_frame>f</placement_frame><name>left",
            "placed by its frame",
        ),
    ],
)
def test_what_cannot_be_included_is_named(tmp_path, old, new, match):
    file = write_cell(tmp_path)
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    with pytest.raises(ConfigurationError, match=match):
        loaded(file, "tip")


def test_a_urdf_that_is_included_is_refused(tmp_path):
    file = write_cell(tmp_path)
    (tmp_path / "hands" / "hand.sdf").write_text("<robot name='hand'/>")
    with pytest.raises(ConfigurationError, match=r"hand\.sdf holds no SDF <model>"):
        loaded(file, "tip")
