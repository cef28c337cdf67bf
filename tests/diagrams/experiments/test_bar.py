"""Tight cooperation on the real plant: two hands, one bar, and a squeeze that stays bounded."""

import dataclasses

import numpy as np
import pytest
from runs import assert_all_hold, claims_of, norm, run

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.diagrams.experiments.bar import internal_wrench
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.experiments.contrasts import CONTRASTS
from geoimp_drake.diagrams.setups.tight import build_tight
from geoimp_drake.diagrams.setups.tight_scenario import ARMS
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.cooperation.grasp_watch import watch_grasps
from geoimp_drake.parts.grasp_watch import GraspMonitorConfig
from geoimp_drake.simulation.run import simulate
from geoimp_drake.systems.frame_motion import POSITION

FORCE = slice(3, 6)
RIGID_HANDS = "internal.enabled=false"
# In the air, where the squeeze of a wrong grasp is all there at once, and in contact.
SHORT = "duration=1.0"
CONTACT = "duration=10", "form=compiled"
WRONG = {
    "squeeze": ("grasp.squeeze=[0, -40, 0]",),
    "grasp along y": (
        "assumed.prescribed=true",
        "assumed.grasp_offset=[0, 0.002, 0]",
        "assumed.grasp_rotation_deg=[0, 0.5, 0]",
    ),
    "grasp along z": (
        "assumed.prescribed=true",
        "assumed.grasp_offset=[0, 0, 0.002]",
        "assumed.grasp_rotation_deg=[0, 0, 0.5]",
    ),
    "base along x": ("assumed.prescribed=true", "assumed.base_offset=[0.005, 0, 0]"),
    "base along y": ("assumed.prescribed=true", "assumed.base_offset=[0, 0.005, 0]"),
    "base along z": ("assumed.prescribed=true", "assumed.base_offset=[0, 0, 0.005]"),
}


def squeeze(*overrides: str) -> np.ndarray:
    """Returns the norm of the true internal force over time [N]."""
    log, _, failure = run("bar", *overrides)
    assert failure is None
    return np.linalg.norm(internal_wrench(dict(log))[:, FORCE], axis=1)


def steady(values: np.ndarray) -> float:
    return float(values[-10:].mean())


def test_every_claim_holds():
    claims = claims_of("bar")
    assert_all_hold(claims)
    assert len(claims) == 14


def test_neither_hand_pulls_at_the_other_at_the_start():
    assert squeeze(SHORT)[1] < 1.0


@pytest.mark.parametrize("case", WRONG)
def test_the_internal_impedance_bounds_the_squeeze(case):
    """Steady values without it: 159 N for the base along y, 40 N as given, 11 to 15 N else."""
    stiff, compliant = squeeze(SHORT, RIGID_HANDS, *WRONG[case]), squeeze(SHORT, *WRONG[case])
    assert steady(stiff) > 10.0
    assert steady(compliant) < 12.0
    assert steady(compliant) < steady(stiff) / (3.0 if steady(stiff) > 20.0 else 2.0)
    # A preload is there before anybody can give way.
    assert case == "squeeze" or compliant.max() < 30.0


def test_the_monitor_is_silent_whatever_the_seed_of_the_noise():
    """The wrenches of a run through contact, with the noise of 200 sensors added to each sample."""
    log, _, failure = run("bar", *CONTACT, "log_period=0.001")
    assert failure is None
    hands = [log[f"{arm}/wrench_true"] for arm in ARMS]
    # [Nm], [N]; a force's noise has up to 0.3 m of lever from the sensor to E.
    spread = np.repeat([0.0025 + 0.3 * 0.03, 0.03], 3)
    for seed in range(200):
        noise = np.random.default_rng(seed).normal(size=(2, *hands[0].shape)) * spread
        assert not opened_in(*(h + e for h, e in zip(hands, noise, strict=True)))
    # The same wrenches with nothing left from the middle of the contact on.
    middle = len(hands[0]) * 3 // 4
    for k in range(2):
        let_go = [h.copy() for h in hands]
        let_go[k][middle:] = 0.0
        assert opened_in(*let_go)


def opened_in(first: np.ndarray, second: np.ndarray) -> bool:
    """Whether the monitor with its default thresholds would report a hand."""
    times, opened = np.array([np.inf, np.inf, 0, 0]), np.zeros(2)
    compiled(watch_all)(first, second, *GraspMonitorConfig().arrays(), times, opened)
    return opened.any()


def watch_all(first, second, thresholds, limits, times, opened):
    for k in range(len(first)):
        watch_grasps(first[k], second[k], times.copy(), thresholds, limits, 1e-3, times, opened)
        if opened[0] + opened[1] > 0:
            return


