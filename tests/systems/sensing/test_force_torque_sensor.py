"""The wrist sensor: sign, frame, the tool's load, and the errors of a real one."""

import logging

import numpy as np
import pytest
from arms import make_arm_plant
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RevoluteJoint, SpatialInertia, WeldJoint
from pydrake.systems.analysis import InitializeParams
from pydrake.systems.framework import DiagramBuilder
from sensor_rig import FedSensor, SensorRig, add_held_tool, random_attitudes

from geoimp_drake.controllers.wrist_sensor import (
    add_wrist_sensor,
    tool_load_beyond,
    wrist_sensor_at,
)
from geoimp_drake.errors import ConfigurationError, ModelError, SignalError
from geoimp_drake.parts.counted_noise import CountedNoise
from geoimp_drake.parts.wrist_sensor import Sensor
from geoimp_drake.parts.wrist_sensor_config import ToolLoad, WristSensorConfig
from geoimp_drake.validation import check

ATTITUDES = random_attitudes(12)
TILTED = RigidTransform(RollPitchYaw(2.0, 0.7, -0.4), [0.5, 0.1, 0.3])
REACTION = np.array([1.0, -2.0, 0.5, 20.0, -30.0, 45.0])


@pytest.mark.parametrize("from_hand", [False, True])
def test_nothing_is_felt_at_rest_with_the_tool_on_at_any_attitude(from_hand: bool) -> None:
    rigs = [SensorRig(X_WM, from_hand=from_hand) for X_WM in ATTITUDES]
    wrenches = np.array([rig.read() for rig in rigs])
    moment, force = np.abs(wrenches).reshape(-1, 2, 3).max(axis=(0, 2))
    print(f"\nat rest, {len(rigs)} attitudes: {force:.2e} N, {moment:.2e} Nm")
    assert force < 0.02
    assert moment < 0.002


def test_tools_mass_and_centre_may_be_given_instead_of_taken_from_the_plant() -> None:
    reference = SensorRig(TILTED)
    taken = tool_load_beyond(reference.plant, reference.plant.GetJointByName("wrist"))
    given = SensorRig(TILTED, tool=ToolLoad(mass=1.9, centre_of_mass=taken.centre_of_mass))
    assert taken.mass == pytest.approx(1.9)
    assert np.abs(given.read()).max() < 0.002


def test_a_tool_given_too_light_leaves_the_rest_of_its_weight() -> None:
    taken = tool_load_beyond((rig := SensorRig(TILTED)).plant, rig.plant.GetJointByName("wrist"))
    light = SensorRig(TILTED, tool=ToolLoad(1.8, taken.centre_of_mass))
    # The end effector holds the missing 0.1 kg up.
    np.testing.assert_allclose(light.read()[3:], [0.0, 0.0, 0.981], atol=1e-6)


@pytest.mark.parametrize("from_hand", [False, True])
def test_a_hanging_weight_is_felt_with_sign_frame_and_lever_arm(from_hand: bool) -> None:
    for X_WM in ATTITUDES[:4]:
        rig = SensorRig(X_WM, from_hand=from_hand)
        expected = rig.hang(0.8, np.array([0.1, -0.05, 0.2]))
        assert expected[5] == pytest.approx(0.8 * 9.81)  # upwards: it holds the weight
        assert np.linalg.norm(expected[:3]) > 0.1
        np.testing.assert_allclose(rig.read(), expected, atol=1e-6)


def test_wrench_is_zero_until_the_plant_has_stepped() -> None:
    rig = SensorRig(TILTED)
    rig.simulator.Initialize()
    for port in ("wrench", "wrench_true"):
        context = rig.sensor.GetMyContextFromRoot(rig.simulator.get_context())
        np.testing.assert_array_equal(rig.sensor.GetOutputPort(port).Eval(context), np.zeros(6))
    rig.hang(1.0, np.zeros(3))
    assert rig.read(0.003)[5] == pytest.approx(9.81)


def test_saturation_clips_and_is_said_once_for_each_axis(caplog) -> None:
    fed = FedSensor(WristSensorConfig(force_range=130.0, moment_range=10.0))
    fed.feed([0.0, 0.0, -12.0, 170.0, 0.0, 129.0])
    with caplog.at_level(logging.WARNING, logger="drake"):
        readings = fed.samples(20)
    np.testing.assert_array_equal(readings[-1], [0.0, 0.0, -10.0, 130.0, 0.0, 129.0])
    assert [(r.args, r.levelno) for r in caplog.records] == [((), logging.WARNING)] * 2
    assert "moment z is -12.0, the range is ±10" in caplog.text
    assert "force x is 170.0, the range is ±130" in caplog.text
    assert "t = 0.001 s" in caplog.text
    np.testing.assert_allclose(fed.read("wrench_true"), [0.0, 0.0, -12.0, 170.0, 0.0, 129.0])
    np.testing.assert_allclose(fed.read("peak_reading"), [0, 0, 1.2, 17 / 13, 0, 129 / 130])


