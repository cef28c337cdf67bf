"""Peg and hole: what they are, where they touch, and how a peg gets in."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed
from pydrake.geometry import (
    HydroelasticContactRepresentation,
    MeshcatVisualizer,
    Role,
    StartMeshcat,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    LinearBushingRollPitchYaw,
    PdControllerGains,
    PrismaticJoint,
    RigidBody,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from geoimp_drake.diagrams.scene.insertion import Insertion, insertion
from geoimp_drake.diagrams.scene.peg_hole import PegHoleConfig, add_block, add_peg
from geoimp_drake.errors import ConfigurationError, ModelError
from geoimp_drake.validation import check

I = RigidTransform()  # noqa: E741
ROLLS = [0.0, 0.07, 0.13, 1.0]  # the sides of peg and hole repeat after 15° and 22.5°
CONFIGS = {
    "chapter": PegHoleConfig(),
    "tight": PegHoleConfig(hole_diameter=0.0173),
    "wide": PegHoleConfig(hole_diameter=0.02, hole_depth=0.05),
}


def peg_pose(
    depth: float, direction: float = 0.0, offset: float = 0.0, roll: float = 0.0, tilt: float = 0.0
) -> RigidTransform:
    """X_HP of a peg that arrives: z_P against z_H."""
    R_HP = (
        RotationMatrix.MakeXRotation(np.pi + tilt)
        @ RotationMatrix.MakeYRotation(tilt)
        @ RotationMatrix.MakeZRotation(roll)
    )
    return RigidTransform(R_HP, [offset * np.cos(direction), offset * np.sin(direction), -depth])


@dataclass
class Still:
    """A peg that is put somewhere, beside a block at rest."""

    config: PegHoleConfig
    plant: MultibodyPlant = field(init=False)
    diagram: Diagram = field(init=False)
    peg: RigidBody = field(init=False)
    block: RigidBody = field(init=False)
    context: Context = field(init=False)

    def __post_init__(self) -> None:
        builder = DiagramBuilder()
        self.plant, _ = AddMultibodyPlant(MultibodyPlantConfig(time_step=1e-3), builder)
        hand = self.plant.AddRigidBody("hand", SpatialInertia.SolidCubeWithDensity(1000.0, 0.1))
        self.peg = add_peg(self.plant, hand.body_frame(), I, self.config)
        self.block = add_block(self.plant, self.plant.world_frame(), I, self.config)
        self.plant.Finalize()
        self.diagram = builder.Build()
        self.context = self.plant.GetMyContextFromRoot(self.diagram.CreateDefaultContext())

    def force(self, X_HP: RigidTransform) -> np.ndarray:
        """The force on the peg [N], in H, the pressure taken at the middle of each face."""
        hand = self.plant.GetBodyByName("hand")
        self.plant.SetFreeBodyPose(self.context, hand, X_HP)
        query = self.plant.get_geometry_query_input_port().Eval(self.context)
        f_H = np.zeros(3)
        for surface in query.ComputeContactSurfaces(HydroelasticContactRepresentation.kPolygon):
            mesh, pressure = surface.poly_mesh_W(), surface.poly_e_MN()
            # The faces' normals point out of geometry N into M.
            frame = query.inspector().GetFrameId(surface.id_M())
            on_M = self.plant.GetBodyFromFrameId(frame).index() == self.peg.index()
            for i in range(mesh.num_elements()):
                p = pressure.EvaluateCartesian(i, mesh.element_centroid(i))
                f_H += (1 if on_M else -1) * p * mesh.area(i) * mesh.face_normal(i)
        return f_H

    def touch(self, pose: Callable[[float], RigidTransform], low: float, high: float) -> float:
        """The parameter of a pose at which the force reaches 0.1 N."""
        assert np.linalg.norm(self.force(pose(low))) < 0.1 < np.linalg.norm(self.force(pose(high)))
        while high - low > 1e-6:
            middle = (low + high) / 2
            touching = np.linalg.norm(self.force(pose(middle))) > 0.1
            low, high = (low, middle) if touching else (middle, high)
        return high


@pytest.fixture(scope="module")
def still() -> Still:
    return Still(PegHoleConfig())


def test_play_is_half_a_millimetre_all_round() -> None:
    np.testing.assert_allclose(PegHoleConfig().play_bounds(), 0.5e-3, atol=0.05e-3)


@pytest.mark.parametrize("name", CONFIGS)
def test_peg_moves_freely_within_its_play_in_every_direction(name: str) -> None:
    config = CONFIGS[name]
    rig, (least, greatest) = Still(config), config.play_bounds()
    # To the middles of the hole's sides, to its corners, and to one at neither.
    directions = np.append(np.arange(0, 2 * config.hole_sides, 3) * np.pi / config.hole_sides, 0.3)
    plays = np.array(
        [
            rig.touch(lambda d, a=a, r=r: peg_pose(0.03, a, d, r), 0.0, 2 * greatest)
            for a in directions
            for r in ROLLS
        ]
    )
    print(f"\n{name}: play {1e3 * plays.min():.4f} to {1e3 * plays.max():.4f} mm")
    # 0.1 N presses the peg in by less than 10 µm.
    assert np.all((plays > least) & (plays < greatest + 10e-6))
    assert plays.min() < least + 10e-6


@pytest.mark.parametrize("roll", ROLLS)
def test_wall_pushes_the_peg_back_to_the_axis(still: Still, roll: float) -> None:
    for direction in (0.0, 0.2, 2.0, 4.5):
        f_H = still.force(peg_pose(0.03, direction, 0.57e-3, roll))
        out = np.array([np.cos(direction), np.sin(direction), 0.0])
        assert f_H @ out < -1.0
        assert abs(f_H[2]) < 0.02 * np.linalg.norm(f_H)


@pytest.mark.parametrize("depth", [-0.01, 0.0, 0.01, 0.035, 0.0699])
def test_peg_on_the_axis_touches_nothing(still: Still, depth: float) -> None:
    for roll in ROLLS:
        assert np.all(still.force(peg_pose(depth - 1e-9, roll=roll)) == 0)


@pytest.mark.parametrize("offset", [0.0, 0.4e-3])
def test_bottom_is_at_70_mm(still: Still, offset: float) -> None:
    depth = still.touch(lambda d: peg_pose(d, 1.0, offset, 0.3), 0.069, 0.071)
    assert depth == pytest.approx(0.07, abs=2e-6)
    assert still.force(peg_pose(0.07001, 1.0, offset, 0.3))[2] > 10.0


@pytest.mark.parametrize("offset", [1.0e-3, 3e-3, 8e-3, 20e-3])
@pytest.mark.parametrize("direction", [0.0, 0.2, 0.8, 3.0, 5.5])
def test_front_is_at_the_mouth(still: Still, direction: float, offset: float) -> None:
    depth = still.touch(lambda d: peg_pose(d, direction, offset, 0.1), -1e-3, 1e-3)
    assert depth == pytest.approx(0.0, abs=20e-6)


def test_tilted_peg_is_held_between_the_mouth_and_the_far_wall(still: Still) -> None:
    """It is on the axis halfway, so that the two contacts begin together."""
    depth = 0.05

    def pose(tilt: float) -> RigidTransform:
        R_HP = RotationMatrix.MakeXRotation(np.pi) @ RotationMatrix.MakeYRotation(tilt)
        return RigidTransform(R_HP, [np.tan(tilt) * depth / 2, 0.0, -depth])

    tilt = still.touch(pose, 0.0, 0.05)
    least, greatest = still.config.play_bounds()
    assert 2 * least / depth < tilt < 2 * greatest / depth + 2e-3


@pytest.mark.parametrize("tilt", [0.0, 0.02])
def test_insertion_tells_depth_offset_and_angle(tilt: float) -> None:
    X_WH = RigidTransform(RotationMatrix.MakeXRotation(0.7), [0.3, -0.2, 0.9])
    found = insertion(X_WH @ peg_pose(0.04, 1.1, 2e-4, 0.3, tilt), X_WH)
    angle = np.arccos(np.cos(tilt) ** 2)
    np.testing.assert_allclose(found, Insertion(0.04, 2e-4, angle), atol=1e-12)
    turned = insertion(X_WH @ RigidTransform([0.0, 0.0, 0.01]), X_WH)
    np.testing.assert_allclose(turned, Insertion(-0.01, 0.0, np.pi), atol=1e-12)


def test_peg_and_block_weigh_what_steel_and_wood_do(still: Still) -> None:
    config, context = still.config, still.plant.CreateDefaultContext()
    bore = np.pi / 4 * config.hole_diameter**2 * config.hole_depth
    box = config.block_width**2 * config.block_length
    peg = np.pi / 4 * config.peg_diameter**2 * config.peg_length
    assert still.peg.get_mass(context) == pytest.approx(7850 * peg)
    assert still.block.get_mass(context) == pytest.approx(600 * (box - bore), rel=1e-3)
    p_PPcm = still.peg.CalcCenterOfMassInBodyFrame(context)
    np.testing.assert_allclose(p_PPcm, [0.0, 0.0, -0.04], atol=1e-12)
    z = (-box * config.block_length / 2 + bore * config.hole_depth / 2) / (box - bore)
    p_HHcm = still.block.CalcCenterOfMassInBodyFrame(context)
    np.testing.assert_allclose(p_HHcm, [0.0, 0.0, z], atol=2e-5)
    assert still.peg.CalcSpatialInertiaInBodyFrame(context).IsPhysicallyValid()


def test_inside_of_the_hole_can_be_seen_but_not_through_the_peg(still: Still) -> None:
    scene = still.plant.get_geometry_query_input_port().Eval(still.context).inspector()
    for body, alpha in ((still.peg, 1.0), (still.block, 0.35)):
        frame = still.plant.GetBodyFrameIdOrThrow(body.index())
        (geometry,) = scene.GetGeometries(frame, Role.kIllustration)
        color = scene.GetIllustrationProperties(geometry).GetProperty("phong", "diffuse")
        assert color.a() == alpha


def test_meshcat_draws_both() -> None:
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(MultibodyPlantConfig(time_step=1e-3), builder)
    for add in (add_peg, add_block):
        add(plant, plant.world_frame(), I, PegHoleConfig())
    plant.Finalize()
    meshcat = StartMeshcat()
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    diagram = builder.Build()
    diagram.ForcedPublish(diagram.CreateDefaultContext())
    for path in ("peg/peg", "block/block"):
        assert meshcat.HasPath(f"/drake/visualizer/{path}")


@dataclass
class Drive:
    """A hand of 10 kg that a servo of bounded force drives along the peg's axis."""

    X_WP: RigidTransform  # at the start
    speed: float
    path: float
    config: PegHoleConfig = field(default_factory=PegHoleConfig)
    compliant: bool = False  # the block is held by an impedance
    force: float = 150.0
    rows: list[Insertion] = field(default_factory=list)
    wrench: list[np.ndarray] = field(default_factory=list)

    def run(self, rest: float, every: float = 2e-3) -> None:
        builder = DiagramBuilder()
        settings = MultibodyPlantConfig(time_step=1e-3, discrete_contact_approximation="sap")
        plant, _ = AddMultibodyPlant(settings, builder)
        plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
        peg = self._add_drive(plant)
        frame = add_holder(plant).body_frame() if self.compliant else plant.world_frame()
        block = add_block(plant, frame, I, self.config)
        plant.Finalize()
        simulator = Simulator(builder.Build())
        context = plant.GetMyContextFromRoot(simulator.get_mutable_context())
        hand = plant.GetModelInstanceByName("DefaultModelInstance")
        plant.GetJointByName("drive").set_translation_rate(context, self.speed)
        for t in np.arange(0.0, self.path / self.speed + rest, every):
            moving = self.speed * t < self.path
            goal = [min(self.speed * t, self.path), self.speed if moving else 0.0]
            plant.get_desired_state_input_port(hand).FixValue(context, goal)
            simulator.AdvanceTo(t + every)
            X_WP, X_WH = (plant.EvalBodyPoseInWorld(context, body) for body in (peg, block))
            self.rows.append(insertion(X_WP, X_WH))
            self.wrench.append(contact_force(plant, context))

    def _add_drive(self, plant: MultibodyPlant) -> RigidBody:
        hand = plant.AddRigidBody("hand", SpatialInertia.SolidBoxWithMass(10.0, 0.2, 0.2, 0.2))
        start = plant.AddFrame(FixedOffsetFrame("start", plant.world_frame(), self.X_WP))
        axis = PrismaticJoint("drive", start, hand.body_frame(), [0.0, 0.0, 1.0])
        servo = plant.AddJointActuator("drive", plant.AddJoint(axis), self.force)
        servo.set_controller_gains(PdControllerGains(p=1e5, d=2e3))
        return add_peg(plant, hand.body_frame(), I, self.config)


