"""The command line: exit status, one clear line for unusable input, and what a run leaves."""

import json
import logging
import os
import re
import signal
import sys
from subprocess import PIPE, Popen

import numpy as np
import pytest
import yaml
from library_tree import PYPROJECT

from geoimp_drake import cli
from geoimp_drake.cli import commands

SHORT = ("run", "plexiglas", "--duration", "0.05", "--no-figures")


def run(*arguments: str) -> int:
    try:
        return cli.main(arguments)
    except SystemExit as stop:
        return int(stop.code or 0)


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out"


def test_list_names_every_experiment(capsys):
    assert run("list") == 0
    assert re.search(r"^plexiglas +\S", capsys.readouterr().out, re.MULTILINE)


def test_a_run_leaves_the_files_of_the_contract(out):
    assert run("run", "plexiglas", "--duration", "0.05", "--out", str(out)) == 0
    assert {path.name for path in out.iterdir()} == {
        "log.npz",
        "scenario.yaml",
        "metrics.json",
        "figure_5_3.png",
        "figure_5_3.pdf",
        "energy_audit.png",
        "energy_audit.pdf",
    }
    assert (out / "figure_5_3.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "figure_5_3.pdf").read_bytes().startswith(b"%PDF")


def test_the_log_has_the_keys_and_shapes_of_the_contract(out):
    assert run(*SHORT, "--out", str(out)) == 0
    log = np.load(out / "log.npz")
    shapes = {
        "t": (6,),
        "six/q": (6, 6),
        "six/v": (6, 6),
        "six/u": (6, 6),
        "six/prismatic": (6,),
        "six/motion_E": (6, 19),
        "six/motion_D": (6, 19),
        "six/motion_C": (6, 19),
        "six/wrench": (6, 6),
        "six/wrench_true": (6, 6),
        "six/energy": (6, 9),
        "six/limited": (6, 10),
        "surface/plane": (4,),
        "surface/disk": (3,),
    }
    assert {key: log[key].shape for key in log.files} == shapes
    np.testing.assert_allclose(log["t"], np.arange(6) * 0.01, atol=1e-12)
    np.testing.assert_allclose(log["surface/plane"], [0, 0, 1, 0.52], atol=1e-12)


def test_the_resolved_scenario_gives_the_same_log_to_the_bit(out, tmp_path):
    noise = ("--set", "sensor.force_noise=0.1", "--seed", "7")
    assert run(*SHORT, *noise, "--out", str(out)) == 0
    again = tmp_path / "again"
    resolved = ("run", "plexiglas", "--no-figures", "--scenario", str(out / "scenario.yaml"))
    assert run(*resolved, "--out", str(again)) == 0
    first, second = np.load(out / "log.npz"), np.load(again / "log.npz")
    assert first.files == second.files
    for key in first.files:
        assert first[key].tobytes() == second[key].tobytes(), key
    other = tmp_path / "other"
    assert run(*resolved, "--seed", "8", "--out", str(other)) == 0
    third = tmp_path / "third"
    assert run(*resolved, "--set", "sensor.seed=1", "--out", str(third)) == 0
    one_more, in_sum = (np.load(folder / "log.npz")["six/wrench"] for folder in (other, third))
    assert in_sum.tobytes() == one_more.tobytes()


def test_claims_that_a_short_run_cannot_judge_are_neither_true_nor_false(out):
    assert run(*SHORT, "--out", str(out)) == 0
    claims = json.loads((out / "metrics.json").read_text())["claims"]
    assert {claim["holds"] for claim in claims} == {None, True}
    assert all((claim["value"] is None) == (claim["holds"] is None) for claim in claims)


def test_options_reach_the_scenario(out, tmp_path):
    layer = tmp_path / "mine.yaml"
    layer.write_text("surface: {properties: {friction: 0.1}}\nseed: 3\n")
    options = ("--set", "segments.0.duration=6.5", "--orientation", "alternative-euler")
    assert run(*SHORT, *options, "--scenario", str(layer), "--out", str(out)) == 0
    scenario = yaml.safe_load((out / "scenario.yaml").read_text())
    assert scenario["segments"][0]["duration"] == 6.5
    assert scenario["impedance"]["orientation"] == "alternative-euler"
    assert scenario["motion"]["orientation"] == "quaternion"
    assert scenario["surface"]["properties"]["friction"] == 0.1
    assert (scenario["seed"], scenario["sensor"]["seed"]) == (3, 0)


BAD_SETTINGS = {
    "impedance.translation.stiffness=-1": "translation.stiffness.*eigenvalue is -1",
    "impedance.translation.mass=[1,2]": r"translation.mass.*shape \(2,\)",
    "impedance.rotation.damping=[[1,2,0],[0,1,0],[0,0,1]]": "damping.*not symmetric.*2",
    "impedance.rotation.stiffness=.nan": "rotation.stiffness.*nan",
    "motion.K_Pp=.inf": "K_Pp.*inf",
    "motion.K_Do=-3": "K_Do.*-3",
    "motion.orientation=euler": "euler.*Valid: .*quaternion",
    "sampling.velocity=guessed": "guessed.*differenced",
    "sampling.period=0": "sampling.period.*0",
    "sampling.period=1": r"sampling.period is 1 s.* at least every 1/K_Dp = 0.0154 s",
    "sensor.period=1": r"sensor.period is 1 s.*√\(M/K\) = 0.113 s.*1/K_D = 0.0154 s",
    "plant.time_step=0.002": r"sampling.period is 0.001 s and the plant's time step 0.002 s",
    "impedance.axes=neither": "neither.*rotation",
    "start.position=[2.5, 0, 0.7]": "No posture within the joint limits.*2.5",
    "start.position=[0.9, 0, 0.5]": r"starts .* mm inside the surface",
    "start.posture=[0, 0, 0, 0, 3, 0]": "wrist_pitch at 3.0000, allowed",
    "start.posture=[0, 0, 0]": "start.posture.*6",
    "start.tilt_axis=[0, 0, 0]": "tilt_axis",
    "surface.properties.friction=-0.1": "friction.*-0.1",
    "surface.normal=[0, 0, 0]": "surface.normal",
    "surface.point=[0.9, .nan, 0.5]": "surface.point.*nan",
    "sensor.force_range=0": "force_range.*0",
    "sensor.inertial_load=all": "all.*reference",
    "segments.0.duration=-7": "segments.0.*duration.*-7",
    "segments.0.duration=.nan": "segments.0.*duration.*nan",
    "segments.².duration=1": "segments has 2 entries; '²' is none of them",
    "disk_resolution_hint=1e-9": "would have 3.45575e.08 sides, at most 360 are computed",
    "segments.5.duration=1": "segments has 2 entries",
    "segments.0.displacement=[1, 2]": "displacement.*3 finite",
    "log_period=0": "log_period",
    "log_period=often": "log_period is 'often'; give a number",
    "seed=-1": "seed is -1",
    "duration=1e9": r"1e\+12 steps of 0.001 s and 1e\+11 rows of log, about 2e\+05 GB; at most",
    "sampling.period=1e-12": r"5e\+10 steps of 1e-12 s",
    "simulator.max_step_size=1e-12": r"5e\+10 steps of 1e-12 s",
    "sede=1": "Unknown key in the scenario 'sede'. Did you mean 'seed'.*Valid: .*surface",
    "impedence.axes=both": "impedence.*Did you mean 'impedance'",
    "impedance=3": "impedance must be a mapping",
    "seed": "key.path=value",
    "seed=[": "not YAML",
    "arm=eight": "eight.*six",
    "log_period=1e-4": "log_period is 0.0001.*plant.time_step, 0.001",
    "plant.time_step=-1": "plant.time_step is -1",
    "plant.time_step=0": "plant.time_step is 0, a continuous plant, .*'point'",
    "plant.contact_model=soft": "Unknown plant.contact_model 'soft'.*Valid: hydroelastic",
    "plant.discrete_contact_approximation=exact": "exact.*Valid: lagged, sap",
    "plant.contact_surface_representation=square": "square.*Valid: polygon",
    "plant.penetration_allowance=-1": "plant.penetration_allowance is -1",
    "plant.stiction_tolerance=0": "plant.stiction_tolerance is 0",
    "plant.sap_near_rigid_threshold=-1": "plant.sap_near_rigid_threshold is -1",
    "simulator.integration_scheme=euler": "euler.*Valid: .*runge_kutta2",
    "simulator.max_step_size=0": "simulator.max_step_size is 0",
    "simulator.accuracy=.nan": "simulator.accuracy is nan",
    "simulator.target_realtime_rate=-1": "simulator.target_realtime_rate is -1",
    "simulator.start_time=5": "simulator.start_time is 5",
}


@pytest.mark.parametrize("setting", BAD_SETTINGS)
def test_a_bad_setting_gets_one_clear_line_and_writes_nothing(setting, out, capsys):
    assert run(*SHORT, "--out", str(out), "--set", setting) == 2
    error = capsys.readouterr().err
    assert re.search(BAD_SETTINGS[setting], error), error
    assert error.startswith("geoimp: ")
    assert error.count("\n") == 1
    assert "Traceback" not in error
    assert not out.exists()


BAD_FILES = {
    b"seed: [1": "is not YAML",
    b"- 1\n- 2\n": "holds list; a scenario is a mapping",
    b"": "holds nothing",
    b"\xff\xfe\x00": "cannot be read|is not YAML",
    b"unknown: 1\n": "Unknown key in the scenario 'unknown'",
    b"impedance: {translation: {stifness: 1}}\n": "Did you mean 'stiffness'",
    b"segments: fast\n": "segments must be a list",
    b"seed: 1\nlog_period: 0.1\nseed: 2\n": "bad.yaml, line 3: 'seed' is in line 1 already",
    b"seed: 010\n": "seed is '010'",
    b"log_period: 0:30\n": "log_period is '0:30'",
    b"x" * 1_000_001: "bad.yaml has 1 MB; at most 1 MB are read",
}


@pytest.mark.parametrize("content", BAD_FILES)
def test_a_bad_scenario_file_gets_one_clear_line(content, out, tmp_path, capsys):
    file = tmp_path / "bad.yaml"
    file.write_bytes(content)
    assert run(*SHORT, "--out", str(out), "--scenario", str(file)) == 2
    error = capsys.readouterr().err
    assert re.search(BAD_FILES[content], error), error
    assert error.count("\n") == 1
    assert not out.exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("run", "plexiglass"), "Unknown experiment 'plexiglass'. Did you mean 'plexiglas'"),
        (("run", "plexiglas", "--orientation", "euler"), "Valid: .*alternative-euler"),
        (("run", "plexiglas", "--duration", "-1"), "duration is -1"),
        (("run", "plexiglas", "--duration", "soon"), "--duration: invalid float value: 'soon'"),
        (("run", "plexiglas", "--scenario", "missing.yaml"), "missing.yaml cannot be read"),
        (("run", "plexiglas", "--host", "localhost"), "give --meshcat as well"),
        (("run", "plexiglas", "--html", "--host", "localhost"), "give --meshcat as well"),
        (("run", "plexiglas", "--meshcat", "--host", "no host"), "cannot listen at no host: "),
        (("run",), "Name an experiment that `geoimp list` shows"),
        (("compare", "custom"), "Unknown experiment to compare families of 'custom'.*Valid: bar"),
        (("run", "a\nb\x1b[2J"), r"Unknown experiment 'a\\nb\\x1b\[2J'"),
        (("run", "plexiglas", "--duration", "1e7"), r"1e\+10 steps of 0.001 s"),
        (("run", "plexiglas", "--seed", str(2**200)), "seed is '1606.*' ?; give a whole number"),
        (("run", "bar", "--duration", "x" * 10**5), "invalid float value: 'xxx+ … xxx+'"),
        (("walk",), "invalid choice: 'walk'"),
    ],
)
def test_unusable_arguments_end_with_status_2_and_one_line(arguments, message, capsys):
    assert run(*arguments) == 2
    error = capsys.readouterr().err
    assert re.search(message, error), error
    assert error.count("\n") == 1


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_to_end_is_an_interrupt_with_its_name(number, capsys, monkeypatch):
    cleared = []
    before = signal.signal(number, signal.SIG_DFL)  # it may be ignored, as below

    def command(_) -> int:
        try:
            os.kill(os.getpid(), number)
        finally:
            os.kill(os.getpid(), number)  # once more does not disturb the clearing up
            cleared.append(True)
        return 0

    monkeypatch.setattr(commands, "list_experiments", command)
    assert run("list") == 1
    assert capsys.readouterr().err == f"geoimp: interrupted by {number.name}\n"
    assert cleared
    assert signal.getsignal(number) == signal.SIG_DFL
    signal.signal(number, before)


