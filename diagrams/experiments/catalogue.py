"""The experiments of the chapter by name: how each is built, judged and drawn.

Nothing is imported before it is needed: naming the experiments is quick.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from geoimp_drake.validation import unknown_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pydrake.geometry import Meshcat

    from geoimp_drake.analysis.encounter import Encounter
    from geoimp_drake.simulation.claims import Claim

__all__ = ["EXPERIMENTS", "OWN", "Experiment", "get_experiment"]

_FOLDER = Path(__file__).resolve().parent
_DIAGRAMS = "geoimp_drake.diagrams"

# The module that builds each kind of set-up; its scenario is in the module beside that.
_SETUPS = {
    "single arm": ("single_arm", "SingleArmScenario", "build_single_arm"),
    "turned arm": ("turned_arm", "TurnedArmScenario", "build_turned_arm"),
    "loose": ("loose", "LooseScenario", "build_loose"),
    "tight": ("tight", "TightScenario", "build_tight"),
}

Point = tuple[float, float, float]
Log = dict[str, Any]


@dataclass(frozen=True)
class Experiment:
    """One experiment.

    Attributes:
        name: as on the command line; its scenario is NAME.yaml beside this file.
        summary: one line on its subject.
        setup: kind of set-up: `single arm`, `loose` or `tight`.
        module: beside this file; its `claims` and `figures` judge and draw a log.
        prefix: of these two functions, where a module serves several experiments.
        view: from where a replay is seen, and where to, in W [m].
    """

    name: str
    summary: str
    setup: str
    module: str
    prefix: str = ""
    view: tuple[Point, Point] = ((2.05, -1.55, 1.25), (0.5, 0.0, 0.75))

    @property
    def schema(self) -> type[Any]:
        """The scenario's dataclass."""
        module, scenario, _ = _SETUPS[self.setup]
        schema: type[Any] = resolve_name(f"{_DIAGRAMS}.setups.{module}_scenario:{scenario}")
        return schema

    @property
    def build(self) -> Callable[..., Any]:
        """Makes the set-up of a scenario, with a Meshcat or without."""
        module, _, builder = _SETUPS[self.setup]
        build: Callable[..., Any] = resolve_name(f"{_DIAGRAMS}.setups.{module}:{builder}")
        return build

    @property
    def run_elsewhere(self) -> Callable[..., Any]:
        """Runs a scenario in the simulator that its `engine` names, which is not Drake."""
        run: Callable[..., Any] = resolve_name(f"{_DIAGRAMS}.setups.mujoco_run:run_in_mujoco")
        return run

    def replay(self, scenario: Any, log: Log) -> "Meshcat":
        """Returns a Meshcat that has recorded a log, made after the run."""
        from geoimp_drake.diagrams.setups.replayed_arm import replay_log
        from geoimp_drake.simulation.replay import start_meshcat, stop_listening

        meshcat = start_meshcat(*self.view)
        stop_listening(meshcat)
        replay_log(scenario, log, meshcat)
        return meshcat

    @property
    def claims(self) -> Callable[[Log, Any], "list[Claim]"]:
        """Judges a log."""
        claims: Callable[[Log, Any], list[Claim]] = self._function("claims")
        return claims

    @property
    def figures(self) -> Callable[[Log, Any], "dict[str, Figure]"]:
        """Draws a log; by file name without suffix. With another world, also the true motion."""
        figures: Callable[[Log, Any], dict[str, Figure]] = self._function("figures")
        if "world" in self.defaults():  # its own figures show that
            return figures
        true: Callable[[Log, Any], dict[str, Figure]]
        true = resolve_name(f"{_DIAGRAMS}.experiments.true_motion:true_motion_figures")
        return lambda log, scenario: {**figures(log, scenario), **true(log, scenario)}

    @property
    def sweep_values(self) -> Callable[[Log, Any], dict[str, float | bool]] | None:
        """Values for a sweep's table, `success` among them; None for those of the claims."""
        module = resolve_name(f"{_DIAGRAMS}.experiments.{self.module}")
        values: Callable[[Log, Any], dict[str, float | bool]] | None
        values = getattr(module, f"{self.prefix}sweep_values", None)
        return values

    @property
    def encounter(self) -> "Callable[[Log, Any, float], Encounter]":
        """Returns how D meets a wall, from a log and the plant's step."""
        module = resolve_name(f"{_DIAGRAMS}.experiments.{self.module}")
        default = resolve_name(f"{_DIAGRAMS}.experiments.encounters:encounter")
        encounter: Callable[[Log, Any, float], Encounter]
        encounter = getattr(module, f"{self.prefix}encounter", default)
        return encounter

    @property
    def contact_force(self) -> Callable[[Log, Any], Any]:
        """Returns the true force of the compliant hand or object over time (N) [N]."""
        force: Callable[[Log, Any], Any]
        force = resolve_name(f"{_DIAGRAMS}.experiments.encounters:contact_force")
        return force

    def _function(self, name: str) -> Any:
        return resolve_name(f"{_DIAGRAMS}.experiments.{self.module}:{self.prefix}{name}")

    def scenario(
        self, layers: tuple[dict[str, Any], ...] = (), overrides: tuple[str, ...] = ()
    ) -> Any:
        """Returns the scenario: the experiment's own file, then layers, then overrides.

        Raises:
            ConfigurationError: a key or value cannot be used; the message names it.
        """
        from geoimp_drake.scenario.loading import load_scenario

        return load_scenario(self.schema, (self.defaults(), *layers), overrides)

    def defaults(self) -> dict[str, Any]:
        """Returns the data of the experiment's own scenario file, if there is one."""
        from geoimp_drake.scenario.loading import read_yaml

        file = _FOLDER / f"{self.name}.yaml"
        return read_yaml(file) if file.exists() else {}


