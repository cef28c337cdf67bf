"""The part of an experiment to be reproduced: its variants, and their comparison."""

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
        settings: as for `--set`, laid over the experiment's own scenario.
        figures: a description of each figure, by file name without suffix.
        contrast: claims that the variant breaks on purpose, each with the reason.
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
        kind: the difference of the compared variants, in words.
        text: a description of the comparison's figure.
        cost: approximate computing time of one run [s]; the longest runs begin first.
    """

    experiment: Any
    name: str
    variants: tuple[Variant, ...]
    comparison: Any
    compared: tuple[str, ...]
    kind: str
    text: str
    cost: float