def test_a_signal_that_is_ignored_stays_so(monkeypatch):
    monkeypatch.setattr(
        commands, "list_experiments", lambda _: os.kill(os.getpid(), signal.SIGHUP) or 0
    )
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does
    try:
        assert run("list") == 0
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_compare_runs_each_family_and_draws_them_together(out, capsys):
    families = ("quaternion", "alternative-euler", "angle-axis-simple")
    short = ("compare", "consistency", "--duration", "0.05", "--out", str(out))
    assert run(*short, "--orientation", *families) == 0
    compared = {f"comparison.{kind}" for kind in ("json", "pdf", "png")}
    assert {path.name for path in out.iterdir()} == {*families, *compared}
    assert all((out / family / "metrics.json").exists() for family in families)
    printed = capsys.readouterr().out
    assert all(f"{family}\nclaim" in printed for family in families)


def test_compare_refuses_an_unknown_family_before_it_writes(out, capsys):
    short = ("compare", "consistency", "--duration", "0.05", "--out", str(out))
    assert run(*short, "--orientation", "quaternion", "euler") == 2
    assert re.search("Unknown impedance.orientation 'euler'.*Valid: ", capsys.readouterr().err)
    assert not out.exists()


@pytest.mark.parametrize("name", ["singularity", "consistency", "nondiagonal", "redundancy"])
def test_every_other_experiment_runs_and_leaves_its_figures(name, out):
    assert run("run", name, "--duration", "0.02", "--out", str(out)) == 0
    assert list(out.glob("figure_5_*.png"))
    assert (out / "metrics.json").exists()


