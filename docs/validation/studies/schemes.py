"""Measures the schemes on one motion and contact: what suits which arm.

python docs/validation/studies/schemes.py
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass

from geoimp_drake.diagrams.experiments import disturbance
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.scene.surface_config import plexiglas
from geoimp_drake.simulation.run import simulate

# Natural inertia takes no damping but the default, which stands for none.
SCHEMES = {
    "inner loop": ("scheme=inner-loop",),
    "direct": ("scheme=direct",),
    "direct, natural inertia": (
        "scheme=direct",
        "inertia=natural",
        "impedance.translation.damping=2000",
        "impedance.rotation.damping=5",
    ),
    "admittance": ("scheme=admittance", "servos.period=0.001"),
}
KNOWN = ("world.links.mass=1",)


@dataclass(frozen=True)
class Question:
    """What is asked of each scheme: settings, and what of `disturbance.measured` answers."""

    settings: tuple[str, ...]
    answer: Callable[[dict[str, float]], str]


def periods(milliseconds: int) -> tuple[str, ...]:
    """Returns the settings of readings, and of references, as rare as that."""
    names = ("sampling.period", "sensor.period", "servos.period")
    return (*KNOWN, *(f"{name}={1e-3 * milliseconds:g}" for name in names))


def wall(factor: float) -> tuple[str, ...]:
    """Returns the settings of a plexiglas that is stiffer, and heavier, by a factor."""
    parts = ("layer_stiffness", "mount_stiffness", "mount_damping", "mount_tilt_stiffness")
    parts = (*parts, "mount_tilt_damping", "plate_mass")
    values = {part: factor * getattr(plexiglas(), part) for part in parts}
    return (*KNOWN, *(f"surface.properties.{part}={value:g}" for part, value in values.items()))


def at_rest(values: dict[str, float]) -> str:
    """Returns how far E is from D at rest."""
    return f"{rounded(values['rest'])} mm, {rounded(values['angle'])}°"


def in_motion(values: dict[str, float]) -> str:
    """Returns how far E is from D at most in free motion."""
    return f"{rounded(values['motion'])} mm"


def force(values: dict[str, float]) -> str:
    """Returns how far the contact force is off K_p Δp_de."""
    return f"{rounded(100 * values['force'])} %"


def rounded(value: float) -> str:
    """Returns a number in two digits."""
    return f"{float(f'{value:.2g}'):g}" if value >= 1e-3 else "< 0.001"


QUESTIONS = {
    "all is as known: at rest": Question(KNOWN, at_rest),
    "the sensor is 2 N off: at rest": Question((*KNOWN, "sensor.bias=[0,0,0,0,0,2]"), at_rest),
    "links 10 % heavier: at rest": Question(("world.links.mass=1.1",), at_rest),
    "every 1 ms: in motion": Question(periods(1), in_motion),
    "every 8 ms: in motion": Question(periods(8), in_motion),
    "on 10³ N/m: force": Question(wall(0.1), force),
    "on 10⁴ N/m: force": Question(wall(1.0), force),
    "on 10⁵ N/m: force": Question(wall(10.0), force),
    "on 10⁶ N/m: force": Question(wall(100.0), force),
}


def asked(question: Question, scheme: tuple[str, ...]) -> str:
    """Returns what a run of the experiment answers."""
    experiment = get_experiment("disturbance")
    scenario = experiment.scenario((), (*scheme, *question.settings))
    setup = experiment.build(scenario)
    outcome = simulate(setup.diagram, scenario.simulator, scenario.duration, events=setup.events)
    if outcome.failure is not None:
        return str(outcome.failure)
    return question.answer(disturbance.measured(setup.recorder.collect(outcome.context), scenario))


def main() -> None:
    """Prints the table."""
    logging.getLogger("drake").setLevel(logging.ERROR)
    print(f"| | {' | '.join(SCHEMES)} |\n|{' --- |' * (1 + len(SCHEMES))}")
    for words, question in QUESTIONS.items():
        answers = [asked(question, scheme) for scheme in SCHEMES.values()]
        print(f"| {words} | {' | '.join(answers)} |", flush=True)


if __name__ == "__main__":
    main()
