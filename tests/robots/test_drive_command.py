"""`geoimp drive`: a scenario on the robot that it names, with the files of a run."""

import base64
import itertools
import json
import re
import shlex
import signal
import subprocess
import sys
from dataclasses import replace

import msgpack
import numpy as np
import pytest
from driven_arm import LIGHT
from lcm_trial import isolated
from live_trial import another_try

from geoimp_drake.cli import main
from geoimp_drake.diagrams.setups import replayed_arm
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.frame_motion import POSITION, QUATERNION
from geoimp_drake.robots.plant_arm import PlantArm

SCENARIO = f"""
experiment: custom
arm: mine
robot: {{file: {LIGHT}, end_effector: l7}}
segments:
  - {{duration: 0.4, displacement: [0.0, 0.0, -0.02], rotation: [0.0, 0.1, 0.0]}}
  - {{duration: 0.1}}
impedance:
  translation: {{mass: 20.0, damping: 400.0, stiffness: 500.0}}
  rotation: {{mass: 4.0, damping: 40.0, stiffness: 50.0}}
"""


@pytest.fixture
def scenario(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").write_text(SCENARIO, "utf-8")
    return tmp_path / "mine.yaml"


def replayed(page, path):
    """Returns the instants of a replay's frames and the poses [w, x, y, z, p] of a path."""
    blocks = re.findall(r"base64,([A-Za-z0-9+/=]+)", page)
    data = [base64.b64decode(block) for block in blocks]
    messages = [msgpack.unpackb(block) for block in data if b"set_animation" in block]
    (clip,) = [a["clip"] for m in messages for a in m["animations"] if a["path"] == path]
    tracks = {track["name"]: track["keys"] for track in clip["tracks"]}
    values = {name: np.array([key["value"] for key in keys]) for name, keys in tracks.items()}
    frames = np.array([key["time"] for key in tracks[".position"]])
    w_last = values[".quaternion"]
    return frames / clip["fps"], np.hstack([np.roll(w_last, 1, axis=1), values[".position"]])


def test_a_drive_leaves_the_files_of_a_run_and_its_last_ticks(scenario, capsys):
    assert main(["drive", "mine.yaml", "--html"]) == 0
    assert "ticks of 1 ms" in capsys.readouterr().out
    out = scenario.parent / "results" / "mine"
    with np.load(out / "log.npz") as log, np.load(out / "ticks.npz") as ticks:
        t, motions = log["t"], {frame: log[f"mine/motion_{frame}"] for frame in "DCE"}
        assert len(ticks["t"]) > 10 * len(t) / 2
    moved = np.ptp(motions["E"], axis=0)
    np.testing.assert_allclose(moved[POSITION], [0.0, 0.0, 0.02], rtol=0, atol=2e-4)
    assert np.linalg.norm(moved[QUATERNION]) > 0.04
    assert json.loads((out / "metrics.json").read_text("utf-8"))["failure"] is None
    assert {file.suffix for file in out.iterdir()} >= {".npz", ".yaml", ".json", ".html", ".png"}
    replay = (out / "replay.html").read_text("utf-8")
    for frame, motion in motions.items():
        instants, poses = replayed(replay, f"/drake/frames/{frame}")
        # What is shown of several rows within a frame is the last one.
        rows = np.searchsorted(t, instants + 1.0 / 32.0 - 1e-9) - 1
        assert len(instants) == np.ceil(32.0 * t[-1])
        np.testing.assert_allclose(poses[:, 4:7], motion[rows, POSITION], rtol=0, atol=1e-9)
        same_rotation = np.abs(np.sum(poses[:, :4] * motion[rows, QUATERNION], axis=1))
        np.testing.assert_allclose(same_rotation, 1.0, rtol=0, atol=1e-12)


def test_nothing_is_reported_twice_also_after_a_message_of_drakes(scenario):
    text = LIGHT.read_text("utf-8").replace("<limit", '<dynamics friction="0.1"/><limit', 1)
    (scenario.parent / "rubs.urdf").write_text(text, "utf-8")
    scenario.write_text(SCENARIO.replace(str(LIGHT), "rubs.urdf"), "utf-8")
    # Pytest's own handlers would hide what Drake does.
    command = [sys.executable, "-m", "geoimp_drake.cli", "drive", "mine.yaml", "--dry-run"]
    done = subprocess.run(
        command, cwd=scenario.parent, capture_output=True, text=True, timeout=300, check=True
    )
    assert "non-zero value for the 'friction' attribute" in done.stderr
    # The arm is loaded for the controller and for the plant; `INFO:drake:` is the root's form.
    assert done.stderr.count("Robot 'mine' from rubs.urdf") == 2
    assert ":drake:" not in done.stderr


def lost(arm, status):
    """Of a robot that gives no more statuses."""


def interrupted(arm, status):
    """Of a terminal on which somebody presses Ctrl-C."""
    signal.raise_signal(signal.SIGINT)
    return status


@pytest.mark.parametrize(
    ("happens", "words"),
    [(lost, "stopped by its supervisor, a warning says why"), (interrupted, "stopped by Ctrl-C")],
)
def test_a_drive_that_is_braked_before_its_motion_has_ended_fails(
    happens, words, scenario, capsys, monkeypatch
):
    read, count = PlantArm.read, itertools.count()

    def disturbed(arm):
        status = read(arm)
        return happens(arm, status) if next(count) > 700 else status

    monkeypatch.setattr(PlantArm, "read", disturbed)
    assert main(["drive", "mine.yaml", "--no-figures"]) == 1
    line = capsys.readouterr().err.strip().splitlines()[-1]
    assert line.startswith("geoimp: the drive of mine.yaml ended early: ")
    assert words in line
    assert line.endswith(" s into a motion of 0.5 s.")
    metrics = json.loads((scenario.parent / "results/mine/metrics.json").read_text("utf-8"))
    assert words in metrics["failure"]


@pytest.mark.parametrize("inertia", ["desired", "natural"])
def test_a_drive_without_an_inner_loop_goes_where_it_should(inertia, scenario):
    if inertia == "natural":
        lines = SCENARIO.splitlines()[:-2]
        stiffnesses = "  translation: {stiffness: 500.0}\n  rotation: {stiffness: 50.0}\n"
        scenario.write_text("\n".join(lines) + "\n" + stiffnesses, "utf-8")
    words = ("--set", "scheme=direct", "--set", f"inertia={inertia}", "--no-figures")
    assert main(["drive", "mine.yaml", *words]) == 0
    with np.load(scenario.parent / "results" / "mine" / "log.npz") as log:
        D, E, C = (log[f"mine/motion_{frame}"] for frame in "DEC")
    np.testing.assert_allclose(E[-1, POSITION], D[-1, POSITION], rtol=0, atol=2e-4)
    np.testing.assert_array_equal(C[:, POSITION], E[:, POSITION])


def test_an_error_in_what_follows_leaves_the_last_ticks(scenario, monkeypatch):
    def fail(*_):
        raise ConfigurationError("no replay")

    monkeypatch.setattr(replayed_arm, "replay_log", fail)
    assert main(["drive", "mine.yaml", "--html", "--no-figures"]) == 2
    assert [file.name for file in (scenario.parent / "results" / "mine").iterdir()] == ["ticks.npz"]


def test_a_drive_without_a_second_status_is_one_line(scenario, monkeypatch, capsys):
    read = PlantArm.read
    monkeypatch.setattr(PlantArm, "read", lambda arm: replace(read(arm), q=np.full(6, np.nan)))
    assert main(["drive", "mine.yaml", "--no-figures"]) == 2
    assert "nothing was driven" in capsys.readouterr().err


def test_a_dry_run_says_what_it_would_send_and_writes_nothing(scenario, capsys):
    assert main(["drive", "mine.yaml", "--dry-run"]) == 0
    printed = capsys.readouterr().out
    assert "gravity is held by the" in printed
    assert printed.count("torque") == 7
    assert list(scenario.parent.iterdir()) == [scenario]


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("robot.driver.kind=lcm", "ticks every 0.005 s"),
        ("robot.driver.kind=ethercat", "ethercat"),
        ("sampling.period=0.002", "0.002 s"),
        ("robot.driver.period=-1", "robot.driver.period"),
        ("robot.driver={kind: lcm, url: nowhere}", "'nowhere'; give one that begins with udpm://"),
        ("robot.driver={kind: lcm, joints: [a, b]}", "The robot's joints are a, b; the arm has j1"),
        ("robot.driver={kind: franka}", "robot.driver.address is ''"),
        ("world.links.mass=1.1", "world"),
    ],
)
def test_what_cannot_be_driven_is_one_line_and_writes_nothing(override, words, scenario, capsys):
    assert main(["drive", "mine.yaml", "--set", override]) != 0
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert error.startswith("geoimp: ")
    assert words in error
    assert list(scenario.parent.iterdir()) == [scenario]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--lcm", "nowhere"], "'nowhere'; give one that begins with udpm://"),
        (["--set", "robot.driver.period=0.0015"], "0.0015 s; give a multiple of the plant's step"),
        (["--set", "robot.driver.period=0.0001"], "0.0001 s; give a multiple of the plant's step"),
        (["--set", "robot.driver.messages=ur"], "Valid: iiwa, panda"),
        (["--out", "here"], "unrecognized arguments: --out here"),
    ],
)
def test_what_cannot_be_simulated_behind_lcm_is_one_line(options, words, scenario, capsys):
    try:
        status = main(["robot-sim", "mine.yaml", "--lcm", "memq://", *options])
    except SystemExit as stop:
        status = stop.code
    assert status == 2
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert error.startswith("geoimp: ")
    assert words in error