@pytest.mark.parametrize("scheme", ["runge_kutta2", "runge_kutta3"])
def test_the_integrator_of_the_scenario_is_the_one_that_runs(scheme, out, tmp_path):
    setting = f"simulator.integration_scheme={scheme}"
    assert run(*SHORT, "--duration", "0.3", "--out", str(out)) == 0
    assert run(*SHORT, "--duration", "0.3", "--out", str(tmp_path / "o"), "--set", setting) == 0
    first, other = np.load(out / "log.npz"), np.load(tmp_path / "o" / "log.npz")
    difference = np.abs(first["six/motion_C"][:, :7] - other["six/motion_C"][:, :7]).max()
    assert 0.0 < difference < 1e-5


def test_a_run_that_cannot_start_gets_one_clear_line_and_writes_nothing(out, capsys):
    upright = ("--set", "start.attitude_deg=[0, 89.99, 0]", "--orientation", "classical-euler")
    assert run("run", "singularity", *upright, "--duration", "0.05", "--out", str(out)) == 2
    error = capsys.readouterr().err
    assert re.fullmatch(r"geoimp: .*classical-euler.*cos.*\n", error), error
    assert not out.exists()


def test_what_is_reported_while_a_run_goes_on_is_seen_on_the_terminal(out, capsys):
    # The noise alone leaves a range as narrow as this.
    narrow = ("--set", "sensor.force_range=1e-6", "--set", "sensor.force_noise=0.1")
    assert run("run", "plexiglas", *narrow, "--duration", "0.01", "--out", str(out)) == 0
    assert "saturates at t = " in capsys.readouterr().err
    assert run("run", "plexiglas", "--meshcat", "--duration", "0.01", "--out", str(out)) == 0
    assert re.search(r"Meshcat shows the run at http://127\.0\.0\.1:", capsys.readouterr().err)
    there = ("--meshcat", "--host", "localhost")
    assert run("run", "plexiglas", *there, "--duration", "0.01", "--out", str(out)) == 0
    assert re.search("Meshcat shows the run at http://localhost:", capsys.readouterr().err)
    assert not logging.getLogger("drake").handlers


