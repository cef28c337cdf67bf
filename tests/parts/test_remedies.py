"""Remedies against errors of the model: both forms, what they take away, and where they wait."""

import logging
from functools import cache

import numpy as np
import pytest
from recorded_controller import record
from rigs import make_controlled_arm, quick_config
from runs import run as run_experiment

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.compilation.compiled import is_available
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.diagrams.experiments.measures import Log
from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.parts.motion_control import MotionControl
from geoimp_drake.parts.part_loop import PartLoop
from geoimp_drake.parts.remedies import Remedies
from geoimp_drake.parts.remedies_config import (
    DisturbanceObserverConfig,
    FrictionConfig,
    IntegralConfig,
    RemediesConfig,
)
from geoimp_drake.systems.frame_motion import frame_motion_at_rest
from geoimp_drake.validation import check

pytestmark = pytest.mark.skipif(not is_available(), reason="numba is not installed")

PORTS = ("actuation", "compensation", "peak_effort", "compliant_motion")
STEPS = 60
PUSH = np.array([30.0, -20.0, 12.0]), np.array([0.8, -1.2, 0.5])  # [N], [Nm]
COULOMB = "world.joints.coulomb=0.02"
# 2 % of the effort limits.
FRICTION = "remedies.friction.coulomb=[14.38, 28.48, 8.26, 1.07, 0.778, 1.676]"
OBSERVER, INTEGRAL = "remedies.disturbance_observer.gain=30.0", "remedies.integral.rate=2.0"


def everything(**contact: bool) -> RemediesConfig:
    return RemediesConfig(
        integral=IntegralConfig(**contact),
        disturbance_observer=DisturbanceObserverConfig(**contact),
        friction=FrictionConfig(coulomb=np.array(2.0), viscous=np.array(0.5)),
    )


def run(form: str, joints: int) -> np.ndarray:
    """Returns what ports say of an arm that is pushed, all remedies at work."""
    made = quick_config("differenced")
    made.form, made.remedies = form, everything(in_contact=True)
    arm = make_controlled_arm(joints, made)
    arm.push(*PUSH)
    rows = []
    for step in range(STEPS):
        arm.simulator.AdvanceTo(1e-3 * (step + 1))
        rows.append(np.concatenate([arm.read(port) for port in PORTS]))
    return np.array(rows)


@pytest.mark.parametrize("joints", [6, 7])
def test_both_forms_add_the_same_torques(joints: int) -> None:
    compiled, blocks = run("compiled", joints), run("blocks", joints)
    largest = np.abs(compiled).max(axis=0)
    assert largest[joints : 2 * joints].min() > 1e-3  # something is added at every joint
    np.testing.assert_allclose(blocks, compiled, atol=1e-11 * np.abs(compiled).max())


def test_a_loop_by_hand_adds_them_too() -> None:
    remedies = {
        "integral": {},
        "disturbance_observer": {},
        "friction": {"coulomb": [14.38, 28.48, 8.26, 1.07, 0.778, 1.676]},
    }
    was = record("plexiglas", {"remedies": remedies}, ticks=300)
    arm = was.plant.GetModelInstanceByName("six")
    loop = ControlLoop(was.plant, arm, was.frame("six"), was.scenario)
    signals = was.q[0], was.v[0], was.wrench[0], was.desired
    torques = [loop.reset(*(values[0] for values in signals))]
    torques += [loop.step(*(values[k] for values in signals)) for k in range(1, 300)]
    np.testing.assert_allclose(torques, was.torques[0][:300], rtol=0, atol=1e-9)
    assert np.abs(loop.output("compensation")).max() > 0.5


@cache
def off(*overrides: str) -> tuple[float, float]:
    """Returns how far E is from C at rest, and at most in the motion before it [mm]."""
    mass = [] if COULOMB not in overrides else ["world.links.mass=1.0"]
    log, _, failure = run_experiment("disturbance", "duration=4.5", *mass, *overrides)
    assert failure is None
    distance = _distance(log)
    return float(distance[log["t"] > 4.0].mean()), float(distance[log["t"] < 2.0].max())


def _distance(log: Log) -> np.ndarray:
    return 1e3 * np.linalg.norm((log["six/motion_E"] - log["six/motion_C"])[:, 4:7], axis=1)


def test_links_that_are_heavier_leave_no_offset_at_rest() -> None:
    plain, integral, observer = off(), off(INTEGRAL), off(OBSERVER)
    assert plain == pytest.approx((0.36, 0.37), abs=0.02)
    assert integral[0] < plain[0] / 50.0
    assert observer[0] < plain[0] / 50.0
    # The observer also acts while the arm moves.
    assert observer[1] < 0.5 * plain[1]