def test_peak_reading_stays_when_the_load_goes(caplog) -> None:
    fed = FedSensor(WristSensorConfig(force_range=130.0, moment_range=10.0))
    fed.feed([0.0, 0.0, 0.0, 0.0, 0.0, 140.0])
    fed.samples(3)
    fed.feed(np.zeros(6))
    assert fed.samples(3)[-1][5] == 0.0
    assert fed.read("peak_reading")[5] == pytest.approx(14 / 13)
    fed.feed([0.0, 0.0, 0.0, 0.0, 0.0, 140.0])
    fed.samples(3)
    assert len(caplog.records) == 1


def test_a_delayed_reading_is_the_one_of_so_many_samples_before() -> None:
    fed = FedSensor(WristSensorConfig(delay=0.003))
    fed.feed(REACTION)
    before = fed.samples(3)[1:]
    fed.feed(2 * np.asarray(REACTION))
    after = fed.samples(5)
    # The first reading has been there all the time, and the new one comes three samples late.
    np.testing.assert_array_equal(before, [REACTION] * 2)
    np.testing.assert_array_equal(after, [REACTION] * 3 + [2 * np.asarray(REACTION)] * 2)
    np.testing.assert_array_equal(fed.read("wrench_true"), 2 * np.asarray(REACTION))


def test_a_delayed_reading_that_is_no_number_is_refused_when_it_comes() -> None:
    fed = FedSensor(WristSensorConfig(delay=0.002))
    fed.feed(REACTION)
    fed.samples(3)
    fed.feed([np.nan] * 6)
    fed.samples(1)
    fed.feed(REACTION)
    with pytest.raises(SignalError, match="reaction_forces"):
        fed.samples(4)


def noisy(seed: int, count: int = 50) -> np.ndarray:
    fed = FedSensor(WristSensorConfig(force_noise=0.3, moment_noise=0.02, seed=seed))
    fed.feed(REACTION)
    return fed.samples(count)[1:]


def test_noise_is_the_same_to_the_bit_for_the_same_seed_and_no_other() -> None:
    np.testing.assert_array_equal(noisy(7), noisy(7))
    assert not np.isin(noisy(7), noisy(8)).any()


def test_noise_has_the_standard_deviation_asked_for_on_every_axis() -> None:
    errors = noisy(3, 4000) - REACTION
    sigma = np.repeat([0.02, 0.3], 3)
    # Of 4000 samples: the deviation is known to 1.1 %, the mean to σ/63.
    np.testing.assert_allclose(errors.std(axis=0), sigma, rtol=0.05)
    assert (np.abs(errors.mean(axis=0)) < 4 * sigma / np.sqrt(4000)).all()
    correlation = np.corrcoef(errors.T) - np.eye(6)
    assert np.abs(correlation).max() < 4 / np.sqrt(4000)
    successive = np.corrcoef(errors[:-1, 0], errors[1:, 0])[0, 1]
    assert abs(successive) < 4 / np.sqrt(4000)


def test_noise_depends_on_no_draw_before_it() -> None:
    fed = FedSensor(WristSensorConfig(force_noise=0.3, seed=7))
    fed.feed(REACTION)
    fed.samples(10)
    context = fed.context.Clone()
    here = fed.samples(3)
    fed.simulator.reset_context(context)
    fed.simulator.Initialize(InitializeParams(suppress_initialization_events=True))
    np.testing.assert_array_equal(fed.samples(3), here)


def test_sensors_of_one_plant_with_the_same_settings_have_different_noise() -> None:
    plant = MultibodyPlant(1e-3)
    welds = []
    for name in ("left", "right"):  # the same model twice
        hand = plant.AddModelInstance(name)
        ends = (
            plant.AddRigidBody(end, hand, SpatialInertia.SolidSphereWithMass(1.0, 0.1)).body_frame()
            for end in ("mount", "tool")
        )
        welds.append(plant.AddJoint(WeldJoint("wrist", *ends, RigidTransform())))
    plant.Finalize()
    config = WristSensorConfig(force_noise=0.3, moment_noise=0.02, seed=7)
    sensors = [Sensor(wrist_sensor_at(plant, w, w.frame_on_child(), config), "") for w in welds]
    keys = {sensor.seed for sensor in sensors}
    assert len(keys) == 2
    left, right = (
        [CountedNoise(sensor.seed).draw(k, 6) for k in range(1, 400)] for sensor in sensors
    )
    assert abs(np.corrcoef(np.ravel(left), np.ravel(right))[0, 1]) < 4 / np.sqrt(6 * 400)


