"""The cost of a tick and of a closed loop, beside others: one run on one machine.

```
 OUT/speed.json           machine, versions, and medians
 OUT/speed.png, .pdf      ticks
 OUT/journal.jsonl        what has finished
```
"""

import json
import os
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.campaigns.journal import Finished
from geoimp_drake.campaigns.many_runs import run_many
from geoimp_drake.campaigns.reproduction import SectionResult
from geoimp_drake.campaigns.study_run import identity_of
from geoimp_drake.campaigns.table import Table, cell_of
from geoimp_drake.diagrams.experiments.bench_cases import BENCH_CASES
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.setups.bench_tick import run_tick_bench
from geoimp_drake.diagrams.setups.robosuite_tick import RobosuiteTick
from geoimp_drake.output_folder import write_files
from geoimp_drake.simulation.bench import BenchCase, run_bench
from geoimp_drake.simulation.claims import Claim, at_most
from geoimp_drake.simulation.style import (
    figure_contents,
    figure_files,
    figure_style,
    make_logarithmic,
)

__all__ = ["SpeedSection", "machine", "time_speed"]

_JOURNAL = "journal.jsonl"
_FIELDS = {"identity": str, "timings": dict, "load": float}
_TICK = "tick"
_QUICK = ("single_free", "plexiglas")
_PEERS = ("numba", "pin", "robosuite", "mujoco")

# The name of each timed tick, and a description.
_TICKS = {
    "loop": (
        "ControlLoop.step",
        "this library: impedance, inner loop and torques for new readings, laws compiled",
    ),
    "drake": (
        "Drake, InverseDynamics",
        "C++, the torques of a given acceleration alone: less work than a controller's",
    ),
    "terms": (
        "pinocchio, terms alone",
        "C++ by its bindings: pose, Jacobian and its rate, mass matrix, bias",
    ),
    "numpy": (
        "pinocchio and NumPy",
        "this library's law, written as its user would; the same torques, see the claim",
    ),
    "osc": (
        "robosuite, run_controller",
        "its operational-space controller alone, as it comes, numba on; another, shorter law",
    ),
    "robosuite": (
        "robosuite with MuJoCo",
        "the same with MuJoCo's terms of new readings and a new goal: a whole tick",
    ),
}


class SpeedSection:
    """The part of a benchmark that times ticks and closed loops, one after the other.

    Args:
        quick: fewer closed loops.
    """

    name = "speed"
    files = (_JOURNAL, "speed.json", *figure_files("speed"))

    def __init__(self, quick: bool):
        self._tasks = [_TICK, *(_QUICK if quick else BENCH_CASES)]

    def run(self, out: Path, jobs: int, overrides: Sequence[str]) -> SectionResult:
        """Times the cases that the folder does not have yet.

        Args:
            out: folder to write into.
            jobs: of no effect, since parallel runs would disturb the timing.
            overrides: of no effect: the cases are those of `geoimp bench`.
        """
        del jobs, overrides

        def is_current(key: str, ended: Finished) -> bool:
            return bool(ended.result) and ended.result["identity"] == _identity(key)

        finished = run_many(
            {task: task for task in self._tasks},
            time_speed,
            jobs=1,
            journal=out / _JOURNAL,
            plan={"command": "speed"},
            label="geoimp benchmark",
            fields=_FIELDS,
            is_current=is_current,
        )
        results = {key: ended.result for key, ended in finished.items() if ended.result}
        failures = {key: ended.error for key, ended in finished.items() if ended.error}
        ticks = results.pop(_TICK, {"timings": {}})["timings"]
        loops = {name: one["timings"] for name, one in results.items()}
        loads = [ended.result["load"] for ended in finished.values() if ended.result]
        told = _told(loads)
        data = {"machine": told, "ticks": ticks, "closed_loops": loops}
        contents: list[tuple[str, bytes | str]] = [
            ("speed.json", json.dumps(data, indent=2, ensure_ascii=False) + "\n"),
            *figure_contents("speed", _figure(ticks)),
        ]
        write_files(out, contents)
        return SectionResult(
            self.name,
            "what a tick and a closed loop cost, in one run on one machine",
            "Medians of calls that take turns, so that a machine that gets slower does so for all.",
            tuple(_claims(ticks)),
            "speed",
            ("speed.json", _JOURNAL),
            failures,
            (_tick_table(ticks), _loop_table(loops), _machine_table(told)),
        )


