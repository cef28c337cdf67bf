"""YAML as scenarios have it: what is read, and what gets one line instead of time and memory."""

import re
import tracemalloc

import pytest
from library_tree import MODULES

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.scenario.loading import read_yaml
from geoimp_drake.scenario.yaml_text import parse_yaml


def bomb(levels: int, width: int = 10) -> str:
    """A list of lists of … numbers, `width` of them at each level, in a line a level."""
    inner = ["1", *(f"*a{level}" for level in range(levels - 1))]
    lines = (f"a{k}: &a{k} [{', '.join([item] * width)}]" for k, item in enumerate(inner))
    return "\n".join(lines)


def test_aliases_are_read_where_they_are_few():
    data = parse_yaml(bomb(2, 3), "f")
    assert data == {"a0": [1, 1, 1], "a1": [[1, 1, 1]] * 3}
    data["a1"][0][0] = 2  # as `--set` does
    assert data["a1"][1] == [1, 1, 1]


@pytest.mark.parametrize(
    "text", [bomb(10), "a: &a [*a]", bomb(9).replace("a0: ", "start: {posture: ") + "}"]
)
def test_a_bomb_of_aliases_is_refused_in_little_memory(text):
    tracemalloc.start()
    with pytest.raises(ConfigurationError, match=r"^f.* line \d"):
        parse_yaml(text, "f")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1e7  # the first is a list of 10^10 numbers


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\nb: {c: 2,\n c: 3}", "f, line 3: 'b.c' is in line 2 already; leave one out."),
        ("a: 1\na: 1", "f, line 2: 'a' is in line 1 already"),
        ("a: 1\n1: 2", "f, line 2: the key '1' is no name"),
        ("null: 3", "the key 'null' is no name"),
        ("? [a]\n: 2", "the key 'a collection' is no name"),
        ("a: !!python/object:os.system {}", "line 1: the tag '.*os.system' is not read"),
        ("a: !!binary aGk=", "the tag .* is not read"),
        ("a: *b", "'b' stands for nothing"),
        ("[" * 40 + "]" * 40, "more than 30 levels"),
        ("[" * 100_000, "more than 30 levels|nesting depth"),
        ("[" + "1," * 30_000 + "]", "more than 20000 values"),
        ("a: 1\n---\nb: 2", "line 2: a second document begins"),
        ("a: \udcff", "f is not YAML: "),
        ("a: \x00", "f is not YAML: "),
        ("a: 'b", "f is not YAML: line 1"),
    ],
)
def test_what_is_no_plain_data_gets_one_line(text, message):
    with pytest.raises(ConfigurationError) as raised:
        parse_yaml(text, "f")
    assert re.search(message, str(raised.value))
    assert len(str(raised.value).splitlines()) == 1
    assert len(str(raised.value)) < 300


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("10", 10),
        ("-3", -3),
        ("0", 0),
        ("010", "010"),  # 8 by YAML 1.1
        ("1:30", "1:30"),  # 90 by YAML 1.1
        ("1:30.5", "1:30.5"),
        ("1_000", "1_000"),
        ("0x10", "0x10"),
        ("on", "on"),
        ("2024-01-01", "2024-01-01"),
        ("true", True),
        ("'true'", "true"),
        ("~", None),
        ("1.5e+3", 1500.0),
        (".5", 0.5),
        ("-.inf", float("-inf")),
        ("9" * 18, 10**18 - 1),
        ("9" * 5000, "9" * 5000),  # Python refuses to convert it
        ("", None),
    ],
)
def test_a_plain_text_is_what_it_looks_like_or_stays_a_text(text, value):
    read = parse_yaml(text, "f")
    assert (read, type(read)) == (value, type(value))


def test_keys_for_anchors_alone_and_merged_mappings_are_read(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text("_gains: &gains {mass: 9, damping: 5}\nrotation: {<<: *gains, mass: 1}")
    assert read_yaml(file) == {"rotation": {"mass": 1, "damping": 5}}


def test_every_value_has_the_line_of_its_key():
    lines: dict[str, int] = {}
    parse_yaml("a: 1\nb:\n  c:\n    - 2\n    - {d: 3}\n", "f", lines)
    assert lines == {"a": 1, "b": 2, "b.c": 3, "b.c.0": 4, "b.c.1": 5, "b.c.1.d": 5}


def test_nothing_else_in_the_library_reads_yaml():
    """But Drake, what has been read and written again: `yaml_load_typed` fills the dataclasses."""
    reader = re.compile(r"\b(yaml_load|yaml_load_file|yaml\.\w*load\w*|yaml\.(parse|compose))\(")
    assert [name for name, file in MODULES.items() if reader.search(file.read_text("utf-8"))] == [
        "geoimp_drake.scenario.yaml_text"
    ]
