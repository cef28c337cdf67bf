"""Published metrics, computed here under the same names, with the published numbers beside ours.

```
 OUT/published_metrics.csv         a number a row: metric, whose, conditions, source, what differs
 OUT/published_metrics.png, .pdf   the same, a panel a metric
 OUT/journal.jsonl                 what has finished
```
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from geoimp_drake.analysis.response_metrics import (
    force_overshoot,
    ideal_response,
    impedance_fidelity,
    impedance_power,
    jerk,
    root_mean_square,
    time_above,
)
from geoimp_drake.campaigns.fastest_form import fastest_form
from geoimp_drake.campaigns.journal import Finished
from geoimp_drake.campaigns.many_runs import run_many
from geoimp_drake.campaigns.reproduction import SectionResult
from geoimp_drake.campaigns.study_run import identity_of
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.experiments.disturbance import measured
from geoimp_drake.diagrams.experiments.encounters import contact_force
from geoimp_drake.diagrams.experiments.measures import (
    Log,
    orientation_angle,
    position_offset,
    true_motion,
)
from geoimp_drake.diagrams.experiments.published_table import (
    figure,
    report_table,
    rows_of,
    table,
)
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.errors import one_line
from geoimp_drake.output_folder import write_files
from geoimp_drake.scenario.loading import plain_data, read_yaml
from geoimp_drake.simulation.claims import Claim, at_most, phase_reached
from geoimp_drake.simulation.experiment import simulated
from geoimp_drake.simulation.style import figure_contents, figure_files
from geoimp_drake.systems.frame_motion import LINEAR_ACCELERATION, LINEAR_VELOCITY
from geoimp_drake.systems.sources.desired_motion import phases_of

__all__ = ["PublishedMetricsSection", "step_metrics", "task_metrics"]

_NAME, _JOURNAL = "published_metrics", "journal.jsonl"
_FILES = (_JOURNAL, f"{_NAME}.csv", *figure_files(_NAME))
_FIELDS = {"identity": str, "values": dict, "failure": str | None}
_LIMIT = 20.0  # of the force; publications count the time above it [N]
_STEP = 0.249  # duration of a step in publications [s]

# Bounds of our runs, by metric and run.
_BOUNDS = {
    "regulation_position": {
        "known plant": 0.001,
        "other plant": 2.0,
        "other plant, observer": 0.02,
    },
    "regulation_orientation": {"known plant": 0.001, "other plant": 0.3},
    "tracking_position": {"known plant": 0.1, "other plant": 2.0},
    "tracking_orientation": {"known plant": 0.01, "other plant": 0.2},
    "overshoot": {"known plant": 50.0, "other plant": 50.0},
    "time_above_20N": {"known plant": 0.0, "other plant": 0.0},
    "relative_fidelity": {"step, known plant": 0.25, "step, other plant": 0.25},
}


def task_metrics(log: Log, scenario: SingleArmScenario) -> dict[str, float]:
    """Returns the metrics of a run of `disturbance`, as far as it has come, by key.

    Settling errors are the means of `measured` in the last second of the phase at rest. Tracking is
    the free motion before it. Force and time above 20 N are those of the whole run.
    """
    phases = {name: end for name, _, end in phases_of(scenario.segments)}
    values = {}
    if phase_reached(log, phases["rest"]):
        at_rest = measured(log, scenario)
        values["regulation_position"] = at_rest["rest"]
        values["regulation_orientation"] = at_rest["angle"]
        values |= _tracking(log, scenario, log["t"] <= phases["free motion"])
    if phase_reached(log, phases["hold"]):
        force = contact_force(log, scenario)
        values["overshoot"] = 100.0 * force_overshoot(log["t"], force)
        values["peak_force"] = float(force.max())
        values[f"time_above_{_LIMIT:.0f}N"] = time_above(log["t"], force, _LIMIT)
    return values


def _tracking(log: Log, scenario: SingleArmScenario, moving: Any) -> dict[str, float]:
    arm = scenario.arm
    distance = np.linalg.norm(position_offset(log, arm)[moving], axis=1)
    acceleration = true_motion(log, arm)[moving, LINEAR_ACCELERATION]
    return {
        "tracking_position_mean": float(distance.mean()),
        "tracking_position": root_mean_square(distance),
        "tracking_orientation": root_mean_square(orientation_angle(log, arm)[moving]),
        "jerk": float(jerk(log["t"][moving], acceleration).max()),
    }


def step_metrics(log: Log, scenario: SingleArmScenario) -> dict[str, float]:
    """Returns the impedance fidelity of a run with a force step on the free hand, by key.

    A force f is a step of the equilibrium by K⁻¹ f. The powers of E and of the configured impedance
    are compared over the first 0.249 s. Rotation is left out.
    """
    t = log["t"]
    if not phase_reached(log, _STEP) or scenario.external is None:
        return {}
    profile = scenario.external.profile()
    force = np.outer([profile(time) for time in t], scenario.external.force)
    M, D, K = scenario.impedance.gains("translation")
    shift = np.linalg.solve(K, scenario.external.force)
    ideal = ideal_response(t, force, M, D, K)
    own = (
        -1e-3 * position_offset(log, scenario.arm),
        true_motion(log, scenario.arm)[:, LINEAR_VELOCITY],
    )
    early = t <= _STEP
    power, asked = (impedance_power(x[early] - shift, v[early], D, K) for x, v in (own, ideal))
    off = impedance_fidelity(power, asked)
    return {"fidelity": off, "relative_fidelity": off / root_mean_square(asked)}


def _measure(run: Mapping[str, Any]) -> dict[str, Any]:
    """Returns a run's `values` by metric, its `identity` and its failure."""
    experiment = get_experiment(run["experiment"])
    scenario = experiment.scenario((run["scenario"],))
    log, failure = simulated(experiment.build(scenario), scenario)
    metrics = task_metrics if scenario.external is None else step_metrics
    return {
        "identity": _identity(run),
        "values": metrics(log, scenario),
        "failure": None if failure is None else one_line(failure),
    }