def add_holder(plant: MultibodyPlant) -> RigidBody:
    """A body that yields like an arm under the chapter's impedance, about the mouth."""
    mass, inertia = 15.0, 9.0
    M = SpatialInertia(mass, np.zeros(3), UnitInertia(*[inertia / mass] * 3))
    holder = plant.AddRigidBody("holder", plant.AddModelInstance("holder"), M)
    frames = plant.world_frame(), holder.body_frame()
    K_p, D_p = [400.0, 400.0, 1300.0], [300.0, 300.0, 950.0]
    plant.AddForceElement(LinearBushingRollPitchYaw(*frames, [1.0] * 3, [13.5] * 3, K_p, D_p))
    return holder


def contact_force(plant: MultibodyPlant, context: Context) -> np.ndarray:
    """The force between peg and block, in W; its sign is Drake's choice of A."""
    results = plant.get_contact_results_output_port().Eval(context)
    contacts = map(results.hydroelastic_contact_info, range(results.num_hydroelastic_contacts()))
    return sum((c.F_Ac_W().translational() for c in contacts), np.zeros(3))


@pytest.mark.parametrize(
    ("name", "X_WP", "surface", "bound"),
    [
        ("bottom", peg_pose(0.06), 0.07, 0.4e-3),
        ("bottom, tilted", peg_pose(0.06, tilt=0.004), 0.07, 0.4e-3),
        ("front", peg_pose(-0.01, 0.3, 0.02), 0.0, 0.4e-3),
        ("rim, half over the hole", peg_pose(-0.01, 0.3, 0.009), 0.0, 0.5e-3),
        ("rim, 2 mm over it", peg_pose(-0.01, 0.3, 0.0025, 0.1), 0.0, 1.5e-3),
    ],
)
def test_peg_at_200_mm_per_second_does_not_pass(
    name: str, X_WP: RigidTransform, surface: float, bound: float
) -> None:
    drive = Drive(X_WP, speed=0.2, path=0.04)
    drive.run(rest=0.05, every=1e-3)
    deepest = max(row.depth for row in drive.rows) - surface
    print(f"\n{name}: {1e3 * deepest:.3f} mm, then {1e3 * (drive.rows[-1].depth - surface):.3f}")
    assert -0.1e-3 < deepest < bound
    assert abs(drive.wrench[-1][2]) == pytest.approx(150.0, rel=0.1)


