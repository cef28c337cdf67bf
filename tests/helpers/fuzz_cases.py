"""Input as nobody should write it: mutations of what is shipped, each made from a number alone.

A case does something with files in a folder of its own. It may raise only errors of the library.
"""

import contextlib
import io
import json
import random
import re
from collections.abc import Callable
from pathlib import Path

from fuzz_mutations import NUMBERS, VALUES, instead, spoilt, spoilt_word, spoilt_xml, value
from library_tree import ROOT
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from geoimp_drake import cli
from geoimp_drake.campaigns.journal import Finished, Journal
from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS, OWN
from geoimp_drake.motion_program.pdl import read_program
from geoimp_drake.motion_program.taught import TaughtVariable, taught_values
from geoimp_drake.robot_files.geometry import GEOMETRY
from geoimp_drake.robot_files.loading import load_robot
from geoimp_drake.scenario.loading import plain_data
from geoimp_drake.simulation.log_data import load_log

__all__ = ["ROBOTS", "Case", "command", "make_case"]

# Makes its files in a folder, and returns what is done and a description.
Case = tuple[Callable[[], None], str]

_SHIPPED = ROOT / "diagrams" / "experiments"
ROBOTS = sorted((ROOT / "tests" / "robot_files" / "cases").glob("*.*f")) + sorted(
    (ROOT / "tests" / "robot_files" / "cases").glob("*.xml")
)


def make_case(number: int, seed: int, folder: Path) -> Case:
    """Returns a case; the folder gets its files in `in`, and is for what is written in `out`."""
    rng = random.Random(f"{seed}/{number}")
    make = rng.choices(list(_KINDS), list(_KINDS.values()))[0]
    return make(rng, folder / "in", folder / "out")


def _scenario_file(rng: random.Random, files: Path, out: Path) -> Case:
    """A shipped scenario, its text changed."""
    name = rng.choice(list(EXPERIMENTS))
    text = (_SHIPPED / f"{name}.yaml").read_text("utf-8")
    file = _write(files / "mine.yaml", spoilt(rng, text, VALUES))
    if rng.random() < 0.2:
        return command("check", file)
    return command("run", name, "--scenario", file, "--no-figures", "--out", out)


def _setting(rng: random.Random, files: Path, out: Path) -> Case:
    """Some keys of a scenario set, by the command line or in a file."""
    experiment = rng.choice([*EXPERIMENTS.values(), *OWN.values()])
    base = EXPERIMENTS.get(experiment.name) or EXPERIMENTS["plexiglas"]
    parts = _parts(plain_data(base.scenario()) if rng.random() < 0.3 else base.defaults())
    given = []
    for _ in range(rng.choice((1, 1, 2, 3))):
        path, part = rng.choice(parts)
        if rng.random() < 0.1:
            path = spoilt_word(rng, path)
        given += ["--set", f"{path}={instead(rng, str(part))}"]
    return command("run", experiment.name, *given, "--no-figures", "--out", out)


def _command_line(rng: random.Random, files: Path, out: Path) -> Case:
    """A command with options that fit it, and ones that do not."""
    experiment = rng.choice([*EXPERIMENTS, *(own.name for own in OWN.values()), value(rng)])
    file = rng.choice([files / "none.yaml", files, "/dev/null", _SHIPPED / "bar.yaml", value(rng)])
    vary = f"{rng.choice(('start.tilt_deg', 'seed', 'log_period', 'segments.0.duration', 'x.²'))}="
    options = {
        "--seed": value(rng),
        "--duration": value(rng),
        "--orientation": value(rng),
        "--samples": value(rng),
        "--jobs": value(rng),
        "--host": value(rng),
        "--scenario": str(file),
        "--plan": str(file),
        "--vary": f"{vary}{value(rng)}:{value(rng)}",
        "--set": value(rng),
        "--scheduler": "tcp://127.0.0.1:1",
        "--from": experiment,
        "--robot": str(rng.choice([file, *ROBOTS])),
        "--end-effector": value(rng),
        "--only": value(rng),
    }
    verb = rng.choice(["run", "compare", "sweep", "bench", "init", "check", "list", value(rng)])
    words = [verb] if verb in ("bench", "list") else [verb, experiment]
    if verb == "init":
        words = [verb, rng.choice(["new.yaml", "a/b.yaml", "x" * 300, "", "/proc/none.yaml"])]
    for option in rng.sample(list(options), rng.randint(0, 3)):
        words += [option, options[option]]
    if verb == "check":
        words = [verb, rng.choice([file, *ROBOTS])]
    if verb in ("run", "compare", "sweep"):
        words += ["--out", rng.choice([out / "x", out / ("y" * 300), "/proc/none", "/dev/null/x"])]
    return command(*words)