def test_coulomb_friction_leaves_hardly_an_offset() -> None:
    plain, observer, friction = off(COULOMB), off(COULOMB, OBSERVER), off(COULOMB, FRICTION)
    both = off(COULOMB, OBSERVER, FRICTION)
    assert observer[0] < plain[0] / 50.0
    assert observer[1] < 0.4 * plain[1]
    assert friction[0] < 0.75 * plain[0]
    assert friction[1] < 0.75 * plain[1]
    assert both[1] < 0.75 * observer[1]  # each leaves to the other what it has done


@cache
def model() -> ControlModel:
    was = record("plexiglas", ticks=1)
    arm = was.plant.GetModelInstanceByName("six")
    return ControlLoop(was.plant, arm, was.frame("six"), was.scenario).model


def told(config: RemediesConfig, wrench: float, ticks: int, torque: float = 0.0) -> np.ndarray:
    """Returns what is added after C has been 10 mm above E at rest for some ticks [Nm]."""
    q = np.array([0.12, -0.38, 1.1, 0.0, -0.72, -1.45])
    loop = PartLoop(Remedies(model(), config, MotionControl(), 1e-3), "remedies")
    plant = model().plant
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, q)
    C = frame_motion_at_rest(model().end_effector.CalcPoseInWorld(context))
    C[6] += 0.01
    signals = {
        "torque": np.full(6, torque),
        "estimated_state": np.concatenate((q, np.zeros(6)))[np.argsort(model().state_order)],
        "reference_motion": C,
        "wrench": np.array([0.0, 0.0, 0.0, 0.0, 0.0, wrench]),
    }
    loop.reset(signals)
    for _ in range(ticks):
        loop.step(signals, {}, 1e-3)
    return loop.output("compensation").copy()


def test_the_integral_waits_in_contact_and_at_a_limit_and_ends_at_its_bound() -> None:
    own = RemediesConfig(integral=IntegralConfig(rate=20.0, largest=0.002))
    one, many = told(own, 0.0, 6), told(own, 0.0, 40)
    assert np.abs(one).max() > 0.1
    # 20/s · 10 mm · 10 ms are the 2 mm that it may reach.
    np.testing.assert_allclose(many, told(own, 0.0, 80), rtol=0, atol=1e-9)
    np.testing.assert_allclose(many, 2.0 * one, rtol=1e-6, atol=1e-9)
    assert not told(own, 4.0, 40).any()
    assert not told(own, 0.0, 40, torque=1e4).any()
    own.integral = IntegralConfig(rate=20.0, largest=0.002, in_contact=True)
    np.testing.assert_allclose(told(own, 4.0, 40), many, rtol=0, atol=1e-9)


def test_the_observer_waits_in_contact() -> None:
    own = RemediesConfig(disturbance_observer=DisturbanceObserverConfig())
    assert not told(own, 4.0, 40).any()
    # The arm rests without torques: what holds it is a disturbance.
    assert np.abs(told(own, 0.0, 200)).max() > 10.0


def test_what_hurts_in_contact_is_warned_of(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "drake"):
        Remedies(model(), everything(), MotionControl(), 1e-3)
        assert not caplog.records
        Remedies(model(), everything(in_contact=True), MotionControl(), 1e-3)
    said = [record.getMessage() for record in caplog.records]
    assert len(said) == 2
    assert all("hunts in contact, with 2 N" in words for words in said)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"scheme": "admittance"}, r"remedies is given, but with scheme: admittance the arm's own"),
        ({"scheme": "direct"}, r"remedies\.integral is given, but with scheme: direct C is E"),
        (
            {"scheme": "direct", "inertia": "natural"},
            r"remedies is given, but with inertia: natural a contact would count as a disturbance",
        ),
    ],
)
def test_a_remedy_that_has_nothing_to_act_on_is_refused(options: dict, words: str) -> None:
    with pytest.raises(ConfigurationError, match=words):
        check(ImpedanceControllerConfig(remedies=everything(), **options))


def test_numbers_that_cannot_be_used_are_named() -> None:
    fast = ImpedanceControllerConfig(remedies=RemediesConfig(integral=IntegralConfig(rate=65.0)))
    with pytest.raises(ConfigurationError, match=r"remedies\.integral\.rate is 65 1/s; from"):
        check(fast)
    sizes = RemediesConfig(friction=FrictionConfig(coulomb=np.ones(5)))
    with pytest.raises(ConfigurationError, match=r"remedies\.friction\.coulomb.*6"):
        Remedies(model(), sizes, MotionControl(), 1e-3)
    with pytest.raises(SignalError, match="remedies:wrench"):
        told(everything(), np.nan, 0)