def test_peg_that_lands_flat_on_the_bottom_gives_no_great_blow() -> None:
    drive = Drive(peg_pose(0.0698), speed=0.009, path=0.003, compliant=True)
    drive.run(rest=0.02, every=1e-3)
    assert 8.5 < np.linalg.norm(drive.wrench, axis=1).max() < 40.0


def test_edge_of_the_mouth_holds_a_peg_that_is_beside_the_hole() -> None:
    drive = Drive(peg_pose(-0.001, 0.3, 0.8e-3, 0.1), speed=0.05, path=0.01, force=40.0)
    drive.run(rest=0.05)
    assert drive.rows[-1].depth < 3e-3
    assert abs(drive.wrench[-1][2]) == pytest.approx(40.0, rel=0.02)


def test_peg_turned_by_two_degrees_goes_in() -> None:
    drive = Drive(peg_pose(-0.01, tilt=np.deg2rad(2.0)), speed=0.045, path=0.1, compliant=True)
    drive.run(rest=0.3, every=0.01)
    end, force = drive.rows[-1], np.linalg.norm(drive.wrench, axis=1)
    print(f"\ndepth {1e3 * end.depth:.3f} mm, {np.rad2deg(end.angle):.3f}°, {force.max():.1f} N")
    assert drive.rows[0].angle == pytest.approx(np.deg2rad(2.83), abs=1e-3)
    assert end.depth == pytest.approx(0.07, abs=0.1e-3)
    assert end.angle < 0.02
    assert force.max() < 100.0
    # The spring of the holder, 1300 N/m, over the 20 mm past the bottom.
    assert force[-1] == pytest.approx(26.0, abs=1.0)
    inside = [row.offset for row in drive.rows if row.depth > 0.001]
    assert max(inside) < 0.8e-3


