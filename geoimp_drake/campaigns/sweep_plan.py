"""The plan of a sweep: its varied keys, and the draws, which are independent of each other."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.scenario.loading import read_yaml
from geoimp_drake.validation import LARGEST, LARGEST_SEED, quoted, unknown_name, whole_number

__all__ = ["Distribution", "Draw", "SweepPlan", "setting"]

_MOST_SAMPLES = 100_000

_KEYS = ("vary", "samples", "seed", "variants")
_PARAMETERS = {"uniform": ("low", "high"), "normal": ("mean", "standard deviation")}


@dataclass(frozen=True)
class Distribution:
    """The distribution of a number.

    Attributes:
        kind: uniform or normal.
        first: the lower bound, or the mean.
        second: the upper bound, or the standard deviation.
    """

    kind: str
    first: float
    second: float

    def validate(self, key: str) -> None:
        """Raises ConfigurationError if the distribution of a key cannot be used."""
        if self.kind not in _PARAMETERS:
            raise unknown_name(self.kind, f"distribution of {key}", _PARAMETERS)
        for name, value in zip(_PARAMETERS[self.kind], (self.first, self.second), strict=True):
            if not abs(value) <= LARGEST:
                raise ConfigurationError(
                    f"The {name} of {key} is {value:g}; it must be finite and at most "
                    f"{LARGEST:g} in size."
                )
        if self.kind == "uniform" and self.first > self.second:
            raise ConfigurationError(
                f"{key} is to be between {self.first:g} and {self.second:g}; give LOW:HIGH with "
                f"LOW at most HIGH."
            )
        if self.kind == "normal" and self.second < 0:
            raise ConfigurationError(
                f"The standard deviation of {key} is {self.second:g}; it must be zero or positive."
            )

    def draw(self, generator: np.random.Generator) -> float:
        """Returns one number."""
        return float(getattr(generator, self.kind)(self.first, self.second))

    def typical(self) -> tuple[float, ...]:
        """Returns the numbers that a scenario must accept at least: both bounds, or the mean."""
        return (self.first, self.second) if self.kind == "uniform" else (self.first,)

    def as_data(self) -> dict[str, list[float]]:
        """Returns the distribution in the form of a plan's YAML."""
        return {self.kind: [self.first, self.second]}


@dataclass(frozen=True)
class Draw:
    """The data of one sample.

    Attributes:
        index: of the sample.
        seed: of its scenario.
        parameters: value of each varied key.
        variant: its name; None if the plan has none.
        settings: of the variant.
    """

    index: int
    seed: int
    parameters: dict[str, float]
    variant: str | None = None
    settings: tuple[str, ...] = ()

    def overrides(self) -> tuple[str, ...]:
        """Returns the settings that make the sample's scenario from the sweep's."""
        own = (setting(key, value) for key, value in self.parameters.items())
        return (f"seed={self.seed}", *self.settings, *own)


