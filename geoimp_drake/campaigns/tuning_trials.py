"""Runs of an experiment with other gains, as candidates of a tuning."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from geoimp_drake.analysis.tuning import Candidate, Tuning
from geoimp_drake.campaigns.many_runs import run_many
from geoimp_drake.campaigns.tuning_run import TRIAL_FIELDS, Trial, run_trial, with_gains
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.scenario.loading import plain_data
from geoimp_drake.simulation.experiment import versions

__all__ = ["JOURNAL", "Trials"]

JOURNAL = "runs.jsonl"
# The relative error that a rollout may have.
_TRUSTED = 0.1


@dataclass
class Trials:
    """Runs of an experiment with gains of their own, in processes of their own.

    Attributes:
        experiment: from the catalogue.
        scenario: as given.
        tuning: the one that judges.
        failed: claims that do not hold with the given gains.
        out: folder of the journal.
        jobs: processes.
        told: results of runs, by key.
    """

    experiment: Any
    scenario: Any
    tuning: Tuning
    failed: list[str]
    out: Path
    jobs: int
    told: dict[str, dict[str, Any]] = field(default_factory=dict)

    def scenario_with(self, gains: Mapping[str, float]) -> dict[str, Any]:
        """Returns the data of the scenario with gains."""
        given = self.tuning.model.given
        return with_gains(self.scenario, {name: gains[name] / given[name] for name in gains})

    def run(self, many: Sequence[Mapping[str, float]]) -> list[Candidate]:
        """Returns the candidates of gains from runs; runs in the journal are not repeated.

        Raises:
            ConfigurationError: no gains can be run.
        """
        touch = self.tuning.model.encounter.touch
        ended = run_many(
            {
                _key(gains): Trial(self.experiment, self.scenario_with(gains), touch)
                for gains in many
            },
            run_trial,
            jobs=self.jobs,
            journal=self.out / JOURNAL,
            plan={"scenario": plain_data(self.scenario), "touch": touch, "versions": versions()},
            label="geoimp tune",
            fields=TRIAL_FIELDS,
        )
        self.told |= {key: finished.result for key, finished in ended.items() if finished.result}
        errors = [f"{key}: {finished.error}" for key, finished in ended.items() if finished.error]
        if len(errors) == len(ended):
            raise ConfigurationError(f"The experiment does not run with {errors[0]}")
        return [self._candidate(gains) for gains in many]

    def of(self, gains: Mapping[str, float]) -> dict[str, Any]:
        """Returns the results of the run with these gains."""
        return self.told[_key(gains)]

    def _candidate(self, gains: Mapping[str, float]) -> Candidate:
        """Returns the candidate of a run; a claim that it newly breaks is a broken bound, too."""
        if _key(gains) not in self.told:
            return Candidate(dict(gains), (np.inf,) * len(self.tuning.objectives), np.inf, 0.0)
        told = self.of(gains)
        candidate = self.tuning.judged(gains, [told["metrics"]])
        newly = [claim for claim in told["failed"] if claim not in self.failed]
        return replace(candidate, broken=candidate.broken + len(newly))

    def agrees(self, candidate: Candidate) -> bool:
        """Returns whether a run keeps the constraints, and its objectives are as in the rollout."""
        modelled = self.tuning.model.metrics(candidate.gains)
        return not candidate.broken and all(
            abs(modelled[name] - value) <= _TRUSTED * value
            for name, value in zip(self.tuning.objectives, candidate.values, strict=True)
        )


def _key(gains: Mapping[str, float]) -> str:
    return " ".join(f"{name}={value!r}" for name, value in gains.items())
