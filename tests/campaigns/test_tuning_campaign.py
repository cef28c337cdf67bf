"""Tuning of an experiment: plans as written, runs that verify, and the worked example."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from runs import run

from geoimp_drake import cli
from geoimp_drake.analysis.contact_model import ContactModel
from geoimp_drake.analysis.encounter import contact_metrics
from geoimp_drake.analysis.tuning import Candidate, Constraint
from geoimp_drake.campaigns import tuning as campaign
from geoimp_drake.campaigns.tuning_plan import TuningPlan
from geoimp_drake.campaigns.tuning_run import with_gains
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.scenario.loading import read_layer

EXAMPLE = Path(__file__).parents[2] / "docs/validation/studies/tuned_plexiglas.yaml"
GIVEN_PEAK, WALL = 91.8, 10250.8  # of the chapter's gains [N], of the plexiglas [N/m]
# Four seconds of plexiglas, few evaluations.
QUICK = (
    *("--set", "segments.0.duration=2.5", "--set", "segments.1.duration=2"),
    *("--evaluations", "30", "--jobs", "1"),
)


@pytest.fixture(scope="module")
def example() -> tuple[dict[str, Any], Any, ContactModel]:
    """Log, scenario and model of the gains that a whole tuning found; D rests for 2 s, not 13."""
    gains = read_layer(EXAMPLE)["impedance"]["translation"]
    settings = [f"impedance.translation.{name}={value}" for name, value in gains.items()]
    settings.append("segments.1.duration=2")
    log, scenario, failure = run("plexiglas", *settings, "form=compiled")
    assert failure is None
    experiment = get_experiment("plexiglas")
    loop = experiment.build(experiment.scenario((), tuple(settings)), logged=False).loop
    return dict(log), scenario, ContactModel(loop, experiment.encounter(log, scenario, loop.step))


def test_tuned_plexiglas_presses_with_half_the_force_and_settles_before_d_rests(example) -> None:
    log, scenario, model = example
    experiment = get_experiment("plexiglas")
    force = experiment.contact_force(log, scenario)
    told = contact_metrics(log["t"], force, model.encounter.touch)
    assert told["peak_force"] <= 45.0 < 0.5 * GIVEN_PEAK
    assert model.encounter.touch + told["settling"] <= model.encounter.rest
    assert all(claim.holds is not False for claim in experiment.claims(log, scenario))
    modelled = model.metrics(model.given)
    assert modelled["peak_force"] == pytest.approx(told["peak_force"], rel=0.02)
    assert modelled["settling"] == pytest.approx(told["settling"], rel=0.02)


def test_tuned_plexiglas_does_not_ring_on_a_surface_five_times_as_stiff(example) -> None:
    _, _, model = example
    assert model.wall == pytest.approx(WALL, rel=1e-4)
    assert model.largest_surface_stiffness(model.given) > 5.0 * WALL


@pytest.fixture(scope="module")
def tuned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("tune") / "out"
    objectives = ("--minimize", "peak_force,settling")
    assert cli.main(["tune", "plexiglas", *QUICK, *objectives, "--out", str(out)]) == 0
    return out


def test_command_writes_a_scenario_that_does_what_it_says(tuned: Path) -> None:
    data = json.loads((tuned / "tuning.json").read_text())
    before, after = data["before"], data["after"]
    assert after["measured"]["peak_force"] < 0.8 * before["measured"]["peak_force"]
    assert not set(after["failed"]) - set(before["failed"])
    scenario = get_experiment("plexiglas").scenario((read_layer(tuned / "tuned.yaml"),))
    M, D, K = (gain[2, 2] for gain in scenario.impedance.gains("translation"))
    assert after["gains"] == pytest.approx({"M": M, "D": D, "K": K})
    assert scenario.segments[0].duration == 2.5
    log, again, _ = run("plexiglas", *_as_overrides(tuned / "tuned.yaml"))
    force = get_experiment("plexiglas").contact_force(dict(log), again)
    assert force.max() == pytest.approx(after["measured"]["peak_force"], rel=1e-9)


def _as_overrides(file: Path) -> list[str]:
    data = yaml.safe_load(file.read_text())
    return [f"{key}={json.dumps(data[key])}" for key in ("impedance", "segments", "form")]


def test_figures_and_front_of_several_objectives(tuned: Path) -> None:
    names = {path.name for path in tuned.iterdir()}
    assert {"tuning.png", "tuning.pdf", "front.png", "front.pdf", "runs.jsonl"} <= names
    front = json.loads((tuned / "tuning.json").read_text())["front"]
    values = np.array([[point["peak_force"], point["settling"]] for point in front])
    assert np.all(np.diff(values[:, 0]) > 0.0)
    assert np.all(np.diff(values[:, 1]) < 0.0)


class _Stiffer:
    """Runs of a plant that is not the model: its wall is thrice as stiff."""

    def __init__(self, tuning: Any) -> None:
        self.tuning, self.count = tuning, 0

    def run(self, many: Any) -> list[Candidate]:
        self.count += len(many)
        model = self.tuning.model
        return [self.tuning.judged(gains, [model.metrics(gains, 3.0 * WALL)]) for gains in many]


def test_search_goes_on_in_runs_where_the_rollout_is_wrong(example) -> None:
    """From the given gains, on a plant with another wall."""
    _, _, model = example
    tuning = campaign.Tuning(
        model, (model.wall,), ("peak_force",), (Constraint("settling", 2.6),), {"D": (40, 4000)}, 0
    )
    plant = _Stiffer(tuning)
    (start,) = plant.run([{"D": 2000.0}])
    found = campaign._searched(plant, start, lambda values: values[0] / GIVEN_PEAK, 24)
    assert found.values[0] < 0.9 * start.values[0]
    assert not found.broken
    assert plant.count - 1 == 24


def test_gains_that_a_design_gave_are_replaced_with_their_axes() -> None:
    experiment = get_experiment("plexiglas")
    design = {"natural_frequency": 9.0, "stiffness": [700.0, 500.0, 300.0]}
    layer = {"impedance": {"translation": {"design": design}}}
    given = experiment.scenario((layer,))
    data = with_gains(given, {"D": 0.5, "K": 2.0})
    M, D, K = experiment.scenario((data,)).impedance.gains("translation")
    before = given.impedance.gains("translation")
    np.testing.assert_allclose(M, before[0])
    np.testing.assert_allclose(D, 0.5 * before[1])
    np.testing.assert_allclose(K, 2.0 * before[2])


def test_plan_of_a_file_and_of_the_command_line_are_read_alike(tmp_path: Path) -> None:
    file = tmp_path / "plan.yaml"
    file.write_text(
        "minimize: [peak_force, settling]\nsubject_to: [settling<3]\nseed: 4\n"
        "surface_stiffness: 5e3:2e4\nvary: [D, 'M=1:20']\n"
    )
    plan = TuningPlan.read(file)
    assert plan == TuningPlan.read(
        minimize=["peak_force,settling"],
        subject_to=["settling < 3"],
        surface_stiffness="5e3:2e4",
        vary=["D,M=1:20"],
        seed=4,
    )
    assert plan.subject_to == (Constraint("settling", 3.0),)
    assert plan.vary == {"D": None, "M": (1.0, 20.0)}
    assert TuningPlan.read(file, seed=0).seed == 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--minimize", "peak_farce"], "objective 'peak_farce'. Did you mean 'peak_force'?"),
        (["--minimize", "largest_surface_stiffness"], "Valid: peak_force, settling, steady_force"),
        (["--subject-to", "settling=3"], "'settling=3' is not of the form NAME<NUMBER"),
        (["--subject-to", "settling<soon"], "'soon' in 'settling<soon' is not a number"),
        (["--subject-to", "settling<-1"], "number in 'settling<-1' is -1; it must be positive"),
        (["--subject-to", "sattling<3"], "Did you mean 'settling'?"),
        (["--subject-to", "largest_surface_stiffness<1e4"], "asks for ringing"),
        (["--vary", "B"], "Unknown gain to vary 'B'. Valid: D, K, M."),
        (["--vary", "D=900:100"], "900:100 is from high to low; give LOW:HIGH"),
        (["--vary", "D=0:100"], "number in '0:100' is 0; it must be positive"),
        (["--vary", "D=5:5"], "D=5:5 leaves nothing to vary"),
        (["--vary", "D="], "'' in '' is not a number"),
        (["--vary", ","], "Nothing is minimized or varied"),
        (["--surface-stiffness", "2e4:5e3"], "2e4:5e3 is from high to low"),
        (["--surface-stiffness", "soft"], "'soft' in 'soft' is not a number"),
        (["--evaluations", "0"], "evaluations is 0"),
        (["--jobs", "0"], "jobs is 0"),
        (["--scheme", "x"], "unrecognized arguments"),
    ],
)
def test_bad_input_gets_one_line_before_anything_runs(arguments, said, capsys, tmp_path) -> None:
    out = tmp_path / "out"
    try:
        status = cli.main(["tune", "plexiglas", *arguments, "--out", str(out)])
    except SystemExit as end:
        status = end.code
    text = capsys.readouterr().err
    assert status == 2
    assert said in text
    assert text.count("\n") == 1
    assert not out.exists()


def test_what_has_no_wall_is_said(capsys, tmp_path) -> None:
    quick = ["--duration", "0.05", "--out", str(tmp_path / "out")]
    assert cli.main(["tune", "consistency", *quick]) == 2
    assert "consistency has no surface that the hand meets" in capsys.readouterr().err
    assert cli.main(["tune", "plexiglas", *quick]) == 2
    assert "mm behind the wall, at rest for" in capsys.readouterr().err


def test_constraint_that_nothing_keeps_is_said_with_what_comes_nearest(capsys, tmp_path) -> None:
    out = tmp_path / "out"
    never = ("--subject-to", "settling<0.01", "--evaluations", "8", "--vary", "D=100:4000")
    assert cli.main(["tune", "plexiglas", *QUICK, *never, "--out", str(out)]) == 2
    text = capsys.readouterr().err
    assert "No gains within D=100:4000 keep settling < 0.01 s, largest_surface_stiffness >" in text
    assert "Loosen a constraint, or widen --vary." in text
    assert not out.exists()
