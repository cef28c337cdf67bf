"""The experiments of the chapter by name: how each is built, judged and drawn."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from geoimp_drake.diagrams.experiments import consistency, plexiglas, redundancy, singularity
from geoimp_drake.diagrams.single_arm import SingleArmScenario, build_single_arm
from geoimp_drake.scenario import load_scenario, read_yaml
from geoimp_drake.simulation.claims import Claim
from geoimp_drake.typing import Array
from geoimp_drake.validation import unknown_name

__all__ = ["EXPERIMENTS", "Experiment", "get_experiment"]

_FOLDER = Path(__file__).resolve().parent

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Experiment:
    """One experiment.

    Attributes:
        name: as on the command line; its scenario is NAME.yaml beside this file.
        summary: one line on what it shows.
        schema: the scenario's dataclass.
        build: makes the set-up of a scenario, with a Meshcat or without.
        claims: judges a log.
        figures: draws a log; by file name without suffix.
        view: from where a replay is seen, and where to, in W [m].
    """

    name: str
    summary: str
    schema: type[Any]
    build: Callable[..., Any]
    claims: Callable[[dict[str, Array], Any], list[Claim]]
    figures: Callable[[dict[str, Array], Any], dict[str, Figure]]
    view: tuple[Point, Point] = ((2.05, -1.55, 1.25), (0.5, 0.0, 0.75))

    def scenario(
        self, layers: tuple[dict[str, Any], ...] = (), overrides: tuple[str, ...] = ()
    ) -> Any:
        """Returns the scenario: the experiment's own file, then layers, then overrides.

        Raises:
            ConfigurationError: a key or value cannot be used; the message names it.
        """
        return load_scenario(self.schema, (self.defaults(), *layers), overrides)

    def defaults(self) -> dict[str, Any]:
        """Returns the data of the experiment's own scenario file."""
        return read_yaml(_FOLDER / f"{self.name}.yaml")


EXPERIMENTS = {
    experiment.name: experiment
    for experiment in (
        Experiment(
            "plexiglas",
            "a tilted disk presses onto a compliant surface (case 1, Fig 5.3)",
            SingleArmScenario,
            build_single_arm,
            plexiglas.claims,
            plexiglas.figures,
        ),
        Experiment(
            "singularity",
            "contact near the singularity of the Euler angles (case 2, Figs 5.4, 5.5)",
            SingleArmScenario,
            build_single_arm,
            singularity.claims,
            singularity.figures,
        ),
        Experiment(
            "consistency",
            "a torque on the free hand turns it about the torque's axis (case 3, Figs 5.6, 5.7)",
            SingleArmScenario,
            build_single_arm,
            consistency.consistency_claims,
            consistency.consistency_figures,
        ),
        Experiment(
            "nondiagonal",
            "the same about a principal axis of a nondiagonal stiffness (case 4, Figs 5.8, 5.9)",
            SingleArmScenario,
            build_single_arm,
            consistency.nondiagonal_claims,
            consistency.nondiagonal_figures,
        ),
        Experiment(
            "redundancy",
            "the arm on the track turns its elbow, then feels a box (case 5, Figs 5.10, 5.11)",
            SingleArmScenario,
            build_single_arm,
            redundancy.claims,
            redundancy.figures,
            view=((2.3, 1.1, 1.5), (0.0, 1.35, 0.75)),
        ),
    )
}


def get_experiment(name: str) -> Experiment:
    """Returns the experiment called `name`.

    Raises:
        ConfigurationError: there is none; the message lists those that there are.
    """
    if name not in EXPERIMENTS:
        raise unknown_name(name, "experiment", EXPERIMENTS)
    return EXPERIMENTS[name]
