"""A sweep: one table whatever is killed, each row repeatable, bad input refused in one line."""

import contextlib
import csv
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import threading
import time
import types
from pathlib import Path

import numpy as np
import pytest
import yaml
from distributed import LocalCluster

from geoimp_drake import cli
from geoimp_drake.campaigns.sweep_plan import Distribution, SweepPlan, setting
from geoimp_drake.campaigns.sweep_sample import Sample, run_sample
from geoimp_drake.compilation.compiled import is_available
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.scenario.loading import plain_data

VARIED = ("--vary", "start.tilt_deg=0:15", "--vary", "surface.properties.friction=0.05:0.8")
SWEEP = ("sweep", "plexiglas", "--duration", "0.02", *VARIED, "--seed", "5")
SAMPLES = 6
ALL = (*SWEEP, "--samples", str(SAMPLES))
UNREACHABLE = ("--scheduler", "tcp://127.0.0.1:1")  # whatever gets as far as that is not refused


def run(*arguments: str | Path) -> int:
    try:
        return cli.main(list(map(str, arguments)))
    except SystemExit as stop:
        return int(stop.code or 0)


@pytest.fixture(scope="module")
def cluster():
    local = {
        "n_workers": 2,
        "threads_per_worker": 1,
        "host": "127.0.0.1",
        "dashboard_address": ":0",
    }
    with LocalCluster(**local, silence_logs="CRITICAL") as cluster:
        yield cluster


@pytest.fixture(scope="module")
def serial(tmp_path_factory) -> Path:
    """The folder of a sweep by a single process."""
    out = tmp_path_factory.mktemp("serial")
    assert run(*ALL, "--jobs", "1", "--out", out) == 0
    return out


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out"


