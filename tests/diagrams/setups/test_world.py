"""Plants that differ from what their controllers know, in every experiment."""

from functools import cache

import numpy as np
import pytest
from pydrake.multibody.tree import JacobianWrtVariable
from runs import run

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS, get_experiment
from geoimp_drake.diagrams.setups.driven_arm import ScenarioDrive
from geoimp_drake.diagrams.setups.joint_errors import fallen_friction, rounded
from geoimp_drake.diagrams.setups.setup import Setup
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.scenario.loading import dump_scenario
from geoimp_drake.scenario.yaml_text import parse_yaml
from geoimp_drake.systems.frame_motion import POSITION

SHORT = ("form=compiled", "duration=0.2")
EVERYTHING = (
    "world.links.mass=1.1",
    "world.links.inertia_spread=0.2",
    "world.links.centre_spread=0.005",
    "world.joints.coulomb=0.01",
    "world.joints.stribeck=0.5",
    "world.joints.viscous=1.2",
    "world.kinematics.position_spread=0.001",
    "world.kinematics.rotation_spread_deg=0.1",
    "world.encoder_resolution=1e-5",
    "sensor.delay=0.002",
    "world.torque_delay=0.001",
    "world.payload_before.mass=0.1",
    "world.payload_beyond.mass=0.2",
)


@cache
def built(*overrides: str, name: str = "plexiglas") -> Setup:
    experiment = get_experiment(name)
    return experiment.build(experiment.scenario((), (*SHORT, *overrides)))


def gravity(setup: Setup) -> np.ndarray:
    """Returns the true weight of the arm in its joints, with what its events change."""
    context = setup.diagram.CreateDefaultContext()
    for event in setup.events:
        event.apply(context)
    own = setup.plant.GetMyContextFromRoot(context)
    return setup.plant.CalcGravityGeneralizedForces(own)


def nominal_gravity(setup: Setup) -> np.ndarray:
    return setup.plant.CalcGravityGeneralizedForces(setup.plant.CreateDefaultContext())


def nominal(name: str) -> tuple[dict, object]:
    """Returns log and scenario of an experiment whose plant is the model."""
    log, scenario, _ = run(name, "form=compiled", "duration=0.01", "world.links.mass=1")
    return dict(log), scenario


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_experiment_runs_in_another_world(name):
    duration = "duration=0.01"
    log, scenario, failure = run(name, "form=compiled", *EVERYTHING, duration)
    assert failure is None
    assert log["t"][-1] == pytest.approx(0.01)
    masses = dict(zip(log["world/bodies"], log["world/masses"], strict=True))
    for link in scenario.world.links.drawn:
        true, known = masses.pop(link)
        assert true == pytest.approx(1.1 * known)
    hanging = np.array(sorted(true - known for true, known in masses.values()))
    np.testing.assert_allclose(np.unique(hanging.round(12)), [0.1, 0.2])
    assert np.all(log["world/coulomb"] > 0.0)
    assert set(log["world/frames"]) == set(scenario.world.kinematics.drawn)
    figures = get_experiment(name).figures(dict(log), scenario)
    assert ("true_motion" in figures) == (name != "disturbance")
    assert "true_motion" not in get_experiment(name).figures(*nominal(name))


def test_by_default_the_plant_is_what_the_controller_knows():
    setup = built()
    assert setup.events == []
    log, _, _ = run("plexiglas", *SHORT)
    assert not [key for key in log if key.startswith("world")]


def test_heavier_links_weigh_more_in_the_plant_alone():
    setup = built("world.links.mass=1.1")
    tool = built("world.links.mass=1e-9")
    links = nominal_gravity(setup) - gravity(tool)
    np.testing.assert_allclose(gravity(setup) - nominal_gravity(setup), 0.1 * links, atol=1e-6)
    plant = setup.plant
    E = plant.GetFrameByName("disk", plant.GetModelInstanceByName("six_tool"))
    known = ControlModel.of_arm(plant, plant.GetModelInstanceByName("six"), E).plant
    weight = known.CalcGravityGeneralizedForces(known.CreateDefaultContext())
    np.testing.assert_allclose(weight, nominal_gravity(built())[:6], atol=1e-9)


