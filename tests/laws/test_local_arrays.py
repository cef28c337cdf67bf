"""No law returns an array that ends with it, see `small_arrays.local`."""

import ast
from pathlib import Path

from geoimp_drake import laws, rotations

FOLDERS = [Path(package.__path__[0]) for package in (laws, rotations)]


def returned_local_arrays(source: str) -> list[str]:
    """Returns the names of local arrays, or of views of them, that functions return."""
    found = []
    for function in ast.walk(ast.parse(source)):
        if not isinstance(function, ast.FunctionDef):
            continue
        names = {"local"}
        for node in ast.walk(function):
            if isinstance(node, ast.Assign) and names & _arrays(node.value):
                names |= {
                    n.id for t in node.targets for n in ast.walk(t) if isinstance(n, ast.Name)
                }
        for node in ast.walk(function):
            if isinstance(node, ast.Return) and node.value is not None:
                found += sorted(names & _arrays(node.value))
    return found


def _arrays(value: ast.expr) -> set[str]:
    """Returns the names in an expression, but for those in calls that make something of them."""
    if isinstance(value, ast.Call):
        return {value.func.id} & {"local"} if isinstance(value.func, ast.Name) else set()
    if isinstance(value, ast.Name):
        return {value.id}
    parts = (part for part in ast.iter_child_nodes(value) if isinstance(part, ast.expr))
    return set().union(*map(_arrays, parts))


def test_no_law_returns_a_local_array() -> None:
    sources = {path: path.read_text("utf-8") for folder in FOLDERS for path in folder.rglob("*.py")}
    assert sum("local(" in source for source in sources.values()) > 3
    found = {path: returned_local_arrays(source) for path, source in sources.items()}
    assert not {path: names for path, names in found.items() if names}


def test_a_law_that_does_is_found() -> None:
    law = "def law(a):\n    x, y = local(a), 1.0\n    z = x[1:]\n    return {}\n"
    cases = {"z": ["z"], "a, x": ["x"], "local(a)": ["local"], "sized(x, 3)": []}
    for returned, names in cases.items():
        assert returned_local_arrays(law.format(returned)) == names
