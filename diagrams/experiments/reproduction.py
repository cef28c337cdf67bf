"""The runs of `geoimp reproduce` for each experiment; reproduction.yaml has words and settings."""

import importlib.util
import logging
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from geoimp_drake.campaigns.reproduction import Section
from geoimp_drake.campaigns.study import Study, Variant
from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS
from geoimp_drake.diagrams.experiments.comparisons import COMPARISONS
from geoimp_drake.diagrams.experiments.contrasts import CONTRASTS
from geoimp_drake.diagrams.experiments.simulators import SIMULATORS
from geoimp_drake.diagrams.experiments.worlds import WorldsSection
from geoimp_drake.extras import how_to_install
from geoimp_drake.scenario.loading import read_yaml

__all__ = ["get_study", "sections", "studies"]

_log = logging.getLogger("drake")


def studies() -> tuple[Study, ...]:
    """Returns every experiment with its variants, in the catalogue's order, then two simulators.

    The simulators' studies are left out, with a word in Drake's log, if MuJoCo is not installed.
    """
    names = list(EXPERIMENTS)
    if importlib.util.find_spec("mujoco") is not None:
        names += [f"{name}_two_simulators" for name in SIMULATORS]
    else:
        _log.info(f"MuJoCo is not there to be compared with Drake: {how_to_install('mujoco')}")
    return tuple(map(get_study, names))


def sections() -> tuple[Section, ...]:
    """Returns the further sections."""
    return (WorldsSection(),)


def get_study(name: str) -> Study:
    """Returns a study by the name of its folder."""
    data = _data()[name]
    variants = tuple(_variants(data))
    comparison, experiment = data["comparison"], data.get("experiment")
    own = CONTRASTS.get(name) or COMPARISONS.get(name)
    return Study(
        experiment=EXPERIMENTS[experiment or name],
        name=name,
        variants=variants,
        comparison=SIMULATORS[experiment] if experiment else own,
        compared=tuple(comparison.get("variants", [variant.name for variant in variants])),
        kind=comparison["kind"],
        text=comparison["text"],
        cost=data["cost"],
    )


@cache
def _data() -> dict[str, Any]:
    return read_yaml(Path(__file__).with_suffix(".yaml"))


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
