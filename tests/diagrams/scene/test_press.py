"""The press test: what a disk feels, measured in simulation."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ExternallyAppliedSpatialForce,
    MultibodyPlant,
)
from pydrake.systems.framework import DiagramBuilder

from geoimp_drake.diagrams.scene.press import PressRig, press_test
from geoimp_drake.diagrams.scene.surface import (
    DISK_RADIUS,
    SURFACES,
    SurfaceConfig,
    add_disk_contact,
    add_surface,
    plexiglas,
    surface_plane,
)
from geoimp_drake.errors import ConfigurationError, ModelError

# Normal along −x, along y, and anywhere; the origin away from the world's.
POSES = [
    RigidTransform(RollPitchYaw(rpy), np.array([0.9, -0.2, 0.7]))
    for rpy in ([0.0, -np.pi / 2, 0.0], [-np.pi / 2, 0.0, 0.0], [2.5, 0.6, 0.3])
]


def make_plant(time_step: float = 1e-3) -> MultibodyPlant:
    return AddMultibodyPlantSceneGraph(DiagramBuilder(), time_step)[0]


@pytest.mark.parametrize(
    ("name", "normal", "tilt"),
    [("plexiglas", 1e4, 20.0), ("plexiglas-stiff", 1e4, 20.0), ("cardboard", 5000.0, 15.0)],
)
def test_surface_has_the_stiffness_of_the_chapter(name: str, normal: float, tilt: float) -> None:
    result = press_test(SURFACES[name])
    print(
        f"\n{name}: {result.normal_stiffness:.0f} N/m, "
        f"{result.tilt_stiffness[0]:.2f} and {result.tilt_stiffness[1]:.2f} Nm/rad "
        f"at {result.preload:.2f} N, {1e3 * result.depth:.2f} mm"
    )
    assert result.preload == pytest.approx(30.0, abs=0.1)
    assert result.normal_stiffness == pytest.approx(normal, rel=0.005)
    assert result.tilt_stiffness == pytest.approx(np.full(2, tilt), rel=0.005)


@pytest.mark.parametrize("tilt", [0.0, np.deg2rad(0.3)])
@pytest.mark.parametrize(("mesh", "sides"), [(0.05, 7), (0.025, 14)])
def test_disk_touches_with_its_front_alone(tilt: float, mesh: float, sides: int) -> None:
    rig = PressRig(plexiglas(), disk_mesh=mesh)
    rig.press(0.005, np.array([tilt, 0.0, 0.0]))
    results = rig.plant.get_contact_results_output_port().Eval(rig.plant_context)
    faces = results.hydroelastic_contact_info(0).contact_surface().poly_mesh_W()
    assert faces.num_faces() == sides
    area = sum(faces.area(i) for i in range(sides))
    assert area == pytest.approx(sides / 2 * DISK_RADIUS**2 * np.sin(2 * np.pi / sides))


def test_stiffness_does_not_depend_on_the_disks_roll() -> None:
    rig = PressRig(plexiglas())
    moments = []
    for angle in np.linspace(0.0, 2 * np.pi, 9):
        axis = np.array([np.cos(angle), np.sin(angle), 0.0])
        moments.append(axis @ rig.press(0.003, np.deg2rad(0.5) * axis)[:3])
    assert np.ptp(moments) < 1e-3 * np.mean(moments)


@pytest.mark.parametrize("X_WS", POSES)
def test_stiffness_does_not_depend_on_where_the_surface_faces(X_WS: RigidTransform) -> None:
    depth, tilt = 0.003, np.array([np.deg2rad(0.5), 0.0, 0.0])
    horizontal = PressRig(plexiglas()).press(depth, tilt)
    np.testing.assert_allclose(
        PressRig(plexiglas(), X_WS).press(depth, tilt), horizontal, atol=0.01
    )
    assert horizontal[5] == pytest.approx(-30.0, abs=0.1)


def test_pivot_beside_the_contact_softens_the_surface() -> None:
    beside = press_test(plexiglas(), pivot=np.array([0.058, 0.0, 0.0]))
    print(f"\npivot 58 mm off: {beside.normal_stiffness:.0f} N/m, {beside.tilt_stiffness} Nm/rad")
    assert 6000.0 < beside.normal_stiffness < 8000.0


def test_no_force_and_no_motion_before_touch() -> None:
    rig = PressRig(plexiglas(), POSES[2])
    rig.place(-1e-5)
    assert rig.plate_pose().IsNearlyEqualTo(POSES[2], 1e-14)
    rig.settle(1.0)
    np.testing.assert_array_equal(rig.wrench(), np.zeros(6))
    assert rig.plate_pose().IsNearlyEqualTo(POSES[2], 1e-14)
    assert rig.press(1e-4)[5] < -0.9


@pytest.mark.parametrize("friction", [0.0, 0.2, 0.6])
def test_sliding_plate_feels_the_friction_of_coulomb(friction: float) -> None:
    rig = PressRig(replace(plexiglas(), friction=friction))
    rig.press(0.003)
    pull_plate(rig, [60.0, 0.0, 0.0])
    ratios = []
    for _ in range(10):
        rig.settle(1e-3)
        f_S = rig.wrench()[3:]
        ratios.append(np.hypot(f_S[0], f_S[1]) / -f_S[2])
    assert max(ratios) == pytest.approx(friction, rel=0.02, abs=0.01)
    assert rig.plate_pose().translation()[0] > 1e-4


def test_enough_friction_holds_the_plate() -> None:
    rig = PressRig(replace(plexiglas(), friction=3.0))
    rig.press(0.003)
    pull_plate(rig, [60.0, 0.0, 0.0])
    rig.settle(0.05)
    assert -rig.wrench()[3] > 59.0
    assert abs(rig.plate_pose().translation()[0]) < 1e-5


def pull_plate(rig: PressRig, f_W: list[float]) -> None:
    force = ExternallyAppliedSpatialForce()
    force.body_index = rig.surface.body.index()
    force.F_Bq_W = SpatialForce(tau=np.zeros(3), f=np.array(f_W))
    rig.plant.get_applied_spatial_force_input_port().FixValue(rig.plant_context, [force])


@pytest.mark.parametrize("X_WS", POSES)
def test_plane_is_the_outward_normal_and_its_offset(X_WS: RigidTransform) -> None:
    plane = surface_plane(X_WS)
    for p_S in ([0.0, 0.0, 0.0], [0.1, -0.3, 0.0], [0.0, 0.2, 0.05]):
        assert plane[:3] @ (X_WS @ np.array(p_S)) - plane[3] == pytest.approx(p_S[2], abs=1e-15)


@pytest.mark.parametrize(
    ("field", "value", "number"),
    [
        ("size", np.array([0.4, 0.4]), "0.4"),
        ("size", np.array([0.4, np.nan, 0.04]), "nan"),
        ("color", np.array([0.0, 0.0, 0.0, 1.5]), "1.5"),
        ("layer_stiffness", 0.0, "0; it must be positive"),
        ("mount_stiffness", -1.0, "-1; it must be positive"),
        ("mount_damping", np.inf, "inf"),
        ("friction", -0.1, "-0.1"),
        ("plate_mass", np.nan, "nan"),
    ],
)
def test_unusable_number_is_named(field: str, value: Any, number: str) -> None:
    with pytest.raises(ConfigurationError, match=f"surface.{field} is .*{number}"):
        add_surface(make_plant(), replace(plexiglas(), **{field: value}), RigidTransform())


def test_unknown_appearance_is_refused_with_the_valid_ones() -> None:
    with pytest.raises(ConfigurationError, match=r"surface.appearance 'glas'.*carton, sheet"):
        add_surface(make_plant(), replace(plexiglas(), appearance="glas"), RigidTransform())


@pytest.mark.parametrize(
    ("field", "value"), [("mount_damping", 2100.0), ("mount_tilt_damping", 30.0)]
)
def test_mount_that_would_diverge_is_refused(field: str, value: float) -> None:
    with pytest.raises(ConfigurationError, match=f"surface.{field} {value:g} diverges .* 0.001 s"):
        add_surface(make_plant(), replace(plexiglas(), **{field: value}), RigidTransform())


def test_plant_that_cannot_take_a_surface_is_refused() -> None:
    twice, late = make_plant(), make_plant()
    add_surface(twice, plexiglas(), RigidTransform())
    late.Finalize()
    for plant, reason in (
        (MultibodyPlant(1e-3), "SceneGraph"),
        (make_plant(0.0), "continuous"),
        (late, "Finalize"),
        (twice, "'plexiglas' already"),
    ):
        with pytest.raises(ModelError, match=reason):
            add_surface(plant, plexiglas(), RigidTransform())


def test_disk_refuses_negative_friction() -> None:
    plant = make_plant()
    with pytest.raises(ConfigurationError, match=r"disk\.friction is -1"):
        add_disk_contact(plant, plant.world_body(), RigidTransform(), friction=-1.0)


def test_surface_survives_yaml() -> None:
    for config in SURFACES.values():
        text = yaml_dump_typed(config)
        assert yaml_dump_typed(yaml_load_typed(schema=SurfaceConfig, data=text)) == text