def test_claims_across_squeezed_runs_compare_the_last_second():
    """The runs end in the air, where the internal force can be judged, but the contact cannot."""
    runs = {
        name: run("bar", SHORT, *settings, *WRONG["squeeze"])[:2]
        for name, settings in {"squeezed": (), "squeezed-rigid-hands": (RIGID_HANDS,)}.items()
    }
    early = CONTRASTS["bar"].claims(runs)
    assert [claim.holds for claim in early] == [None, None]
    ended = {
        name: (log, dataclasses.replace(scenario, segments=[]))
        for name, (log, scenario) in runs.items()
    }
    assert CONTRASTS["bar"].claims(ended)[0].holds


@pytest.mark.parametrize("case", ["squeeze", "base along y"])
def test_the_object_does_not_feel_the_internal_impedance(case):
    """Wrench and displacement of the object at rest change by less than 3 %."""
    log, _, _ = run("bar", *CONTACT, *WRONG[case])
    other, _, _ = run("bar", *CONTACT, RIGID_HANDS, *WRONG[case])
    force = log["object/wrench"][-1, FORCE] - other["object/wrench"][-1, FORCE]
    assert np.linalg.norm(force) < 0.03 * np.linalg.norm(log["object/wrench"][-1, FORCE])
    displacement = [
        (one["object/motion_D"] - one["object/motion_C"])[-1, POSITION] for one in (log, other)
    ]
    difference = np.linalg.norm(displacement[0] - displacement[1])
    assert difference < 0.03 * np.linalg.norm(displacement[0])


def test_an_opened_grasp_is_seen_and_both_hands_stay():
    claims = claims_of("bar", "release=6.5", "duration=8", "monitor.enabled=true")
    assert_all_hold(claims)
    assert len(claims) == 3


def test_unseen_the_open_grasp_sets_the_hands_moving():
    """The impedance goes on with half of the wrench; held hands stay within a millimetre."""
    moved = {}
    for enabled in ("true", "false"):
        log, _, _ = run("bar", "release=6.5", "duration=8", f"monitor.enabled={enabled}")
        hand = log["seven/motion_E"][log["t"] >= 6.49, POSITION]
        moved[enabled] = np.linalg.norm(hand - hand[0], axis=1).max()
    assert moved["true"] < 1e-3
    assert moved["false"] > 2.5e-3


def test_the_monitor_is_silent_without_a_fault():
    log, _, _ = run("bar")
    assert (log["grasp/opened"][:, :2] == 0).all()


def test_a_rigid_grasp_works_too():
    log, _, failure = run("bar", "grasp.kind=rigid", SHORT)
    assert failure is None
    assert norm(log, "object/wrench", FORCE)[-1] < 2.0


def test_a_second_simulation_of_the_same_setup_starts_anew():
    """The grasp opens in the context: the next run of the diagram has it closed again."""
    scenario = get_experiment("bar").scenario((), ("release=0.05", "duration=0.1"))
    setup = build_tight(scenario)
    first = simulate(setup.diagram, scenario.simulator, 0.1, events=setup.events)
    again = simulate(setup.diagram, scenario.simulator, 0.1, events=setup.events)
    logs = [setup.recorder.collect(outcome.context) for outcome in (first, again)]
    for key, value in logs[0].items():
        np.testing.assert_array_equal(value, logs[1][key])


BAD = {
    "carrier=eight": "carrier 'eight'.*seven, six",
    "grasp.kind=glue": "grasp.kind 'glue'.*bushing, rigid",
    "grasp.squeeze=[1, 2]": "grasp.squeeze",
    "bar.stick=0.02": "bar.stick is 0.02",
    "release=-1": "release is -1",
    "centre=[0, 1.7, 0.6]": "inside the surface; move centre",
    "centre=[0, 4.0, 0.95]": "No posture",
    "guesses.eight=[0]": "eight",
    "internal.translation.damping=2.0e4": "internal.translation.damping",
    "assumed.grasp_offset=[.nan, 0, 0]": "assumed.grasp_offset",
    "wrench=sum": "wrench 'sum'.*grasp-matrix, printed",
}


@pytest.mark.parametrize(("override", "message"), BAD.items())
def test_what_cannot_be_used_is_named(override, message):
    with pytest.raises(ConfigurationError, match=message):
        build_tight(get_experiment("bar").scenario((), (override, "duration=0.01")))


def test_a_grasp_that_cannot_be_opened_is_refused():
    with pytest.raises(ConfigurationError, match="only a bushing can be opened"):
        get_experiment("bar").scenario((), ("release=1", "grasp.kind=rigid"))
