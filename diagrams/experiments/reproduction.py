"""What `geoimp reproduce` runs of each experiment; in words and settings in reproduction.yaml."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from geoimp_drake.campaigns.reproduction import Section
from geoimp_drake.campaigns.study import Study, Variant
from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS
from geoimp_drake.diagrams.experiments.comparisons import COMPARISONS
from geoimp_drake.diagrams.experiments.contrasts import CONTRASTS
from geoimp_drake.diagrams.experiments.worlds import WorldsSection
from geoimp_drake.scenario.loading import read_yaml

__all__ = ["sections", "studies"]


def studies() -> tuple[Study, ...]:
    """Returns every experiment with its variants, in the catalogue's order."""
    data = read_yaml(Path(__file__).with_suffix(".yaml"))
    return tuple(_study(name, data[name]) for name in EXPERIMENTS)


def sections() -> tuple[Section, ...]:
    """Returns what is run besides."""
    return (WorldsSection(),)


def _study(name: str, data: Mapping[str, Any]) -> Study:
    variants = tuple(_variants(data))
    comparison = data["comparison"]
    return Study(
        experiment=EXPERIMENTS[name],
        variants=variants,
        comparison=CONTRASTS.get(name) or COMPARISONS[name],
        compared=tuple(comparison.get("variants", [variant.name for variant in variants])),
        kind=comparison["kind"],
        text=comparison["text"],
        cost=data["cost"],
    )


def _variants(data: Mapping[str, Any]) -> Iterator[Variant]:
    """Yields the variants of an experiment, and each of its schemes with each of its errors."""
    for name, one in data.get("variants", {}).items():
        yield _variant(name, one)
    for scheme, own in data.get("schemes", {}).items():
        for error in own.get("errors", data["errors"]):
            other = data["errors"][error]
            settings = (*own["settings"], *other["settings"])
            title = f"{scheme}, {other['title']}"
            yield Variant(f"{scheme}-{error}", title, settings, own["figures"], {})


def _variant(name: str, data: Mapping[str, Any]) -> Variant:
    return Variant(
        name, data["title"], tuple(data["settings"]), data["figures"], data.get("contrast", {})
    )