def test_peg_that_fits_feels_nothing_on_its_way_in() -> None:
    drive = Drive(peg_pose(-0.01, 0.0, 1e-4), speed=0.2, path=0.05)
    drive.run(rest=0.1)
    assert max(np.linalg.norm(drive.wrench, axis=1)) == 0
    assert drive.rows[-1].depth == pytest.approx(0.04, abs=1e-4)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"peg_diameter": 0.0185}, "18.5 mm does not fit into peg_hole.hole_diameter 18 mm"),
        ({"peg_diameter": 0.018}, "does not fit"),
        ({"peg_sides": 8, "peg_diameter": 0.0178}, "µm too wide"),
        ({"peg_length": 0.016}, "peg_length 16 mm must exceed"),
        ({"block_length": 0.07}, "block_length 70 mm must exceed"),
        ({"block_length": 0.0701}, "too little wood"),
        ({"block_width": 0.03}, "too little wood"),
        ({"hole_sides": 18}, "18; give a multiple of 4"),
        ({"hole_sides": 4}, "from 8 to 128"),
        ({"peg_sides": 200}, "from 8 to 128"),
        ({"hole_depth": float("nan")}, "hole_depth is nan"),
        ({"modulus": 0.0}, "modulus is 0"),
        ({"friction": -0.1}, "friction is -0.1"),
        ({"block_color": np.array([0.5, 0.5, 0.5, 1.5])}, "block_color"),
        ({"block_color": np.array([0.5, 0.5, 0.5])}, "block_color"),
    ],
)
def test_what_cannot_be_built_is_refused(changes: dict[str, object], said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        check(replace(PegHoleConfig(), **changes), "peg_hole")


def test_configuration_goes_through_yaml() -> None:
    config = replace(PegHoleConfig(), hole_diameter=0.0175, friction=0.1)
    again = yaml_load_typed(schema=PegHoleConfig, data=yaml_dump_typed(config))
    assert yaml_dump_typed(again) == yaml_dump_typed(config)
    check(again)


@pytest.mark.parametrize("add", [add_peg, add_block])
def test_plant_that_cannot_take_them_is_refused(add: Callable[..., RigidBody]) -> None:
    def attempt(plant: MultibodyPlant) -> RigidBody:
        return add(plant, plant.world_frame(), I, PegHoleConfig(), "thing")

    with pytest.raises(ModelError, match="SceneGraph"):
        attempt(MultibodyPlant(1e-3))
    with pytest.raises(ModelError, match="continuous"):
        attempt(AddMultibodyPlant(MultibodyPlantConfig(time_step=0.0), DiagramBuilder())[0])
    plant, _ = AddMultibodyPlant(MultibodyPlantConfig(time_step=1e-3), DiagramBuilder())
    attempt(plant)
    with pytest.raises(ModelError, match="thing"):
        attempt(plant)
    plant.Finalize()
    with pytest.raises(ModelError, match="Finalize"):
        attempt(plant)
