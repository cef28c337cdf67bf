"""An experiment of one's own: a commented file to begin with, and a run without Python."""

import json

import pytest
import yaml
from library_tree import ROOT

from geoimp_drake.cli import main
from geoimp_drake.controllers.config import FORMS
from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS, OWN, get_experiment
from geoimp_drake.scenario.loading import plain_data
from geoimp_drake.scenario.template import commented_yaml


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_the_commented_file_is_the_scenario(name):
    experiment = get_experiment(name)
    scenario = experiment.scenario()
    text = commented_yaml(scenario)
    assert yaml.safe_load(text) == plain_data(scenario)
    own = OWN[experiment.setup]
    again = own.scenario((yaml.safe_load(text) | {"experiment": own.name},))
    assert plain_data(again) | {"experiment": name} == plain_data(scenario)


def test_every_key_of_the_library_is_explained_where_its_field_is():
    text = commented_yaml(get_experiment("plexiglas").scenario())
    assert "    damping: 2000.0 # D_p [Ns/m]" in text.splitlines()
    assert "duration: null # [s]; all of the motion if not given" in text.splitlines()
    assert text.count(" # ") > 40


def test_the_file_is_run_by_its_name_alone(tmp_path, capsys):
    file = tmp_path / "mine.yaml"
    assert main(["init", str(file), "--from", "plexiglas"]) == 0
    text = file.read_text().replace("stiffness: 700.0", "stiffness: 900.0")
    file.write_text(text)
    out = tmp_path / "out"
    short = ["--duration", "0.02", "--set", "sensor.moment_range=.inf", "--out", str(out)]
    assert main(["run", "--scenario", str(file), *short]) == 0
    assert yaml.safe_load((out / "scenario.yaml").read_text())["experiment"] == "custom"
    assert "stiffness: 900" in (out / "scenario.yaml").read_text()
    assert (out / "custom.png").exists()
    metrics = json.loads((out / "metrics.json").read_text())
    assert [claim["holds"] for claim in metrics["claims"]] == [*[None] * 5, True, None]
    # A sensor that measures whatever comes bounds nothing.
    assert metrics["claims"][-1]["bound"] is None
    assert metrics["claims"][-1]["value"] is not None
    assert capsys.readouterr().out.count("reported") == 1


LIGHT7 = ROOT / "tests" / "robot_files" / "cases" / "light7.urdf"
LIGHT = f"""
experiment: custom
arm: light
robot: {{ file: {LIGHT7}, end_effector: l7, geometry: leave-out }}
start: {{ posture: [0.3, 0.6, 0.2, 1.2, 0.1, 0.8, 0.0] }}
duration: 2.0
sensor: {{ inertial_load: plant }}
"""


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("K_n", [0.0, 20.0])
def test_a_light_arm_rests_by_default_and_tells_of_a_gain_that_is_too_large(
    K_n, form, tmp_path, caplog
):
    """K_n = 20 Nms/rad is that of the chapter's arm; 1.5e-2 kg m² of this one answer it."""
    file, out = tmp_path / "light.yaml", tmp_path / "out"
    file.write_text(LIGHT + f"form: {form}\nredundancy: {{ K_n: {K_n} }}\n")
    assert main(["run", "--scenario", str(file), "--out", str(out), "--no-figures"]) == 0
    warnings = [r.getMessage() for r in caplog.records if "K_n" in r.getMessage()]
    claims = json.loads((out / "metrics.json").read_text())["claims"]
    (speed,) = [claim for claim in claims if "joint speed of light" in claim["claim"]]
    if K_n:
        (warning,) = warnings
        assert "t = 0.000 s" in warning
        assert "in this posture that is 2.59" in warning
        assert speed["holds"] is False
    else:
        assert not warnings
        assert speed["value"] < 1e-9
        assert speed["holds"]


@pytest.mark.parametrize("name", ["peg_in_hole", "bar"])
def test_the_cooperations_too(name, tmp_path):
    file = tmp_path / "mine.yaml"
    assert main(["init", str(file), "--from", name]) == 0
    out = tmp_path / "out"
    assert main(["run", "--scenario", str(file), "--duration", "0.02", "--out", str(out)]) == 0
    assert (out / "custom.png").exists()


def refused(arguments, capsys) -> str:
    assert main(arguments) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    return lines[0]


def test_an_unknown_key_is_refused_with_the_nearest_valid_name(tmp_path, capsys):
    file = tmp_path / "mine.yaml"
    main(["init", str(file)])
    file.write_text(file.read_text().replace("    damping: 2000.0", "    dampin: 2000.0"))
    message = refused(["run", "--scenario", str(file), "--out", str(tmp_path / "out")], capsys)
    assert "'dampin'. Did you mean 'damping'?" in message
    assert not (tmp_path / "out").exists()


def test_a_file_that_is_there_is_not_touched(tmp_path, capsys):
    file = tmp_path / "mine.yaml"
    file.write_text("precious: 1\n")
    assert "mine.yaml is there already" in refused(["init", str(file)], capsys)
    assert file.read_text() == "precious: 1\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run"], "Name an experiment"),
        (["init", "x.yaml", "--from", "plexiglass"], "Did you mean 'plexiglas'"),
        (["init", "nowhere/x.yaml"], "cannot be written"),
    ],
)
def test_what_is_missing_is_said(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert message in refused(arguments, capsys)
    assert not list(tmp_path.iterdir())


def test_a_file_without_experiment_says_how_to_name_one(tmp_path, capsys):
    file = tmp_path / "mine.yaml"
    file.write_text("seed: 1\n")
    assert "does not name its experiment" in refused(["run", "--scenario", str(file)], capsys)
