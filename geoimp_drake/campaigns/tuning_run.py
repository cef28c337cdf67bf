"""One run of an experiment with gains of its own, and the metrics of its contact."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from geoimp_drake.analysis.contact_model import GAINS
from geoimp_drake.analysis.encounter import contact_metrics
from geoimp_drake.scenario.loading import plain_data
from geoimp_drake.simulation.experiment import cannot_start, simulated
from geoimp_drake.typing import Array

__all__ = ["TRIAL_FIELDS", "Trial", "run_trial", "whole_log", "with_gains"]

# Types of the results of `run_trial`.
TRIAL_FIELDS = {"metrics": dict, "failed": list, "force": list}


@dataclass(frozen=True)
class Trial:
    """All that a process needs for a run with given gains.

    Attributes:
        experiment: from the catalogue.
        scenario: data of the scenario, with the gains.
        touch: when D is in the wall [s].
    """

    experiment: Any
    scenario: dict[str, Any]
    touch: float

    def told(self, log: dict[str, Array], scenario: Any) -> dict[str, Any]:
        """Returns `metrics` and `force` (N) of a log, and `failed`, the claims that do not hold."""
        force = self.experiment.contact_force(log, scenario)
        claims = self.experiment.claims(log, scenario)
        return {
            "metrics": contact_metrics(log["t"], force, self.touch),
            "failed": [claim.claim for claim in claims if claim.holds is False],
            "force": force.tolist(),
        }


def run_trial(trial: Trial) -> dict[str, Any]:
    """Returns the results of `Trial.told` for a run.

    Raises:
        GeoimpError: the scenario cannot be used, or the simulation fails.
    """
    scenario = trial.experiment.scenario((trial.scenario,))
    return trial.told(whole_log(trial.experiment.build(scenario), scenario), scenario)


def whole_log(setup: Any, scenario: Any) -> dict[str, Array]:
    """Returns the log of a scenario's run.

    Raises:
        GeoimpError: the simulation does not reach its end.
    """
    log, failure = simulated(setup, scenario, scenario.experiment)
    if failure is not None:
        raise cannot_start(failure)
    return log


def with_gains(scenario: Any, factors: Mapping[str, float]) -> dict[str, Any]:
    """Returns the data of a scenario whose gains of translation are scaled.

    Args:
        scenario: as given.
        factors: by letter, M, D, K.
    """
    data = plain_data(scenario)
    translation = data["impedance"]["translation"]
    # The gains no longer follow from a design.
    translation["design"] = None
    for letter, factor in factors.items():
        name, _ = GAINS[letter]
        value = factor * np.asarray(getattr(scenario.impedance.translation, name), dtype=float)
        translation[name] = value.tolist()
    return data