def test_the_files_of_a_drive_leave_out_the_ticks_without_a_status(scenario, monkeypatch):
    read, count = PlantArm.read, itertools.count()
    monkeypatch.setattr(PlantArm, "read", lambda arm: (read(arm), None)[next(count) % 10 == 2])
    assert main(["drive", "mine.yaml", "--no-figures"]) == 0
    out = scenario.parent / "results" / "mine"
    with np.load(out / "log.npz") as log, np.load(out / "ticks.npz") as ticks:
        assert all(np.isfinite(log[name]).all() for name in log.files)
        np.testing.assert_allclose(np.diff(log["t"]), 0.01, rtol=0, atol=2e-3)
        assert np.isnan(ticks["t"]).any()


@another_try
def test_two_programs_drive_an_arm_between_them(scenario):
    """One is the robot; by default neither knows more of the other than its messages."""
    # A machine with other work is late; the robot waits meanwhile.
    driver = "{kind: lcm, period: 0.005, patience: 5.0, supervisor: {hold: 10.0}}"
    settings = ["--set", f"robot.driver={driver}", "--set", "sampling.period=0.005"]
    geoimp = [sys.executable, "-m", "geoimp_drake.cli"]
    robot = shlex.join(
        [*geoimp, "robot-sim", "mine.yaml", "--in-step", "--duration", "600", *settings]
    )
    drive = shlex.join([*geoimp, "drive", "mine.yaml", "--no-figures", *settings])
    speaks = "until grep -q 'status each' robot.log; do sleep 0.1; done"
    ended = isolated(
        "sh", "-c", f"{robot} > robot.log 2>&1 & {speaks}; {drive}; ended=$?; kill $!; exit $ended"
    )
    assert "of 5 ms" in ended
    with np.load(scenario.parent / "results" / "mine" / "log.npz") as log:
        E = log["mine/motion_E"][:, POSITION]
    np.testing.assert_allclose(E[-1] - E[0], [0.0, 0.0, -0.02], rtol=0, atol=2e-4)


def test_a_dry_run_shows_the_positions_that_would_be_sent(scenario, capsys):
    assert main(["drive", "mine.yaml", "--dry-run", "--set", "scheme=admittance"]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines() if " position " in line]
    assert [row[0] for row in rows] == [f"j{k}" for k in range(1, 8)]
    assert all(float(row[2]) == pytest.approx(float(row[6]), abs=1e-3) for row in rows)