@pytest.mark.parametrize("place", ["payload_before", "payload_beyond"])
def test_a_payload_weighs_where_it_hangs(place):
    centre = [0.02, -0.01, 0.05]
    setup = built(f"world.{place}.mass=0.5", f"world.{place}.centre={centre}")
    plant = setup.plant
    context = plant.CreateDefaultContext()
    sensor = plant.GetJointByName("wrist_sensor", plant.GetModelInstanceByName("six_sensor"))
    S, W = sensor.frame_on_child(), plant.world_frame()
    J = plant.CalcJacobianTranslationalVelocity(context, JacobianWrtVariable.kV, S, centre, W, W)
    weight = 0.5 * plant.gravity_field().gravity_vector()
    np.testing.assert_allclose(gravity(setup) - nominal_gravity(setup), J.T @ weight, atol=1e-9)


def test_draws_come_from_the_seed_and_stand_in_the_scenario():
    spread = ("world.links.mass_spread=0.1",)
    one, other = (built(*spread, f"seed={seed}").scenario for seed in (1, 2))
    assert one.world.links.drawn != other.world.links.drawn
    factors = np.array(list(one.world.links.drawn.values()))
    assert np.all(np.abs(factors[:, 0] - 1.0) <= 0.1)
    assert np.ptp(factors[:, 0]) > 0.02
    np.testing.assert_array_equal(factors[:, 1:], [[1.0, 0.0, 0.0, 0.0]] * 6)
    again = get_experiment("plexiglas").scenario((parse_yaml(dump_scenario(one), "again"),))
    assert again.world.links.drawn == one.world.links.drawn


def test_a_joint_sticks_until_the_torque_exceeds_coulomb_friction():
    pushed = (*SHORT, "external.moment=[0, 0, 2.5]", "external.blend=0.05", "external.duration=9")
    log, _, failure = run("consistency", *pushed, "world.joints.coulomb=0.9")
    assert failure is None
    assert np.abs(log["six/q"] - log["six/q"][0]).max() < 1e-5
    free, _, _ = run("consistency", *pushed)
    assert np.abs(free["six/q"] - free["six/q"][0]).max() > 5e-4


def test_friction_leaves_the_joints_their_rotors():
    """Drake takes the rotor of a joint's last actuator, which is that of its friction."""
    masses = []
    for coulomb in (0.0, 0.01):
        plant = built(f"world.joints.coulomb={coulomb}").plant
        masses.append(plant.CalcMassMatrix(plant.CreateDefaultContext()))
    np.testing.assert_allclose(*masses, rtol=1e-12)


def test_friction_falls_with_the_velocity():
    fall, v = np.array([3.0, 5.0]), np.array([0.05, -10.0])
    np.testing.assert_allclose(
        fallen_friction(v, fall, 0.05), [3.0 * (1.0 - np.exp(-1.0)), -5.0], rtol=1e-12
    )


def test_what_is_above_coulomb_friction_falls_with_the_velocity():
    setup = built("world.joints.coulomb=0.02", "world.joints.stribeck=0.5")
    plant, context = setup.plant, setup.diagram.CreateDefaultContext()
    own = plant.GetMyMutableContextFromRoot(context)
    six = plant.GetModelInstanceByName("six")
    largest = np.array(
        [
            actuator.effort_limit()
            for actuator in map(plant.get_joint_actuator, plant.GetJointActuatorIndices(six))
            if actuator.has_controller()
        ]
    )
    plant.SetVelocities(own, six, np.full(6, -9.0))
    pushes = plant.get_applied_generalized_force_input_port().Eval(own)
    friction = largest + plant.GetVelocitiesFromArray(six, pushes)
    np.testing.assert_allclose(friction, largest / 1.5, rtol=1e-12)


def test_stribeck_friction_holds_what_coulomb_friction_does_not():
    pushed = (*SHORT, "external.moment=[0, 0, 2.5]", "external.blend=0.05", "external.duration=9")
    slippery = (*pushed, "world.joints.coulomb=0.001")
    for share, least, most in ((0, 1e-4, 1.0), (900, 0.0, 1e-5)):
        log, _, _ = run("consistency", *slippery, f"world.joints.stribeck={share}")
        assert least <= np.abs(log["six/q"] - log["six/q"][0]).max() < most