def test_a_simulation_that_fails_writes_its_log_and_ends_with_status_1(out, capsys):
    # Far below any sensible inertia, the integrator of C diverges.
    unstable = ("--set", "impedance.translation.mass=1e-4", "--set", "log_period=0.001")
    assert run("run", "plexiglas", *unstable, "--duration", "5", "--out", str(out)) == 1
    assert re.search("simulation of plexiglas failed: .*", capsys.readouterr().err)
    with np.load(out / "log.npz") as log:
        assert 0 < log["t"][-1] < 5
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["failure"]


@pytest.mark.parametrize("command", ["run", "sweep", "bench --only"])
def test_the_program_stays_the_process_that_was_started(command):
    """A program that starts itself anew, in the same process or another, would write twice."""
    module, function = PYPROJECT["project"]["scripts"]["geoimp"].split(":")
    code = (
        f"import os, sys; from {module} import {function}; print(os.getpid(), flush=True);"
        f"sys.argv = 'geoimp {command} nothing'.split(); sys.exit({function}())"
    )
    with Popen([sys.executable, "-c", code], text=True, stdout=PIPE, stderr=PIPE) as program:
        said, errors = program.communicate()
    assert said == f"{program.pid}\n"
    assert program.returncode == 2
    assert "nothing" in errors


def test_analyze_writes_what_rings_and_a_run_warns_of_it(out, capfd):
    settings = {"translation.mass": 1.5, "translation.damping": 5.0}
    ringing = [f"--set=impedance.{name}={value}" for name, value in settings.items()]
    late = ("--set=sensor.delay=0.012", "--out", str(out))
    assert run("analyze", "plexiglas", *ringing, *late) == 0
    printed = capfd.readouterr()
    told = json.loads((out / "analysis.json").read_text())
    assert told["rings"]
    assert told["critical_damping"]["normal"][0] > 5.0
    assert told["largest_surface_stiffness"]["normal"] < 1e4
    assert (out / "ringing.png").stat().st_size > 1e4
    assert "on its surface the hand rings" in printed.out
    assert "plexiglas: on its surface the hand rings at" in printed.err  # as `geoimp run` says


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--set", "scheme=admittance"), "nothing to analyze"),
        (("--surface-stiffness", "-3"), "surface_stiffness is -3 N/m"),
        (("--delay", "-1"), "delay is -1 s"),
    ],
)
def test_what_cannot_be_analyzed_is_one_line(out, capfd, options, message):
    assert run("analyze", "plexiglas", *options, "--out", str(out)) == 2
    assert message in capfd.readouterr().err
    assert not out.exists()
