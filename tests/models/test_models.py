"""The model files against the tables: kinematics, masses, limits, motors, and their provenance."""

from dataclasses import asdict, fields
from pathlib import Path

import numpy as np
import pytest
from pydrake.multibody.parsing import PackageMap, Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import WeldJoint

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.models import dh_to_joint, generate, joint_to_dh, model_path, package_map
from geoimp_drake.models.robot_data import (
    ARM,
    BASE_MASS,
    LINK_BOXES,
    SENSOR,
    TOOL,
    TRACK,
    JointData,
)
from geoimp_drake.typing import Array

MODELS = Path(model_path("six_joint_arm")).parent
ARMS = ("six_joint_arm", "seven_joint_arm")
NAMES = [joint.name for joint in ARM]


def load(name: str) -> MultibodyPlant:
    plant = MultibodyPlant(time_step=0.0)
    Parser(plant).AddModels(model_path(name))
    root = {"six_joint_arm": "base", "seven_joint_arm": "rail"}.get(name)
    if root is not None:
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(root))
    plant.Finalize()
    return plant


def dh_transform(joint: JointData, angle: float) -> Array:
    """Rot_z(angle) Trans_z(d) Trans_x(a) Rot_x(alpha), written out."""
    c, s = np.cos(angle), np.sin(angle)
    ca, sa = np.cos(np.radians(joint.alpha)), np.sin(np.radians(joint.alpha))
    return np.array(
        [
            [c, -s * ca, s * sa, joint.a * c],
            [s, c * ca, -c * sa, joint.a * s],
            [0, sa, ca, joint.d],
            [0, 0, 0, 1],
        ]
    )


def dh_flange(q_dh: Array) -> Array:
    X_BF = np.eye(4)
    for joint, angle in zip(ARM, q_dh, strict=True):
        X_BF = X_BF @ dh_transform(joint, angle)
    return X_BF


@pytest.mark.parametrize("name", ARMS)
def test_forward_kinematics_is_that_of_the_dh_table(name: str) -> None:
    plant = load(name)
    context = plant.CreateDefaultContext()
    rng = np.random.default_rng(1)
    for _ in range(50):
        q = rng.uniform(plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits())
        plant.SetPositions(context, q)
        expected = dh_flange(joint_to_dh(q[-6:]))
        if name == "seven_joint_arm":
            expected[0, 3] += q[0]
        actual = plant.GetFrameByName("flange").CalcPoseInWorld(context).GetAsMatrix4()
        np.testing.assert_allclose(actual, expected, atol=1e-9)


def test_dh_angles_of_a_right_angle_elbow_put_the_flange_where_robots_of_this_size_have_it() -> (
    None
):
    position = dh_flange(np.radians([0, 90, 0, 0, 0, 0]))[:3, 3]
    np.testing.assert_allclose(position, [0.93, -0.11, 1.65], atol=1e-12)


def test_joint_and_dh_angles_are_inverse_and_straight_up_is_zero() -> None:
    q = np.linspace(-1, 1, 6)
    np.testing.assert_allclose(joint_to_dh(dh_to_joint(q)), q, atol=1e-15)
    assert dh_to_joint(np.radians([0, 90, 0, 0, 0, 0]))[1] == pytest.approx(0)


def test_seven_numbers_are_refused_as_dh_angles() -> None:
    with pytest.raises(ConfigurationError, match=r"\(7,\)"):
        dh_to_joint(np.zeros(7))


def test_committed_files_are_what_the_generator_writes(tmp_path: Path) -> None:
    generate.write(tmp_path)
    written = {path.name: path.read_text() for path in tmp_path.iterdir()}
    assert {path.name for path in MODELS.glob("*.obj")} <= set(written)
    for name, content in written.items():
        assert (MODELS / name).read_text() == content, f"{name}: regenerate it"


@pytest.mark.parametrize("name", ARMS)
def test_joints_and_motors_carry_the_table(name: str) -> None:
    plant = load(name)
    for data in ARM:
        joint = plant.GetJointByName(data.name)
        limits = [*joint.position_lower_limits(), *joint.position_upper_limits()]
        np.testing.assert_allclose(np.degrees(limits), [data.lower, data.upper])
        np.testing.assert_allclose(np.degrees(joint.velocity_upper_limits()), data.speed)
        assert joint.default_damping_vector() == pytest.approx([data.viscous])
        motor = plant.GetJointActuatorByName(data.name)
        assert motor.effort_limit() == data.effort
        assert motor.default_gear_ratio() == data.gear_ratio
        assert motor.default_rotor_inertia() == data.rotor_inertia


def test_track_carries_its_table_and_comes_first() -> None:
    plant = load("seven_joint_arm")
    joint, motor = plant.GetJointByName("track"), plant.GetJointActuatorByName("track")
    assert joint.position_start() == 0
    assert joint.position_upper_limits() == -joint.position_lower_limits() == [TRACK.travel]
    assert joint.velocity_upper_limits() == [TRACK.speed]
    assert joint.default_damping_vector() == [TRACK.viscous]
    assert motor.effort_limit() == TRACK.effort
    assert motor.default_reflected_inertia() == pytest.approx(
        TRACK.gear_ratio**2 * TRACK.rotor_inertia
    )


