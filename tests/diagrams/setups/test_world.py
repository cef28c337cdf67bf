"""Plants that differ from what their controllers know, in every experiment."""

from functools import cache

import numpy as np
import pytest
from pydrake.multibody.tree import JacobianWrtVariable
from runs import run

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS, get_experiment
from geoimp_drake.diagrams.setups.driven_arm import ScenarioDrive
from geoimp_drake.diagrams.setups.setup import Setup
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.scenario.loading import dump_scenario
from geoimp_drake.scenario.yaml_text import parse_yaml

SHORT = ("form=compiled", "duration=0.2")
EVERYTHING = (
    "world.links.mass=1.1",
    "world.links.inertia_spread=0.2",
    "world.links.centre_spread=0.005",
    "world.joints.coulomb=0.01",
    "world.joints.viscous=1.2",
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
        ("world.joints.coulomb=-1", r"world\.joints\.coulomb"),
    ],
)
def test_a_world_that_cannot_be_is_refused(override, text):
    with pytest.raises(ConfigurationError, match=text):
        get_experiment("plexiglas").scenario((), (override,))


def test_draws_for_other_links_are_refused():
    with pytest.raises(ConfigurationError, match=r"given for nobody; the links are six::link1"):
        built("world.links.drawn={nobody: [1, 1, 0, 0, 0]}")


def test_a_drive_refuses_a_world():
    scenario = get_experiment("plexiglas").scenario((), ("world.links.mass=1.1",))
    with pytest.raises(ConfigurationError, match="world"):
        ScenarioDrive(scenario)
