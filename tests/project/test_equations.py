"""EQUATIONS.md is true: each row leads to code that names the equation and to tests that exist."""

import ast
import importlib
import inspect
import re
from collections.abc import Iterator
from typing import NamedTuple

import pytest
from library_tree import MODULES, ROOT, parsed

TEXT = (ROOT / "EQUATIONS.md").read_text(encoding="utf-8")
TABLES, _, LISTS = TEXT.partition("\n## The others\n")
NUMBER = r"\(\d\.\d+(?: (?:coupled|direct|natural|trace))?\)|\([ALR]\.\d\)|Table \d\.\d+"

# Every equation of the chapter, those that have a name instead of a number of their own, and the
# library's own about limits and admittance.
CHAPTER = [
    *(
        f"({section}.{k})"
        for section, last in ((2, 15), (3, 39), (4, 15))
        for k in range(1, last + 1)
    ),
    "Table 2.1",
    "(3.1 direct)",
    "(3.1 natural)",
    "(3.21 coupled)",
    "(3.29 trace)",
    "(3.31 coupled)",
    *(f"(L.{k})" for k in range(1, 10)),
    "(A.1)",
    *(f"(R.{k})" for k in range(1, 5)),
]


class Row(NamedTuple):
    equation: str
    functions: list[tuple[str, str]]  # (module:name, link)
    tests: list[str]


def rows(text: str) -> list[Row]:
    """The rows of the tables; a row of the second table has no functions."""
    found = []
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("|") and re.fullmatch(NUMBER, cells[0]):
            functions = re.findall(r"\[`([\w.]+:\w+)`\]\(([\w./]+)\)", cells[2])
            found.append(Row(cells[0], functions, re.findall(r"`([^`]+::[^`]+)`", cells[-1])))
    return found


ROWS = rows(TABLES)
WITH_CODE = [row for row in ROWS if row.functions]
every_row = pytest.mark.parametrize("row", ROWS, ids=lambda row: row.equation)


def tags(docstring: str | None) -> list[str]:
    """The equations that a docstring starts with: `(3.11), (2.13) ᶜo = …` has two."""
    start = re.match(rf"(?:Returns )?((?:(?:{NUMBER})(?:, )?)+)", docstring or "")
    return re.findall(NUMBER, start[1]) if start else []


def tagged() -> Iterator[tuple[str, str]]:
    """Yields equation and module:name for each public law or rotation that starts with a tag."""
    for module, path in MODULES.items():
        if module.split(".")[1:2] not in (["laws"], ["rotations"]):
            continue
        for node in parsed(path).body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
                name = f"{module.removeprefix('geoimp_drake.')}:{node.name}"
                yield from ((tag, name) for tag in tags(ast.get_docstring(node)))


def test_every_equation_of_the_chapter_is_accounted_for_once():
    accounted = [row.equation for row in ROWS] + re.findall(NUMBER, LISTS)
    assert sorted(accounted) == sorted(CHAPTER)


def test_every_line_of_a_table_is_read_with_all_its_entries():
    """What the patterns here do not understand would otherwise be tested by nobody."""
    lines = [line for line in TABLES.splitlines() if line.startswith("| ") and "---" not in line]
    assert len(lines) == len(ROWS) + 5  # headings
    assert sum(line.count("](") for line in lines) == sum(len(row.functions) for row in ROWS)
    assert sum(line.count("::") for line in lines) == sum(len(row.tests) for row in ROWS)


@pytest.mark.parametrize("row", WITH_CODE, ids=lambda row: row.equation)
def test_functions_exist_where_the_link_leads_and_name_the_equation(row):
    for function, link in row.functions:
        module, _, name = function.partition(":")
        target = getattr(importlib.import_module(f"geoimp_drake.{module}"), name)
        assert (ROOT / link).samefile(MODULES[f"geoimp_drake.{module}"])
        assert row.equation.removesuffix(" coupled") in inspect.getsource(target), function


@every_row
def test_tests_exist(row):
    assert row.tests
    for test in row.tests:
        file, _, name = test.partition("::")
        plain, _, parameters = name.partition("[")
        assert not parameters or parameters.endswith("]")
        assert plain.startswith("test_")
        names = {
            node.name for node in parsed(ROOT / file).body if isinstance(node, ast.FunctionDef)
        }
        assert plain in names, test


@pytest.mark.parametrize(("equation", "function"), sorted(set(tagged())))
def test_every_law_that_starts_with_an_equation_is_in_its_row(equation, function):
    (row,) = [row for row in ROWS if row.equation == equation]
    assert function in [name for name, _ in row.functions]


@pytest.mark.parametrize(
    ("docstring", "expected"),
    [
        ("(2.9) a_p = p̈_d", ["(2.9)"]),
        ("(3.11), (2.13) ᶜo", ["(3.11)", "(2.13)"]),
        ("Returns (3.33) J†", ["(3.33)"]),
        ("(3.31 coupled) K", ["(3.31 coupled)"]),
        ("The matrix of (3.13)", []),
        (None, []),
    ],
)
def test_reading_of_tags(docstring, expected):
    assert tags(docstring) == expected