def _identity(run: Mapping[str, Any]) -> str:
    return identity_of(run["scenario"], html=False)


def _runs(plan: Mapping[str, Any], overrides: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Returns the runs by name: experiment and data of the scenario."""
    runs = {}
    for name, run in plan["runs"].items():
        settings = (*run["settings"], *run.get("world", ()), *overrides)
        scenario = get_experiment(run["experiment"]).scenario((fastest_form(),), settings)
        runs[name] = {"experiment": run["experiment"], "scenario": plain_data(scenario)}
    return runs


def _claims(plan: Mapping[str, Any], values: Mapping[str, Mapping[str, float]]) -> list[Claim]:
    """Returns our bounds; nothing is claimed against the published numbers."""
    return [
        at_most(
            f"{run}: {plan['metrics'][metric]['name']}",
            values.get(run, {}).get(metric),
            bound,
            plan["metrics"][metric]["unit"].strip("-"),
        )
        for metric, bounds in _BOUNDS.items()
        for run, bound in bounds.items()
        if run in plan["runs"]
    ]


class PublishedMetricsSection:
    """The part of a report that puts our numbers beside published ones."""

    name = _NAME
    files = _FILES

    def run(
        self,
        out: Path,
        jobs: int,
        overrides: Sequence[str],
        plan: Mapping[str, Any] | None = None,
    ) -> SectionResult:
        """Runs the cases that `out` does not have yet, and writes table and figure.

        Args:
            out: folder to write into; made if need be.
            jobs: processes on this machine.
            overrides: settings of every run.
            plan: the runs and the published numbers; `published_metrics.yaml` by default.

        Raises:
            ConfigurationError: an override or the folder cannot be used; nothing has been written.
            OutputError: the disk is full.
        """
        plan = plan or read_yaml(Path(__file__).with_suffix(".yaml"))
        runs = _runs(plan, overrides)
        finished = run_many(
            runs,
            _measure,
            jobs=jobs,
            journal=out / _JOURNAL,
            plan={"section": self.name},
            label="published metrics",
            fields=_FIELDS,
            is_current=lambda key, ended: key in runs and _is_current(runs[key], ended),
        )
        values = {
            key: (ended.result or {"values": {}})["values"] for key, ended in finished.items()
        }
        rows = rows_of(plan, values)
        drawn = figure_contents(_NAME, figure(plan, rows))
        write_files(out, [(f"{_NAME}.csv", table(plan, rows)), *drawn])
        return SectionResult(
            _NAME,
            plan["summary"],
            plan["text"],
            tuple(_claims(plan, values)),
            _NAME,
            (f"{_NAME}.csv", _JOURNAL),
            {key: failure for key, ended in finished.items() if (failure := _failure(ended))},
            (report_table(plan, rows),),
        )


def _is_current(run: Mapping[str, Any], ended: Finished) -> bool:
    return bool(ended.result) and ended.result["identity"] == _identity(run)


def _failure(ended: Finished) -> str | None:
    failure: str | None = ended.result["failure"] if ended.result else ended.error
    return failure
