"""What is to be reproduced of an experiment: its variants, and how they are compared."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

__all__ = ["Study", "Variant"]


@dataclass(frozen=True)
class Variant:
    """One run of an experiment.

    Attributes:
        name: of its folder.
        title: in words.
        settings: as `--set` takes them, laid over the experiment's own scenario.
        figures: what each figure shows, by file name without suffix.
        contrast: claims that the variant is made to break, each with the reason.
    """

    name: str
    title: str
    settings: tuple[str, ...]
    figures: Mapping[str, str]
    contrast: Mapping[str, str]


@dataclass(frozen=True)
class Study:
    """An experiment with its variants.

    Attributes:
        experiment: of the catalogue.
        name: of its folder and its section.
        variants: the first is the main one, which gets a replay.
        comparison: curves and claims across variants.
        compared: names of the variants that are compared.
        kind: what the compared variants differ in, in words.
        text: what the figure of the comparison shows.
        cost: about how long one run takes to compute [s]; long ones are begun first.
    """

    experiment: Any
    name: str
    variants: tuple[Variant, ...]
    comparison: Any
    compared: tuple[str, ...]
    kind: str
    text: str
    cost: float
