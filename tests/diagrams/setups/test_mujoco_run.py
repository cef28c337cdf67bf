"""Experiments in MuJoCo: the same log, claims and numbers as in Drake, or one line why not."""

import numpy as np
import pytest

from geoimp_drake import cli
from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS
from geoimp_drake.diagrams.experiments.simulators import SIMULATORS
from geoimp_drake.diagrams.setups.mujoco_run import MUJOCO_EXPERIMENTS
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.simulation.experiment import run_experiment
from geoimp_drake.simulation.log_data import read_log

# The disk begins 8 cm above the surface, and is in contact at rest for the last second.
PRESS = (
    "start.position=[0.9, 0.0, 0.6]",
    "segments=[{name: press, duration: 2.0, displacement: [0, 0, -0.14]}, "
    "{name: hold, duration: 2.5}]",
)
TURN = ("segments=[{name: rest, duration: 1.2}]",)
SHORT = {"plexiglas": PRESS, "consistency": TURN, "nondiagonal": TURN}
FAMILY = {
    "plexiglas": "quaternion",
    "consistency": "classical-euler",
    "nondiagonal": "alternative-euler",
}


def short(name: str, *overrides: str):
    return EXPERIMENTS[name].scenario(
        (), (*SHORT[name], f"impedance.orientation={FAMILY[name]}", *overrides)
    )


@pytest.fixture(scope="module", params=MUJOCO_EXPERIMENTS)
def runs(request, tmp_path_factory):
    """Name, and of both simulators log, scenario and folder."""
    name, both = request.param, {}
    for engine in ("drake", "mujoco"):
        scenario, out = short(name, f"engine={engine}"), tmp_path_factory.mktemp(engine)
        result = run_experiment(EXPERIMENTS[name], scenario, out, figures=False)
        assert result.failure is None
        both[engine] = result.log, scenario, out
    return name, both


def test_both_simulators_agree(runs):
    name, both = runs
    claims = SIMULATORS[name].claims({engine: run[:2] for engine, run in both.items()})
    assert len(claims) >= 2
    assert [(claim.claim, claim.value_text) for claim in claims if not claim.holds] == []


def test_the_log_is_a_run_s(runs):
    _, both = runs
    (drake, *_), (mujoco, _, out) = both["drake"], both["mujoco"]
    assert {key: value.shape for key, value in mujoco.items()} == {
        key: value.shape for key, value in drake.items()
    }
    assert np.abs(mujoco["t"] - drake["t"]).max() < 1e-9
    assert np.array_equal(mujoco["six/motion_D"][0], drake["six/motion_D"][0])
    assert {path.name for path in out.iterdir()} == {"log.npz", "scenario.yaml", "metrics.json"}
    assert "\nengine: mujoco\n" in (out / "scenario.yaml").read_text("utf-8")
    assert '"mujoco": ' in (out / "metrics.json").read_text("utf-8")
    assert read_log(out / "log.npz").keys() == mujoco.keys()


def test_it_is_not_drake_under_another_name(runs):
    _, both = runs
    assert not np.array_equal(both["mujoco"][0]["six/q"], both["drake"][0]["six/q"])


def run(*arguments) -> int:
    try:
        return cli.main(["run", *map(str, arguments)])
    except SystemExit as stop:
        return int(stop.code or 0)


def test_remedies_act_there_too_and_are_in_the_log(tmp_path):
    """The plant is as the model knows it, so the integral has little to do; still it acts."""
    logs = []
    for settings in ((), ("remedies.integral.rate=2.0",)):
        scenario = short("plexiglas", "engine=mujoco", "duration=0.3", *settings)
        out = tmp_path / str(len(logs))
        logs.append(run_experiment(EXPERIMENTS["plexiglas"], scenario, out, figures=False).log)
    usual, remedied = logs
    assert remedied.keys() - usual.keys() == {"six/compensation"}
    assert 1e-6 < np.abs(remedied["six/compensation"]).max() < 5.0
    assert not np.array_equal(remedied["six/u"], usual["six/u"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("bar",), "MuJoCo runs plexiglas, consistency, nondiagonal, not 'bar'"),
        (("limits",), "MuJoCo runs plexiglas, consistency, nondiagonal, not 'limits'"),
        (("plexiglas", "--set", "world.links.mass=1.1"), "gives world, for Drake alone"),
        (("plexiglas", "--set", "scheme=admittance"), "gives scheme, for Drake alone"),
        (("plexiglas", "--set", "sampling.period=0.002"), "must be plant.time_step, 0.001 s"),
        (("plexiglas", "--meshcat"), "give --html instead of --meshcat"),
        (("worlds",), "--simulator"),
    ],
)
def test_what_mujoco_does_not_run_is_told_in_a_line(arguments, message, tmp_path, capsys):
    out = tmp_path / "out"
    assert run(*arguments, "--simulator", "mujoco", "--out", out) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not out.exists()


def test_an_unknown_simulator_is_told_with_the_valid_ones(tmp_path, capsys):
    assert run("plexiglas", "--simulator", "xyz", "--out", tmp_path / "out") == 2
    assert "'xyz'. Valid: drake, mujoco." in capsys.readouterr().err


def test_only_runs_are_in_mujoco():
    with pytest.raises(ConfigurationError, match="engine is 'mujoco', which only geoimp run"):
        EXPERIMENTS["consistency"].build(short("consistency", "engine=mujoco"))