def test_quantisation_rounds_to_the_nearest_step() -> None:
    fed = FedSensor(WristSensorConfig(force_resolution=0.0635, moment_resolution=0.005))
    fed.feed(REACTION)
    reading = fed.samples(2)[-1]
    step = np.repeat([0.005, 0.0635], 3)
    np.testing.assert_allclose(reading / step, np.round(reading / step), atol=1e-9)
    assert (np.abs(reading - REACTION) <= step / 2 + 1e-12).all()
    assert (reading[3:] != REACTION[3:]).all()


def test_bias_is_added_in_the_sensors_axes() -> None:
    bias = np.array([0.1, 0.0, -0.2, 1.0, 2.0, 3.0])
    rig = SensorRig(TILTED, WristSensorConfig(bias=bias))
    S = rig.plant.GetJointByName("wrist").frame_on_child()
    R_WS = S.CalcPoseInWorld(rig.plant_context).rotation().matrix()
    np.testing.assert_allclose(rig.read()[3:], R_WS @ bias[3:], atol=1e-6)


def test_true_wrench_is_there_at_the_plants_steps_however_rarely_the_sensor_reads() -> None:
    fed = FedSensor(WristSensorConfig(period=0.05))
    fed.simulator.Initialize()
    fed.feed(REACTION)
    np.testing.assert_array_equal(fed.read("wrench_true"), np.zeros(6))
    fed.simulator.AdvanceTo(0.001)
    np.testing.assert_array_equal(fed.read(), np.zeros(6))
    np.testing.assert_allclose(fed.read("wrench_true"), REACTION)
    fed.simulator.AdvanceTo(0.06)
    np.testing.assert_allclose(fed.read(), REACTION)


def test_initialized_again_in_contact_it_begins_anew(caplog) -> None:
    """What it felt before, 60 N beyond its range, is neither read nor remembered."""
    fed = FedSensor(WristSensorConfig(force_range=50.0))
    fed.feed([0.0, 0.0, 0.0, 0.0, 0.0, 60.0])
    assert fed.samples(3)[-1][5] == 50.0
    fed.simulator.Initialize()  # the plant has not stepped since
    for port in ("wrench", "wrench_true", "peak_reading"):
        np.testing.assert_array_equal(fed.read(port), np.zeros(6))


def test_filter_answers_a_step_like_a_first_order_low_pass() -> None:
    fed = FedSensor(WristSensorConfig(filter_cutoff=20.0))
    fed.samples(3)
    fed.feed(REACTION)
    readings = fed.samples(60)
    first = int(np.flatnonzero(readings[:, 3])[0])
    k = np.arange(1, 1 + len(readings) - first)
    expected = np.outer(1 - np.exp(-2 * np.pi * 20.0 * 1e-3 * k), REACTION)
    np.testing.assert_allclose(readings[first:], expected, atol=1e-9)


def test_filter_starts_on_the_first_reading() -> None:
    fed = FedSensor(WristSensorConfig(filter_cutoff=1.0))
    fed.feed(REACTION)
    readings = fed.samples(4)
    np.testing.assert_allclose(readings[-1], REACTION, atol=1e-9)


def test_reading_is_held_between_two_samples() -> None:
    fed = FedSensor(WristSensorConfig(period=0.01))
    fed.feed(REACTION)
    fed.simulator.AdvanceTo(0.0101)
    held = fed.read()
    fed.feed(2 * REACTION)
    fed.simulator.AdvanceTo(0.0199)
    np.testing.assert_array_equal(fed.read(), held)
    fed.simulator.AdvanceTo(0.0201)
    np.testing.assert_array_equal(fed.read(), 2 * held)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_reaction_that_is_not_finite_is_refused_by_name(bad: float) -> None:
    fed = FedSensor(WristSensorConfig())
    fed.feed([0.0, 0.0, 0.0, 0.0, bad, 0.0])
    with pytest.raises(SignalError, match=rf"sensor:reaction_forces.*4: {bad}"):
        fed.samples(3)


