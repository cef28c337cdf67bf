"""The plan of a tuning as a user writes it: objectives, constraints, walls and gains."""

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from geoimp_drake.analysis.contact_model import GAINS, ROBUSTNESS
from geoimp_drake.analysis.encounter import METRICS
from geoimp_drake.analysis.tuning import UNITS, Constraint
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.scenario.loading import read_yaml
from geoimp_drake.validation import LARGEST_SEED, choice, positive, quoted, whole_number

__all__ = ["Range", "TuningPlan"]

_MOST_EVALUATIONS = 100_000
_CONSTRAINT = re.compile(r"\s*(\w+)\s*([<>])=?\s*(\S+)\s*")

Range = tuple[float, float]


@dataclass(frozen=True)
class TuningPlan:
    """The plan of a tuning.

    Attributes:
        minimize: names of METRICS; with several it searches for the front.
        subject_to: constraints; if empty, they follow from the given gains.
        surface_stiffness: of the walls [N/m]; None for the experiment's own.
        vary: bounds of M, D, K along the wall's normal; None for bounds about the given gain.
        seed: of the search.
        evaluations: number of rollouts of the law in each search.
        runs: largest number of runs of the experiment, if the rollout is not right.
    """

    minimize: tuple[str, ...] = ("peak_force",)
    subject_to: tuple[Constraint, ...] = ()
    surface_stiffness: Range | None = None
    vary: dict[str, Range | None] = field(default_factory=lambda: {"D": None, "M": None})
    seed: int = 0
    evaluations: int = 300
    runs: int = 24

    @staticmethod
    def read(file: Path | None = None, **given: Any) -> "TuningPlan":
        """Returns a plan from a YAML file, with the other arguments laid over it.

        Args:
            file: has any of the keys below; their values are lists, or one text with commas.
            **given: `minimize`, `subject_to` (as `settling<3`), `surface_stiffness` (as `5e3:2e4`),
                `vary` (as `D`, or `D=50:2000`), `seed`, `evaluations`, `runs`; None for those not
                given.

        Raises:
            ConfigurationError: something in them cannot be used; the message names it.
        """
        data = read_yaml(file) if file else {}
        for name in data:
            choice(str(name), f"key in {file}", TuningPlan.__dataclass_fields__)
        data = {**data, **{name: value for name, value in given.items() if value is not None}}
        made = {name: _READERS.get(name, _same)(value) for name, value in data.items()}
        plan = TuningPlan(**made)
        plan.validate()
        return plan

    def validate(self) -> None:
        """Raises ConfigurationError if a field cannot be used."""
        whole_number(self.seed, "seed", 0, LARGEST_SEED)
        whole_number(self.evaluations, "evaluations", 1, _MOST_EVALUATIONS)
        whole_number(self.runs, "runs", 0, _MOST_EVALUATIONS)
        if not (self.minimize and self.vary):
            raise ConfigurationError(
                "Nothing is minimized or varied; give --minimize peak_force --vary D,M."
            )


def _texts(value: Any) -> list[str]:
    """Returns the texts of a list; commas in an entry separate several."""
    texts = value if isinstance(value, list) else [value]
    return [part.strip() for text in texts for part in str(text).split(",") if part.strip()]


def _objectives(value: Any) -> tuple[str, ...]:
    names = _texts(value)
    for name in names:
        choice(name, "objective", METRICS)
    return tuple(dict.fromkeys(names))


def _constraints(value: Any) -> tuple[Constraint, ...]:
    return tuple(_constraint(text) for text in _texts(value))


def _constraint(text: str) -> Constraint:
    match = _CONSTRAINT.fullmatch(text)
    if match is None:
        raise ConfigurationError(
            f"{quoted(text)} is not of the form NAME<NUMBER or NAME>NUMBER, as settling<3."
        )
    name, sign, bound = match.groups()
    choice(name, "metric of a constraint", UNITS)
    if name == ROBUSTNESS and sign == "<":
        raise ConfigurationError(f"{quoted(text)} asks for ringing; give {name}>{bound}.")
    return Constraint(name, _positive(bound, text), sign == "<")


def _gains(value: Any) -> dict[str, Range | None]:
    pairs = [text.partition("=") for text in _texts(value)]
    for name, _, _ in pairs:
        choice(name, "gain to vary", GAINS)
    found = {name: _range(bounds) if equals else None for name, equals, bounds in pairs}
    for name, bounds in found.items():
        if bounds is not None and bounds[0] == bounds[1]:
            raise ConfigurationError(
                f"{name}={bounds[0]:g}:{bounds[1]:g} leaves nothing to vary; give LOW:HIGH, or set "
                f"the gain with --set."
            )
    return found


def _range(value: Any) -> Range:
    """Returns the bounds of LOW:HIGH; a single number is both bounds."""
    low, colon, high = str(value).partition(":")
    bounds = _positive(low, str(value)), _positive(high if colon else low, str(value))
    if bounds[0] > bounds[1]:
        raise ConfigurationError(f"{value} is from high to low; give LOW:HIGH with LOW first.")
    return bounds


def _positive(text: str, whole: str) -> float:
    """Returns the positive number in a part of a text."""
    try:
        number = float(text)
    except ValueError:
        raise ConfigurationError(
            f"{quoted(text)} in {quoted(whole)} is not a number; give one."
        ) from None
    positive(number, f"The number in {quoted(whole)}")
    return number


def _same(value: Any) -> Any:
    return value


_READERS: dict[str, Callable[[Any], Any]] = {
    "minimize": _objectives,
    "subject_to": _constraints,
    "surface_stiffness": _range,
    "vary": _gains,
}
