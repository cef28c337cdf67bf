"""A scenario that is written and read again is the same, whatever its file is laid over."""

import pytest

from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS
from geoimp_drake.scenario.loading import dump_scenario, plain_data
from geoimp_drake.scenario.yaml_text import parse_yaml


@pytest.mark.parametrize(
    ("name", "nulls"),
    [
        ("limits", ("limits=null", "external=null")),
        ("plexiglas", ("surface=null", "start.guess=null")),
        ("disturbance", ("start.guess=null", "start.position=null")),
        ("redundancy", ("redundancy.task=null",)),
        ("bar", ("limits=null",)),
    ],
)
def test_what_was_set_to_null_stays_null(name: str, nulls: tuple[str, ...]) -> None:
    scenario = EXPERIMENTS[name].scenario((), nulls)
    text = dump_scenario(scenario)
    again = EXPERIMENTS[name].scenario((parse_yaml(text, "again"),))
    assert dump_scenario(again) == text
    for null in nulls:
        value = again
        for part in null.removesuffix("=null").split("."):
            value = getattr(value, part)
        assert value is None


def test_a_scenario_is_written_a_key_a_line_and_vectors_on_one() -> None:
    text = dump_scenario(EXPERIMENTS["plexiglas"].scenario())
    assert "\nform: blocks\n" in text
    assert "\n  posture: null\n" in text
    assert "\n  normal: [0.0, 0.0, 1.0]\n" in text


def test_plain_data_are_what_is_written() -> None:
    scenario = EXPERIMENTS["peg_in_hole"].scenario()
    assert parse_yaml(dump_scenario(scenario), "written") == plain_data(scenario)