def _sweep_plan(rng: random.Random, files: Path, out: Path) -> Case:
    """A sweep's plan, its text changed."""
    text = (
        "vary:\n  start.tilt_deg: {uniform: [0, 15]}\n  log_period: {normal: [1, 2]}\n"
        "samples: 3\nseed: 1\n"
    )
    file = _write(files / "plan.yaml", spoilt(rng, text, VALUES))
    return command("sweep", "plexiglas", "--plan", file, "--out", out)


def _motion_program(rng: random.Random, files: Path, out: Path) -> Case:
    """The shipped motion program, its text changed."""
    text = (_SHIPPED / "insertion.pdl").read_text("utf-8")
    values = (
        *NUMBERS,
        "dpt",
        "int",
        "VEC",
        "MOVE",
        "ARM[2]",
        ":=",
        "--",
        "²",
        "x" * 10**5,
        "\ufeff",
    )
    file = _write(files / "mine.pdl", spoilt(rng, text, values))
    joints = [rng.choice((0.0, 1e300, 1.0))] * rng.choice((7, 7, 0, 1))
    taught = [TaughtVariable("int", joints=joints), TaughtVariable("pro", position=[0, 1, 0])]

    def read() -> None:
        read_program(file, taught_values(taught), {"dpt": 50.0})

    return read, f"read_program of {file}"


def _robot(rng: random.Random, files: Path, out: Path) -> Case:
    """A robot's file, its text changed."""
    source = rng.choice(ROBOTS)
    text = source.read_text("utf-8")
    file = _write(files / source.name, spoilt_xml(rng, text))
    frames = re.findall(r'<(?:link|body|frame|site) name="([^"]*)"', text) or ["none"]
    end_effector, geometry = rng.choice([*frames[-2:], frames[-1]]), rng.choice(GEOMETRY)

    if rng.random() < 0.2:
        return command("check", file, "--end-effector", end_effector)
    if rng.random() < 0.1:
        return command("init", out / f"{rng.random()}.yaml", "--robot", file)

    def load() -> None:
        plant, _ = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
        load_robot(file, plant, end_effector=end_effector, geometry=geometry, cache=out)
        plant.Finalize()

    return load, f"load_robot({source.name}, end_effector={end_effector!r}, geometry={geometry!r})"


def _journal(rng: random.Random, files: Path, out: Path) -> Case:
    """The journal of many runs, its lines changed."""
    plan = {"command": "reproduce"}
    lines = [{"plan": plan}]
    lines += [
        {"key": f"{k}", "result": {"a": k}, "error": None, "wall_time": 1.0} for k in range(3)
    ]
    text = "".join(json.dumps(line) + "\n" for line in lines)
    values = (
        "5",
        "null",
        "[]",
        "{}",
        '"x"',
        "1e400",
        "NaN",
        "-1",
        "key",
        "\x00",
        "\ufeff",
        "[" * 10**5,
    )
    file = _write(files / "journal.jsonl", spoilt(rng, text, values))

    def use() -> None:
        book = Journal(file, plan)
        book.read()
        with book:
            book.add("new", Finished({"b": 1}, None, 0.1))
        assert "new" in book.read()

    return use, f"Journal {file}"


def _log(rng: random.Random, files: Path, out: Path) -> Case:
    """What a run left, damaged."""
    _write(files / "scenario.yaml", spoilt(rng, "experiment: plexiglas\narm: six\n", VALUES))
    _write(files / "log.npz", rng.choice((b"", b"PK\x03\x04", b"x" * 1000)))
    return lambda: (load_log(files), None)[1], f"load_log of {files}"


_KINDS = {
    _scenario_file: 30,
    _setting: 25,
    _command_line: 15,
    _sweep_plan: 5,
    _motion_program: 8,
    _robot: 12,
    _journal: 4,
    _log: 1,
}


def command(*words: object) -> Case:
    arguments = [str(word).replace("\x00", "") for word in words]

    def run() -> None:
        said, status = io.StringIO(), None
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
            try:
                status = cli.main(arguments)
            except SystemExit as stop:
                status = stop.code
        errors = [line for line in said.getvalue().splitlines() if line.startswith("geoimp: ")]
        assert status in (0, 1, 2), f"status {status}"
        assert len(errors) == (status != 0), said.getvalue()
        assert all(len(line) < 5000 for line in errors), f"{len(errors[0])} characters"

    return run, " ".join(word if len(word) < 400 else f"{word[:400]}…" for word in arguments)


def _parts(data: object, path: str = "") -> list[tuple[str, object]]:
    """All parts of a scenario's data with their paths."""
    inner: list = []
    if isinstance(data, dict | list):
        inner = list(data.items() if isinstance(data, dict) else enumerate(data))
    below = [p for key, part in inner for p in _parts(part, f"{path}.{key}" if path else str(key))]
    return ([(path, data)] if path else []) + below


def _write(file: Path, content: str | bytes) -> Path:
    data = content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass")
    file.write_bytes(data)
    return file