def test_the_plants_joints_are_where_the_world_has_them_and_the_models_are_not():
    log, scenario, _ = run(
        "plexiglas",
        *SHORT,
        "world.kinematics.position_spread=0.001",
        "world.kinematics.rotation_spread_deg=0.1",
    )
    drawn = np.array(list(scenario.world.kinematics.drawn.values()))
    assert drawn.shape == (6, 6)
    assert 0.0 < np.abs(drawn[:, :3]).max() <= 0.001
    assert 0.01 < np.abs(drawn[:, 3:]).max() <= 0.1
    true, known = log["six/motion_E"][0], log["six/motion_E_known"][0]
    # To first order the shifts of the joints add up at E, and the rotations about their places do.
    assert 1e-4 < np.linalg.norm((true - known)[POSITION]) < 0.02
    nominal_log, _, _ = run("plexiglas", *SHORT)
    np.testing.assert_allclose(known, nominal_log["six/motion_E"][0], atol=1e-12)
    again, _, _ = run(
        "plexiglas", *SHORT, f"world.kinematics.drawn={scenario.world.kinematics.drawn}"
    )
    np.testing.assert_array_equal(again["six/motion_E"], log["six/motion_E"])


def test_a_shift_of_the_first_joint_moves_the_whole_arm():
    names = run("plexiglas", *SHORT, "world.kinematics.position_spread=0.001")[0]["world/frames"]
    drawn = {str(name): [0.0] * 6 for name in names}
    drawn["six::waist"] = [0.003, 0.0, -0.002, 0.0, 0.0, 0.0]
    log, _, _ = run("plexiglas", *SHORT, f"world.kinematics.drawn={drawn}")
    offset = (log["six/motion_E"] - log["six/motion_E_known"])[0, POSITION]
    np.testing.assert_allclose(np.sort(np.abs(offset)), [0.0, 0.002, 0.003], atol=1e-9)


def test_encoders_round_what_the_controller_reads():
    step = 1e-3
    log, _, _ = run("plexiglas", *SHORT, f"world.encoder_resolution={step}")
    nominal_log, _, _ = run("plexiglas", *SHORT)
    assert np.abs(log["six/motion_E_known"] - log["six/motion_E"])[0, POSITION].max() > 1e-5
    assert not np.array_equal(log["six/u"], nominal_log["six/u"])
    np.testing.assert_array_equal(rounded(np.array([2.6e-3, -2.4e-3]), step), [3e-3, -2e-3])


def test_delayed_torques_hold_the_arm_from_the_start():
    log, _, _ = run("plexiglas", *SHORT, "world.torque_delay=0.005")
    plain, _, _ = run("plexiglas", *SHORT)
    difference = np.abs(log["six/q"] - plain["six/q"]).max()
    assert 1e-9 < difference < 1e-4


@pytest.mark.parametrize(
    ("override", "text"),
    [
        ("world.links.mass=0", r"world\.links\.mass"),
        ("world.links.mass_spread=1", r"world\.links\.mass_spread"),
        ("world.torque_delay=0.0015", r"0\.0015 s.*0\.001 s"),
        ("world.torque_delay=2", r"1 s less world\.torque_delay"),
        ("world.joints.coulomb=-1", r"world\.joints\.coulomb"),
        ("world.joints.stribeck=0.5", r"world\.joints\.stribeck is 0\.5.*give world\.joints\.c"),
        ("world.kinematics.position_spread=-1", r"world\.kinematics\.position_spread"),
        ("world.encoder_resolution=-1", r"world\.encoder_resolution"),
        ("sensor.delay=0.0015", r"sensor\.delay is 0\.0015 s; give a multiple .* 0\.001 s"),
    ],
)
def test_a_world_that_cannot_be_is_refused(override, text):
    with pytest.raises(ConfigurationError, match=text):
        get_experiment("plexiglas").scenario((), (override,))


def test_draws_for_other_links_are_refused():
    with pytest.raises(ConfigurationError, match=r"given for nobody; the links are six::link1"):
        built("world.links.drawn={nobody: [1, 1, 0, 0, 0]}")
    with pytest.raises(ConfigurationError, match=r"given for nobody; the joints are six::waist"):
        built("world.kinematics.drawn={nobody: [0, 0, 0, 0, 0, 0]}")


def test_a_drive_refuses_a_world():
    scenario = get_experiment("plexiglas").scenario((), ("world.links.mass=1.1",))
    with pytest.raises(ConfigurationError, match="world"):
        ScenarioDrive(scenario)