EXPERIMENTS = {
    experiment.name: experiment
    for experiment in (
        Experiment(
            "plexiglas",
            "a tilted disk presses onto a compliant surface (case 1, Fig 5.3)",
            "single arm",
            "plexiglas",
        ),
        Experiment(
            "singularity",
            "contact near the singularity of the Euler angles (case 2, Figs 5.4, 5.5)",
            "single arm",
            "singularity",
        ),
        Experiment(
            "consistency",
            "a torque on the free hand turns it about the torque's axis (case 3, Figs 5.6, 5.7)",
            "single arm",
            "consistency",
            "consistency_",
        ),
        Experiment(
            "nondiagonal",
            "the same about a principal axis of a nondiagonal stiffness (case 4, Figs 5.8, 5.9)",
            "single arm",
            "consistency",
            "nondiagonal_",
        ),
        Experiment(
            "redundancy",
            "the arm on the track turns its elbow, then feels a box (case 5, Figs 5.10, 5.11)",
            "single arm",
            "redundancy",
            view=((2.3, 1.1, 1.5), (0.0, 1.35, 0.75)),
        ),
        Experiment(
            "peg_in_hole",
            "one arm brings a peg by a motion program, the other holds the hole (Fig 5.12)",
            "loose",
            "peg_in_hole",
            view=((0.75, 1.45, 1.2), (0.0, 1.93, 0.87)),
        ),
        Experiment(
            "bar",
            "two arms press a disk on a bar that both hold onto a surface (Fig 5.13)",
            "tight",
            "bar",
            view=((2.6, 0.2, 1.5), (0.0, 1.7, 0.75)),
        ),
        Experiment(
            "disturbance",
            "heavier links and friction under an inner loop, or without one (section 3.3)",
            "single arm",
            "disturbance",
        ),
        Experiment(
            "limits",
            "an arm at the ends of its joints, speeds, torques and reach, and at a singularity",
            "single arm",
            "limits",
        ),
        Experiment(
            "collision",
            "an arm runs into a body, clamped or free, with and without safety limits",
            "single arm",
            "collision",
        ),
        Experiment(
            "orientation_loop",
            "somebody turns the hand round a closed loop: whose spring gives joules away",
            "turned arm",
            "orientation_loop",
        ),
    )
}


# The `experiment` of a user's own scenario file, by kind of set-up.
OWN = {
    setup: Experiment(name, f"your own experiment, {setup}", setup, "custom")
    for setup, name in (
        ("single arm", "custom"),
        ("turned arm", "custom_turned"),
        ("loose", "custom_loose"),
        ("tight", "custom_tight"),
    )
}


def get_experiment(name: str) -> Experiment:
    """Returns the experiment called `name`: of the chapter, or one of `OWN`.

    Raises:
        ConfigurationError: there is none; the message lists the valid names.
    """
    own = {experiment.name: experiment for experiment in OWN.values()}
    if name not in EXPERIMENTS and name not in own:
        raise unknown_name(name, "experiment", EXPERIMENTS)
    return {**EXPERIMENTS, **own}[name]