def rows_of(out: Path) -> list[dict[str, str]]:
    with (out / "samples.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def form_in(folder: Path) -> str:
    return yaml.safe_load((folder / "scenario.yaml").read_text("utf-8"))["form"]


def finished_in(out: Path) -> list[str]:
    """Indices of the samples in a journal, in the order in which they ended."""
    lines = (out / "journal.jsonl").read_text("utf-8").splitlines()
    return [json.loads(line)["key"] for line in lines[1:]]


def wait_for_samples(out: Path, count: int) -> None:
    end = time.monotonic() + 60
    while time.monotonic() < end:
        with contextlib.suppress(FileNotFoundError, ValueError):
            if len(finished_in(out)) >= count:
                return
        time.sleep(0.005)
    raise TimeoutError(f"{count} samples have not ended in {out}")


def test_a_sweep_leaves_its_table_and_figures(serial):
    assert {path.name for path in serial.iterdir()} == {
        "samples.csv",
        "journal.jsonl",
        "scenario.yaml",
        "plan.yaml",
        "success_map.png",
        "success_map.pdf",
        "peak_forces.png",
        "peak_forces.pdf",
    }
    rows = rows_of(serial)
    assert [row["index"] for row in rows] == [str(index) for index in range(SAMPLES)]
    assert len({row["seed"] for row in rows}) == SAMPLES
    assert all(0 <= float(row["start.tilt_deg"]) <= 15 for row in rows)
    assert all(0.05 <= float(row["surface.properties.friction"]) <= 0.8 for row in rows)
    assert all(float(row["peak_force"]) > 0 and row["error"] == "" for row in rows)


def test_a_killed_process_changes_nothing_in_the_table(serial, cluster, out):
    def kill() -> None:
        wait_for_samples(out, 2)
        os.kill(victim, signal.SIGKILL)

    victim = cluster.workers[0].pid
    killer = threading.Thread(target=kill)
    killer.start()
    try:
        assert run(*ALL, "--scheduler", cluster.scheduler_address, "--out", out) == 0
    finally:
        killer.join()
    assert cluster.workers[0].pid != victim
    assert sorted(finished_in(out)) == [str(index) for index in range(SAMPLES)]
    assert (out / "samples.csv").read_bytes() == (serial / "samples.csv").read_bytes()


def test_a_sweep_that_was_killed_does_the_missing_samples_only(serial, cluster, out):
    code = "import sys; from geoimp_drake.cli import main; sys.exit(main())"
    command = (sys.executable, "-c", code, *ALL, "--jobs", "2", "--out", str(out))
    with subprocess.Popen(command) as process:
        wait_for_samples(out, 2)
        process.kill()
    before = finished_in(out)
    assert 2 <= len(before) < SAMPLES
    assert not (out / "samples.csv").exists()
    assert run(*ALL, "--scheduler", cluster.scheduler_address, "--out", out) == 0
    after = finished_in(out)
    assert after[: len(before)] == before
    assert sorted(after) == [str(index) for index in range(SAMPLES)]
    assert (out / "samples.csv").read_bytes() == (serial / "samples.csv").read_bytes()


def test_a_sweep_that_is_told_to_end_clears_up(out, tmp_path):
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    code = "import sys; from geoimp_drake.cli import main; sys.exit(main())"
    many = (*SWEEP, "--samples", "500", "--jobs", "1", "--out", str(out))
    with subprocess.Popen(
        (sys.executable, "-c", code, *many),
        env={**os.environ, "TMPDIR": str(temporary)},
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        wait_for_samples(out, 1)
        assert list(temporary.iterdir())
        process.terminate()
        _, error = process.communicate(timeout=60)
    assert (process.returncode, error) == (1, "geoimp: interrupted by SIGTERM\n")
    assert list(temporary.iterdir()) == []
    assert [path.name for path in out.iterdir()] == ["journal.jsonl"]


def test_a_sweep_grows_by_more_samples_of_the_same_plan(serial, cluster, out):
    there = ("--scheduler", cluster.scheduler_address, "--out", out)
    assert run(*SWEEP, "--samples", "2", *there) == 0
    assert len(rows_of(out)) == 2
    before = finished_in(out)
    assert run(*ALL, *there) == 0
    assert finished_in(out)[:2] == before
    assert (out / "samples.csv").read_bytes() == (serial / "samples.csv").read_bytes()


@pytest.mark.parametrize("index", [0, SAMPLES - 1])
def test_run_repeats_any_row_to_the_bit(serial, out, index, monkeypatch):
    monkeypatch.chdir(serial)  # where the row's scenario.yaml is
    row = rows_of(serial)[index]
    assert (
        run("run", "plexiglas", *shlex.split(row["arguments"]), "--no-figures", "--out", out) == 0
    )
    claims = json.loads((out / "metrics.json").read_text("utf-8"))["claims"]
    for claim in claims:
        name = f"{claim['claim']} [{claim['unit']}]" if claim["unit"] else claim["claim"]
        assert row[name] == ("" if claim["value"] is None else repr(claim["value"]))
        assert row[f"holds: {claim['claim']}"] == str(claim["holds"] or "")
    force = np.load(out / "log.npz")["six/wrench_true"][:, 3:]
    assert row["peak_force"] == repr(float(np.linalg.norm(force, axis=1).max()))


def test_the_printed_command_repeats_a_row(serial, out, capsys):
    assert run(*ALL, *UNREACHABLE, "--out", serial) == 0  # all is there already
    (line,) = re.findall("here the first: geoimp (.*)", capsys.readouterr().out)
    assert run(*shlex.split(line), "--no-figures", "--out", out) == 0
    assert json.loads((out / "metrics.json").read_text())["seed"] == int(rows_of(serial)[0]["seed"])


def test_a_plan_may_be_a_file(serial, cluster, out, tmp_path):
    plan = yaml.safe_load((serial / "plan.yaml").read_text())
    (tmp_path / "plan.yaml").write_text(yaml.safe_dump(plan))  # its keys in another order
    given = ("--scenario", serial / "scenario.yaml", "--plan", tmp_path / "plan.yaml")
    there = ("--scheduler", cluster.scheduler_address, "--out", out)
    assert run("sweep", "plexiglas", *given, *there) == 0
    assert (out / "samples.csv").read_bytes() == (serial / "samples.csv").read_bytes()


def test_a_sample_that_fails_is_a_row_with_its_error(cluster, out, tmp_path, capsys):
    normal = {"surface.properties.friction": {"normal": [0.1, 0.5]}}  # negative now and then
    plan = {"vary": normal, "samples": 6, "seed": 1}
    (tmp_path / "plan.yaml").write_text(yaml.safe_dump(plan))
    there = ("--scheduler", cluster.scheduler_address, "--out", out)
    short = ("sweep", "plexiglas", "--duration", "0.02", "--plan", tmp_path / "plan.yaml")
    assert run(*short, *there) == 0
    rows = rows_of(out)
    negative = [float(row["surface.properties.friction"]) < 0 for row in rows]
    assert 0 < sum(negative) < len(rows)
    assert [bool(row["error"]) for row in rows] == negative
    failed = rows[negative.index(True)]
    assert failed["error"].startswith("ConfigurationError: surface.properties.friction is -")
    assert (failed["success"], failed["peak_force"]) == ("False", "")
    assert f"{sum(negative)} with an error" in capsys.readouterr().out


def test_another_plan_in_the_same_folder_is_refused(serial, capsys):
    before = (serial / "journal.jsonl").read_bytes()
    for change, message in {
        ("--seed", "6"): "seed is 5 there and 6 here",
        ("--set", "start.tilt_axis=[0, 1, 0]"): "scenario.start.tilt_axis is",
        ("--vary", "start.position.2=0.7:0.8"): "vary.start.position.2 is not given there",
    }.items():
        assert run(*ALL, *change, *UNREACHABLE, "--out", serial) == 2
        assert re.search(f"holds runs of another plan: .*{message}", capsys.readouterr().err)
    assert (serial / "journal.jsonl").read_bytes() == before


TILT = ("--vary", "start.tilt_deg=0:15")
BAD_INPUTS = {
    (): "Nothing is varied; give --vary",
    ("--vary", "start.tilt=0:1"): "Unknown key in start 'tilt'. Did you mean 'tilt_deg'",
    ("--vary", "start.position.3=0:1"): "start.position has 3 entries; '3' is none of them",
    ("--vary", "start.tilt_deg=15:0"): "between 15 and 0; give LOW:HIGH with LOW at most HIGH",
    ("--vary", "start.tilt_deg=15"): "'start.tilt_deg=15' is not of the form key.path=LOW:HIGH",
    ("--vary", "=0:1"): "'=0:1' is not of the form",
    ("--vary", "start.tilt_deg=0:.inf"): "is not of the form",
    ("--vary", "start.tilt_deg=0:inf"): "The high of start.tilt_deg is inf",
    ("--vary", "start.tilt_deg=-1e308:1e308"): "low of start.tilt_deg is -1e.308; .* at most 1e.12",
    ("--vary", "start.position.²=0:1"): "start.position has 3 entries; '²' is none of them",
    ("--vary", "arm=0:1"): "arm is 'six', not a number",
    ("--vary", "surface.properties.name=0:1"): "name is 'plexiglas', not a number",
    ("--vary", "start=0:1"): "start cannot be 0: start must be a mapping",
    ("--vary", "surface.properties.friction=-1:1"): "friction cannot be -1: .*friction is -1",
    ("--vary", "seed=0:9"): "seed cannot be .*give a whole number",
    (*TILT, *TILT): "start.tilt_deg is varied twice",
    (*TILT, "--samples", "0"): "samples is 0; give a whole number from 1 to 100000",
    (*TILT, "--samples", "1" + 9 * "0"): "samples is 1000000000; give",
    (*TILT, "--samples", "many"): "invalid int value: 'many'",
    (*TILT, "--seed", "-1"): "seed is -1; give a whole number from 0",
    (*TILT, "--seed", str(2**128)): "seed is 3402.*; give a whole number",
    (*TILT, "--jobs", "0"): "jobs is 0; give a whole number from 1 to 1000",
    (*TILT, "--map", "start.tilt_deg", "x"): "Unknown key of the map 'x'",
    (*TILT, "--plan", "missing.yaml"): "missing.yaml cannot be read",
    (*TILT, "--scheduler", "nowhere"): "The scheduler nowhere does not answer",
    (*TILT, "--set", "start.tilt=1"): "Unknown key in start 'tilt'",
}


@pytest.mark.parametrize("key", ["internal.translation.mass", "opened.stop_time"])
def test_a_sweep_that_the_controller_would_refuse_is_not_begun(key, out, capsys):
    assert run("sweep", "bar", "--vary", f"{key}=-1:1", "--out", out) == 2
    assert f"{key} cannot be -1: {key} is " in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.parametrize("arguments", BAD_INPUTS)
def test_bad_input_gets_one_clear_line_and_writes_nothing(arguments, out, capsys, monkeypatch):
    monkeypatch.setattr("geoimp_drake.campaigns.many_runs._CONNECT_TIMEOUT", 0.5)
    assert run("sweep", "plexiglas", *arguments, "--out", out) == 2
    error = capsys.readouterr().err
    assert re.search(BAD_INPUTS[arguments], error), error
    assert error.startswith("geoimp: ")
    assert error.count("\n") == 1
    assert not out.exists()


BAD_PLANS = {
    "varied: {}": "Unknown key in .* 'varied'. Did you mean 'vary'",
    "vary: [1]": r"vary must be a mapping of key paths, not \[1\]",
    "vary: {start.tilt_deg: {gamma: [1, 2]}}": "Unknown distribution of start.tilt_deg 'gamma'",
    "vary: {start.tilt_deg: {uniform: [1]}}": "start.tilt_deg is varied by .*give {uniform",
    "vary: {start.tilt_deg: 1}": "start.tilt_deg is varied by 1; give {uniform",
    "vary: {start.tilt_deg: {normal: [1, -2]}}": "standard deviation of start.tilt_deg is -2",
    "samples: 1.5": "samples is 1.5; give a whole number",
    "vary: {start.tilt_deg: {normal: [0, 1e300]}}": "deviation of start.tilt_deg is 1e.300",
    "variants: [soft]": "variants must be a mapping of names to lists",
    "variants: {soft: seed=1}": "variants must be a mapping of names to lists",
    "samples: 5\nvary: {}\nsamples: 6": "line 3: 'samples' is in line 1 already",
}


@pytest.mark.parametrize("plan", BAD_PLANS)
def test_a_bad_plan_is_refused_by_naming_what_is_wrong(plan, tmp_path):
    (tmp_path / "plan.yaml").write_text(plan)
    with pytest.raises(ConfigurationError, match=BAD_PLANS[plan]):
        SweepPlan.read(tmp_path / "plan.yaml")


UNIFORM, NORMAL = Distribution("uniform", -2.0, 4.0), Distribution("normal", 3.0, 0.5)


def test_a_draw_depends_on_seed_and_index_alone():
    plan = SweepPlan({"a": UNIFORM, "b": NORMAL}, samples=4, seed=7)
    other = SweepPlan({"b": NORMAL, "a": UNIFORM}, samples=900, seed=7)
    backwards = [other.draw(index) for index in reversed(range(4))]
    assert [plan.draw(index) for index in range(4)] == backwards[::-1]
    assert plan.draw(0).parameters != plan.draw(1).parameters
    assert SweepPlan(plan.vary, 4, seed=8).draw(0).parameters != plan.draw(0).parameters


def test_every_variant_gets_the_same_draws():
    variants = {"soft": ("a=1",), "stiff": ("a=2", "b=3")}
    plan = SweepPlan({"a": UNIFORM}, samples=6, seed=7, variants=variants)
    alone = SweepPlan({"a": UNIFORM}, samples=3, seed=7)
    draws = [plan.draw(index) for index in range(6)]
    assert [draw.variant for draw in draws] == 3 * ["soft", "stiff"]
    for case in range(3):
        soft, stiff = draws[2 * case : 2 * case + 2]
        one = alone.draw(case)
        assert (soft.seed, soft.parameters) == (stiff.seed, stiff.parameters)
        assert (soft.seed, soft.parameters) == (one.seed, one.parameters)
        assert one.variant is None
    assert draws[1].overrides()[1:3] == variants["stiff"]
    assert "variants" not in alone.as_data()


def test_a_variant_is_a_column_and_its_settings_are_in_what_repeats_a_row(cluster, out, tmp_path):
    plan = {
        "vary": {"start.tilt_deg": {"uniform": [0.0, 15.0]}},
        "variants": {"as it is": [], "blocks": ["form=blocks"]},
        "samples": 3,
    }
    (tmp_path / "plan.yaml").write_text(yaml.safe_dump(plan))
    there = ("--scheduler", cluster.scheduler_address, "--out", out)
    short = ("sweep", "plexiglas", "--duration", "0.01", "--plan", tmp_path / "plan.yaml")
    assert run(*short, *there) == 0
    rows = rows_of(out)
    assert [row["variant"] for row in rows] == ["as it is", "blocks", "as it is"]
    assert ["--set form=blocks" in row["arguments"] for row in rows] == [False, True, False]


def test_a_variant_that_cannot_be_used_is_named(out, tmp_path, capsys):
    plan = {"vary": {"start.tilt_deg": {"uniform": [0, 1]}}, "variants": {"odd": ["form=bricks"]}}
    (tmp_path / "plan.yaml").write_text(yaml.safe_dump(plan))
    assert run("sweep", "plexiglas", "--plan", tmp_path / "plan.yaml", "--out", out) == 2
    assert "variant 'odd': Unknown form 'bricks'" in capsys.readouterr().err
    assert not out.exists()


def test_draws_are_distributed_as_they_should_be():
    plan = SweepPlan({"a": UNIFORM, "b": NORMAL}, samples=4000, seed=1)
    drawn = np.array([list(plan.draw(index).parameters.values()) for index in range(4000)])
    uniform, normal = drawn.T
    assert uniform.min() >= -2
    assert uniform.max() <= 4
    assert np.histogram(uniform, 4)[0] == pytest.approx(1000, rel=0.1)
    assert (normal.mean(), normal.std()) == pytest.approx((3.0, 0.5), rel=0.03)
    within = np.mean(np.abs(normal - 3.0) < 0.5)
    assert within == pytest.approx(0.683, abs=0.025)
    assert abs(np.corrcoef(uniform, normal)[0, 1]) < 0.05


@pytest.mark.parametrize("value", [0.1 + 0.2, 1e-5, -1.0, 1e300, 5e-324, 7.0])
def test_a_setting_keeps_every_bit_of_its_number(value):
    _, _, text = setting("key", value).partition("=")
    assert yaml.safe_load(text) == value
    assert isinstance(yaml.safe_load(text), float)


def test_an_experiment_may_say_itself_what_success_is():
    experiment = get_experiment("plexiglas")
    data = plain_data(experiment.scenario((), ("duration=0.02",)))
    measures = {"depth [m]": np.float64(0.05), "success": np.bool_(True)}
    used = {name: getattr(experiment, name) for name in ("scenario", "build", "claims")}
    own = types.SimpleNamespace(**used, sweep_values=lambda *_: measures)
    row = run_sample(Sample(own, data, ()))
    assert row["success"] is True
    assert row["values"]["depth [m]"] == 0.05
    assert "success" not in row["values"]
    assert run_sample(Sample(experiment, data, ()))["success"] is False  # claims not reached


def test_without_a_sweep_nothing_imports_dask(out):
    code = (
        "import sys; from geoimp_drake import cli; import geoimp_drake.campaigns.sweep\n"
        "cli.main(['run', 'plexiglas', '--duration', '0.01', '--out', sys.argv[1]])\n"
        "assert not {'dask', 'distributed'} & sys.modules.keys()"
    )
    subprocess.run((sys.executable, "-c", code, out), check=True, capture_output=True)


def test_samples_run_in_the_fastest_form_unless_told(serial, out):
    assert form_in(serial) == ("compiled" if is_available() else "blocks")
    told = (*SWEEP, "--samples", "1", "--jobs", "1", "--set", "form=blocks", "--out", out)
    assert run(*told) == 0
    assert form_in(out) == "blocks"
