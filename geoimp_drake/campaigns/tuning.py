"""Tunes the gains of an experiment on rollouts of the law, and verifies them on the experiment."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from geoimp_drake.analysis.contact_model import ROBUSTNESS
from geoimp_drake.analysis.evolution import check_cma, minimize
from geoimp_drake.analysis.pareto import balance, explored, front_of
from geoimp_drake.analysis.report import loop_of
from geoimp_drake.analysis.tuning import Candidate, Objective, Tuning, best
from geoimp_drake.campaigns.many_runs import check_jobs
from geoimp_drake.campaigns.tuning_plan import TuningPlan
from geoimp_drake.campaigns.tuning_problem import tuning_of
from geoimp_drake.campaigns.tuning_run import Trial, whole_log
from geoimp_drake.campaigns.tuning_trials import Trials
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.typing import Array

__all__ = ["Side", "TuningResult", "tune"]

# Of the search among runs: draws near the rollout's optimum, few at a time.
_NEAR, _FEW = 0.1, 6


@dataclass(frozen=True)
class Side:
    """The given or the tuned gains, with their metrics.

    Attributes:
        gains: M, D, K along the wall's normal.
        modelled: metrics of the rollout on the experiment's wall, and ROBUSTNESS.
        measured: metrics of the run.
        failed: claims of the experiment that do not hold.
        force: of the run (N) [N].
    """

    gains: dict[str, float]
    modelled: dict[str, float]
    measured: dict[str, float]
    failed: list[str]
    force: list[float]


@dataclass(frozen=True)
class TuningResult:
    """The results of a tuning.

    Attributes:
        tuning: the problem.
        before: the given gains.
        after: the tuned gains.
        scenario: the one with the tuned gains.
        front: of the rollout; one candidate for one objective.
        runs: number of runs in which the search went on; zero where the rollout is right.
        times: of the forces (N) [s].
    """

    tuning: Tuning
    before: Side
    after: Side
    scenario: Any
    front: list[Candidate]
    runs: int
    times: Array


def tune(
    experiment: Any, scenario: Any, plan: TuningPlan, out: Path, *, jobs: int = 1
) -> TuningResult:
    """Returns better gains for an experiment; it writes only the journal of its runs.

    Args:
        experiment: from the catalogue.
        scenario: the experiment's; the search begins with its gains, and open fields are filled in.
        plan: the objectives, constraints and varied gains.
        out: folder for the journal.
        jobs: processes on this machine, for runs of the experiment.

    Raises:
        ConfigurationError: an extra is missing, the experiment has no contact to tune, or no gains
            within the bounds keep the constraints.
        GeoimpError: the experiment cannot be run.
    """
    plan.validate()
    check_cma("geoimp tune")
    check_jobs(jobs, "geoimp tune")
    setup = experiment.build(scenario)
    log = whole_log(setup, scenario)
    loop = loop_of(setup)
    encounter = experiment.encounter(log, scenario, loop.step)
    given = Trial(experiment, {}, encounter.touch).told(log, scenario)
    tuning = tuning_of(plan, loop, encounter, given["metrics"])

    tried = explored(tuning, plan.evaluations)
    front = front_of(tried)
    objective = balance(front or tried)
    found = _kept(tuning, best(tried, objective), "the rollout")
    trials = Trials(experiment, scenario, tuning, given["failed"], out, jobs)
    (verified,) = trials.run([found.gains])
    runs = 0 if trials.agrees(verified) else plan.runs
    if runs:
        found = _kept(tuning, _searched(trials, verified, objective, runs), "the experiment")
    return TuningResult(
        tuning,
        _side(tuning, tuning.model.given, given),
        _side(tuning, {**tuning.model.given, **found.gains}, trials.of(found.gains)),
        experiment.scenario((trials.scenario_with(found.gains),)),
        front,
        runs,
        log["t"],
    )


def _searched(trials: Trials, start: Candidate, objective: Objective, runs: int) -> Candidate:
    """Returns the best of a start and of the runs near it."""
    tuning, seen = trials.tuning, [start]

    def evaluate(places: Any) -> list[float]:
        new = trials.run([tuning.gains_at(place) for place in places])
        seen.extend(new)
        return [candidate.fitness(objective) for candidate in new]

    minimize(
        evaluate,
        tuning.place_of(start.gains),
        seed=tuning.seed,
        evaluations=runs,
        sigma=_NEAR,
        population=_FEW,
    )
    return best(seen, objective)


def _kept(tuning: Tuning, found: Candidate, where: str) -> Candidate:
    """Returns a candidate that keeps the constraints; raises ConfigurationError for another."""
    most = tuning.model.largest_surface_stiffness(found.gains)
    rings = [c for c in tuning.constraints if c.name == ROBUSTNESS and c.broken(most)]
    if found.broken or rings:
        asked = ", ".join(map(str, tuning.constraints))
        ranges = ", ".join(f"{name}={a:.4g}:{b:.4g}" for name, (a, b) in tuning.bounds.items())
        gains = ", ".join(f"{name}={value:.4g}" for name, value in found.gains.items())
        raise ConfigurationError(
            f"No gains within {ranges} keep {asked} on {where}: {gains} comes nearest, off by "
            f"{100 * found.broken:.3g} % of a bound. Loosen a constraint, or widen --vary."
        )
    return found


def _side(tuning: Tuning, gains: Mapping[str, float], told: Mapping[str, Any]) -> Side:
    model = tuning.model
    modelled = {**model.metrics(gains), ROBUSTNESS: model.largest_surface_stiffness(gains)}
    return Side(dict(gains), modelled, told["metrics"], told["failed"], told["force"])