CONFIGURATION_ERRORS = [
    ({"period": 0.0}, "sensor.period", "0"),
    ({"period": np.nan}, "sensor.period", "nan"),
    ({"force_range": -130.0}, "sensor.force_range", "-130"),
    ({"moment_range": np.nan}, "sensor.moment_range", "nan"),
    ({"force_resolution": -0.1}, "sensor.force_resolution", "-0.1"),
    ({"moment_resolution": np.inf}, "sensor.moment_resolution", "inf"),
    ({"force_noise": -1.0}, "sensor.force_noise", "-1"),
    ({"moment_noise": np.nan}, "sensor.moment_noise", "nan"),
    ({"filter_cutoff": -5.0}, "sensor.filter_cutoff", "-5"),
    ({"bias": np.zeros(3)}, "sensor.bias", "6 finite numbers"),
    ({"bias": np.full(6, np.nan)}, "sensor.bias", "nan"),
    ({"inertial_load": "plnt"}, "sensor.inertial_load", "Did you mean 'plant'?"),
    ({"seed": -4}, "sensor.seed", "-4"),
]


@pytest.mark.parametrize(("fields", "name", "number"), CONFIGURATION_ERRORS)
def test_a_field_that_cannot_be_used_is_named_with_its_number(fields, name, number) -> None:
    with pytest.raises(ConfigurationError) as error:
        FedSensor(WristSensorConfig(**fields))
    assert name in str(error.value)
    assert number in str(error.value)


@pytest.mark.parametrize(
    ("fields", "name", "number"),
    [
        ({"mass": -1.0}, "tool.mass", "-1"),
        ({"mass": np.nan}, "tool.mass", "nan"),
        ({"centre_of_mass": np.zeros(2)}, "tool.centre_of_mass", "3 finite numbers"),
        ({"inertia": np.zeros(3)}, "tool.inertia", "3×3"),
        ({"inertia": np.full((3, 3), np.inf)}, "tool.inertia", "inf"),
    ],
)
def test_a_tool_that_cannot_be_is_refused(fields, name, number) -> None:
    with pytest.raises(ConfigurationError) as error:
        check(ToolLoad(**fields), "tool")
    assert name in str(error.value)
    assert number in str(error.value)


def make_plant_with_a_hinge() -> MultibodyPlant:
    plant = MultibodyPlant(1e-3)
    add_held_tool(plant, TILTED)
    lid = plant.AddRigidBody("lid", SpatialInertia.SolidSphereWithMass(0.5, 0.03))
    plant.AddJoint(
        RevoluteJoint("hinge", plant.GetFrameByName("mount"), lid.body_frame(), [0, 0, 1])
    )
    return plant


def test_only_a_weld_joint_of_a_finalized_plant_with_E_beyond_it_is_taken() -> None:
    builder, plant = DiagramBuilder(), make_plant_with_a_hinge()
    wrist, E = plant.GetJointByName("wrist"), plant.GetFrameByName("E")
    with pytest.raises(ModelError, match=r"not finalized"):
        add_wrist_sensor(builder, plant, wrist, E)
    plant.Finalize()
    with pytest.raises(ModelError, match=r"'hinge' is of type 'revolute'.*weld"):
        add_wrist_sensor(builder, plant, plant.GetJointByName("hinge"), E)
    with pytest.raises(ModelError, match=r"'lid' is not fixed beyond joint 'wrist'.*disk, tool"):
        add_wrist_sensor(builder, plant, wrist, plant.GetFrameByName("lid"))
    other = make_plant_with_a_hinge()
    other.Finalize()
    with pytest.raises(ModelError, match=r"'E' belongs to another plant"):
        add_wrist_sensor(builder, plant, wrist, other.GetFrameByName("E"))


def test_a_sensor_with_joints_between_it_and_E_is_refused_with_their_names() -> None:
    rig = make_arm_plant(company=True)
    plant, base = rig.plant, rig.plant.GetBodyByName("base", rig.arm)
    (plate,) = (
        joint
        for joint in map(plant.get_joint, plant.GetJointIndices())
        if joint.child_body().index() == base.index()
    )
    moving = ", ".join(f"'joint{k}'" for k in range(1, 7))
    with pytest.raises(ModelError, match=rf"'E' is not fixed beyond .*\({moving} move between"):
        wrist_sensor_at(plant, plate, rig.E)
    finger = plant.GetFrameByName("finger1")
    with pytest.raises(ModelError, match=r"\('slide1' move.*these bodies: tool\."):
        wrist_sensor_at(plant, rig.wrist, finger)
    # What hangs on the hand is still part of the tool.
    assert wrist_sensor_at(plant, rig.wrist, rig.E).tool.mass == pytest.approx(1.4 + 2 * 0.3)