@pytest.mark.parametrize("name", ARMS)
def test_positions_and_actuators_follow_the_order_of_the_joints(name: str) -> None:
    plant = load(name)
    names = NAMES if name == "six_joint_arm" else ["track", *NAMES]
    motors = [plant.get_joint_actuator(i).name() for i in plant.GetJointActuatorIndices()]
    starts = [plant.GetJointByName(joint).position_start() for joint in names]
    assert motors == names
    assert starts == list(range(len(names)))


@pytest.mark.parametrize("name", ARMS)
def test_link_masses_are_the_table_s(name: str) -> None:
    plant = load(name)
    masses = [plant.GetBodyByName(f"link{i}").default_mass() for i in range(1, 7)]
    assert masses == [joint.mass for joint in ARM]
    if name == "seven_joint_arm":
        carried = plant.GetBodyByName("carriage").default_mass()
        assert carried == pytest.approx(TRACK.mass + BASE_MASS)


@pytest.mark.parametrize("name", [*ARMS, "wrist_sensor", "stick_and_disk", "floor"])
def test_inertias_are_physical_and_not_near_the_edge(name: str) -> None:
    plant = load(name)
    for index in plant.GetBodyIndices(plant.GetModelInstanceByName(name)):
        body = plant.get_body(index)
        inertia = body.default_spatial_inertia()
        about_centre = inertia.Shift(inertia.get_com()).CalcRotationalInertia()
        small, middle, large = about_centre.CalcPrincipalMomentsOfInertia()
        assert inertia.IsPhysicallyValid(), body.name()
        assert small > 0, body.name()
        assert small + middle > large * (1 + 1e-6), body.name()


def test_mass_of_the_tool_follows_from_its_dimensions_and_densities() -> None:
    tool = load("stick_and_disk").GetBodyByName("tool")
    plate = np.pi * TOOL.plate_radius**2 * TOOL.plate_thickness * TOOL.steel_density
    bare = TOOL.stick_length - TOOL.plate_thickness
    stick = np.pi * TOOL.stick_radius**2 * bare * TOOL.steel_density
    disk = np.pi * TOOL.disk_radius**2 * TOOL.disk_thickness * TOOL.wood_density
    assert tool.default_mass() == pytest.approx(plate + stick + disk)


def test_sensor_is_a_weld_of_two_light_halves() -> None:
    plant = load("wrist_sensor")
    weld = plant.GetJointByName("wrist_sensor")
    assert isinstance(weld, WeldJoint)
    assert (weld.parent_body().name(), weld.child_body().name()) == ("mount", "tool_side")
    assert weld.parent_body().default_mass() == SENSOR.mount_mass
    assert weld.child_body().default_mass() == SENSOR.tool_side_mass


def test_package_and_paths_resolve_and_unknown_names_list_the_models() -> None:
    packages: PackageMap = package_map()
    assert Path(packages.GetPath("geoimp_models")) == MODELS
    assert model_path("floor.urdf") == model_path("floor")
    with pytest.raises(ConfigurationError, match=r"'puma'.*seven_joint_arm, six_joint_arm"):
        model_path("puma")


def table_rows(first_cells: set[str], columns: int) -> dict[str, list[str]]:
    """Reads the rows of PROVENANCE.md that start with one of `first_cells` and have that width."""
    lines = (MODELS / "PROVENANCE.md").read_text().splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    found = [row for row in rows if row[0] in first_cells and len(row) == columns]
    return {row[0]: row[1:] for row in found}


def test_provenance_names_every_number_of_the_arm() -> None:
    numbers = {field.name for field in fields(JointData)} - {"name"}
    rows = table_rows(numbers, columns=9)
    assert set(rows) == numbers
    for number, cells in rows.items():
        assert [float(cell) for cell in cells[:6]] == [getattr(j, number) for j in ARM], number
        assert cells[6].split()[0].strip(",") in {"cited", "derived", "ours"}, number


def test_provenance_names_every_box_that_stands_for_a_link() -> None:
    rows = table_rows({f"link{i}" for i in range(1, 7)}, columns=8)
    for i, (sides, centre) in enumerate(LINK_BOXES, start=1):
        assert tuple(float(cell) for cell in rows[f"link{i}"][:6]) == sides + centre


def test_provenance_names_every_number_of_track_sensor_and_tool() -> None:
    lines = (MODELS / "PROVENANCE.md").read_text().splitlines()
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]
    parts = {"foot", "track", "sensor", "tool"}
    printed = {(r[0], r[1]): float(r[2]) for r in rows if len(r) == 5 and r[0] in parts}
    data = {"track": TRACK, "sensor": SENSOR, "tool": TOOL}
    expected = {(part, k): v for part, table in data.items() for k, v in asdict(table).items()}
    assert printed == expected | {("foot", "mass"): BASE_MASS}