def time_speed(task: str) -> dict[str, Any]:
    """Returns the `timings` of ticks, or of a closed loop; `identity`; `load` of the machine."""
    load = os.getloadavg()[0]
    if task == _TICK:
        text = run_tick_bench()[1]
    else:
        experiment, start, real_time = BENCH_CASES[task]
        text = run_bench([BenchCase(task, get_experiment(experiment), start, real_time)])[1]
    return {"identity": _identity(task), "timings": json.loads(text), "load": load}


def machine() -> dict[str, str]:
    """Returns the machine, and the versions of the timed packages, in words."""
    named = {name: _version(name) for name in ("drake", "numpy", *_PEERS)}
    return {
        "processor": f"{_processor()}, {os.cpu_count()} cores",
        "system": f"{platform.system()} {platform.release()}",
        "Python": platform.python_version(),
        **named,
    }


def _told(loads: Sequence[float]) -> dict[str, str]:
    """Returns the machine and its load."""
    load = f"{min(loads):.1f} to {max(loads):.1f}" if loads else "–"
    return {**machine(), "processes that wanted to run meanwhile": load}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def _processor() -> str:
    """Returns the processor's name."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text("utf-8").splitlines() if info.is_file() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def _identity(task: str) -> str:
    return identity_of({"engine": "drake", "task": task, **machine()}, html=False)


def _claims(ticks: Mapping[str, Any]) -> list[Claim]:
    return [
        at_most(f"{name}: torques of pinocchio and NumPy off ControlLoop's", off, 1e-8, "Nm")
        for name, off in ticks.get("difference_of_torques", {}).items()
        if off is not None
    ]


def _tick_table(ticks: Mapping[str, Any]) -> Table:
    micro = ticks.get("microseconds_per_tick", {})
    rows = tuple(
        (name, *(cell_of(one.get(key)) for one in micro.values()), done)
        for key, (name, done) in _TICKS.items()
        if any(key in one for one in micro.values())
    )
    head = ("a tick of", *(f"{name} [µs]" for name in micro), "what was done, on what it rests")
    return Table("A controller called by hand", head, rows, RobosuiteTick.missing())


def _loop_table(loops: Mapping[str, Any]) -> Table:
    rows = []
    for name, one in loops.items():
        micro = one["microseconds_per_step"][name]
        cells = [cell_of(micro[key]) for key in ("bare", "drake", "loop", "blocks")]
        ratios = [cell_of(one[key][name]) for key in ("ratios", "ratios_blocks")]
        experiment = BENCH_CASES[name][0]
        factors = [
            cell_of(one[key].get(experiment))
            for key in ("real_time_factor", "real_time_factor_blocks")
        ]
        rows.append((name, *cells, *ratios, *factors))
    head = (
        "closed loop",
        "bare Drake [µs]",
        "Drake's controller [µs]",
        "compiled [µs]",
        "blocks [µs]",
        "compiled / bare",
        "blocks / bare",
        "compiled: × real time",
        "blocks: × real time",
    )
    text = (
        "Per plant step of 1 ms, from one state, in rounds: the plant alone under a constant "
        "torque, under Drake's InverseDynamicsController, and under this library in both forms; "
        "real time with logging. …_free is motion without contact."
    )
    return Table("Closed loops in Drake", head, tuple(rows), text)


def _machine_table(told: Mapping[str, str]) -> Table:
    return Table("Machine and versions", ("", ""), tuple(told.items()))


def _figure(ticks: Mapping[str, Any]) -> Figure:
    """Returns a bar a tick, on a logarithmic scale."""
    micro = ticks.get("microseconds_per_tick", {})
    names = [key for key in _TICKS if any(key in one for one in micro.values())]
    with figure_style():
        figure = Figure(figsize=(8, 3.2), layout="constrained")
        axes = figure.subplots()
        width = 0.8 / max(1, len(micro))
        for k, (case, one) in enumerate(micro.items()):
            values = [one.get(key, np.nan) for key in names]
            axes.barh(np.arange(len(names)) + k * width, values, width, label=case)
        axes.set_yticks(np.arange(len(names)) + 0.4 - width / 2, [_TICKS[key][0] for key in names])
        axes.invert_yaxis()
        axes.set_xlabel("a tick [µs]")
        if names:
            make_logarithmic(axes, "x")
            axes.legend()
    return figure