@dataclass(frozen=True)
class SweepPlan:
    """The draws of a sweep.

    Attributes:
        vary: distribution of each varied key, by the scenario's own paths.
        samples: their number, of all variants together.
        seed: of the draws.
        variants: settings by name. Each draw is made once, and every variant takes it in turn, so
            that they are compared on the same work.
    """

    vary: dict[str, Distribution] = field(default_factory=dict)
    samples: int = 64
    seed: int = 0
    variants: dict[str, tuple[str, ...]] = field(default_factory=dict)

    @staticmethod
    def read(
        file: Path | None = None,
        ranges: Sequence[str] = (),
        samples: int | None = None,
        seed: int | None = None,
    ) -> "SweepPlan":
        """Returns a plan from a YAML file, with the other arguments laid over it.

        Args:
            file: with `vary: {key.path: {uniform: [low, high]} | {normal: [mean, deviation]}}`,
                and, if need be, `samples`, `seed` and `variants: {name: [key.path=value, …]}`.
            ranges: `key.path=LOW:HIGH` each, uniform.
            samples: their number.
            seed: of the draws.

        Raises:
            ConfigurationError: something in them cannot be used; the message names it.
        """
        data = read_yaml(file) if file else {}
        for key in data.keys() - set(_KEYS):
            raise unknown_name(str(key), f"key in {file}", _KEYS)
        plan = SweepPlan(
            _distributions(data.get("vary", {})) | _ranges(ranges),
            data.get("samples", SweepPlan.samples) if samples is None else samples,
            data.get("seed", SweepPlan.seed) if seed is None else seed,
            _variants(data.get("variants", {})),
        )
        plan.validate()
        return plan

    def validate(self) -> None:
        """Raises ConfigurationError if a field cannot be used."""
        whole_number(self.samples, "samples", 1, _MOST_SAMPLES)
        whole_number(self.seed, "seed", 0, LARGEST_SEED)
        if not self.vary:
            raise ConfigurationError("Nothing is varied; give --vary key.path=LOW:HIGH.")
        for key, distribution in self.vary.items():
            distribution.validate(key)

    def draw(self, index: int) -> Draw:
        """Returns one sample; it depends only on the seed, distributions, variants and index.

        The keys are drawn in alphabetical order, so that their order in the plan does not matter.
        """
        case, turn = divmod(index, len(self.variants) or 1)
        name, settings = [*self.variants.items(), (None, ())][turn]
        sequence = np.random.SeedSequence(self.seed, spawn_key=(case,))
        generator = np.random.default_rng(sequence)
        seed = int(generator.integers(2**31))
        drawn = {key: self.vary[key].draw(generator) for key in sorted(self.vary)}
        return Draw(index, seed, {key: drawn[key] for key in self.vary}, name, settings)

    def as_data(self) -> dict[str, Any]:
        """Returns the plan in the form of its YAML file."""
        vary = {key: distribution.as_data() for key, distribution in self.vary.items()}
        variants = {name: list(settings) for name, settings in self.variants.items()}
        plan = {"vary": vary, "samples": self.samples, "seed": self.seed}
        return {**plan, "variants": variants} if variants else plan


def setting(key: str, value: float) -> str:
    """Returns `key.path=value` as for `--set`, with the value to its last bit."""
    return f"{key}={yaml.safe_dump(value).splitlines()[0]}"


def _ranges(texts: Sequence[str]) -> dict[str, Distribution]:
    """Returns the distributions of `key.path=LOW:HIGH` texts."""
    found: dict[str, Distribution] = {}
    for text in texts:
        key, _, bounds = text.partition("=")
        low, _, high = bounds.partition(":")
        try:
            distribution = Distribution("uniform", float(low), float(high))
        except ValueError:
            key = ""
        if not key:
            raise ConfigurationError(f"{quoted(text)} is not of the form key.path=LOW:HIGH.")
        if key in found:
            raise ConfigurationError(f"{key} is varied twice; give --vary {key}=LOW:HIGH once.")
        found[key] = distribution
    return found


def _variants(data: Any) -> dict[str, tuple[str, ...]]:
    """Returns the variants of a plan's YAML."""
    fits = isinstance(data, Mapping) and all(
        isinstance(settings, list) and all(isinstance(text, str) for text in settings)
        for settings in data.values()
    )
    if not fits:
        raise ConfigurationError(
            f"variants must be a mapping of names to lists of settings key.path=value, not "
            f"{quoted(data)}."
        )
    return {str(name): tuple(settings) for name, settings in data.items()}


def _distributions(data: Any) -> dict[str, Distribution]:
    """Returns the distributions of a plan's YAML."""
    if not isinstance(data, Mapping):
        raise ConfigurationError(f"vary must be a mapping of key paths, not {quoted(data)}.")
    return {str(key): _distribution(str(key), value) for key, value in data.items()}


def _distribution(key: str, data: Any) -> Distribution:
    try:
        ((kind, (first, second)),) = data.items()
        return Distribution(str(kind), float(first), float(second))
    except (AttributeError, TypeError, ValueError, OverflowError):
        raise ConfigurationError(
            f"{key} is varied by {quoted(data)}; give {{uniform: [low, high]}} or "
            f"{{normal: [mean, standard deviation]}}."
        ) from None
