"""The architecture's layers: each part of the library imports only those that it may know."""

import ast
import sys

import pytest
from library_tree import MODULES, imported_modules, imported_names, parsed

# Known to all; they know no Drake.
FOUNDATIONS = {
    "compilation",
    "errors",
    "extras",
    "output_folder",
    "reading",
    "typing",
    "validation",
}
LAWS = FOUNDATIONS | {"rotations", "laws"}
PARTS = LAWS | {"arm", "task_functions", "parts"}
SYSTEMS = PARTS | {"systems"}
ASSEMBLY = SYSTEMS | {"controllers"}
RUNNING = ASSEMBLY | {
    "motion_program",
    "robot_files",
    "robots",
    "scenario",
    "simulation",
    "campaigns",
    "analysis",
}

# What each folder, or loose module, may import of the others, and of itself.
ALLOWED = {
    "compilation": {"compilation", "extras", "typing"},
    "errors": set(),
    "extras": {"errors"},
    "output_folder": {"errors"},
    "reading": {"errors"},
    "typing": set(),
    "validation": FOUNDATIONS,
    "rotations": FOUNDATIONS | {"rotations"},
    "laws": LAWS,
    "arm": LAWS | {"arm"},
    # A task function reads the arm's state.
    "task_functions": LAWS | {"arm", "task_functions"},
    "parts": PARTS,
    "systems": SYSTEMS,
    "controllers": ASSEMBLY,
    "analysis": ASSEMBLY | {"analysis", "simulation"},
    # Set-points alone: what follows them is a system.
    "motion_program": FOUNDATIONS | {"rotations", "arm", "motion_program"},
    "robot_files": ASSEMBLY | {"robots", "robot_files"},
    "scenario": FOUNDATIONS | {"scenario"},
    # What runs a controller on a robot, as `simulation` does on a plant.
    "robots": ASSEMBLY | {"robots", "simulation"},
    # Nothing in it computes a control law, and it knows no particular experiment.
    "simulation": FOUNDATIONS | {"arm", "parts", "scenario", "simulation", "systems"},
    # A tuning asks what a controller will do, and runs it.
    "campaigns": FOUNDATIONS | {"laws", "analysis", "campaigns", "scenario", "simulation"},
    "__init__": ASSEMBLY | {"robot_files", "simulation"},
    "models": FOUNDATIONS | {"models"},
    "diagrams": RUNNING | {"models", "diagrams"},
    "cli": RUNNING | {"__init__", "cli", "diagrams"},
}
WITHOUT_DRAKE = LAWS - {"compilation"}  # which is there to know numba


def part_of(module: str) -> str:
    """The part of the library that a dotted name belongs to."""
    first, *inner = module.split(".")
    assert first == "geoimp_drake"
    return inner[0] if inner else "__init__"


def roots(module: str) -> set[str]:
    return {name.split(".")[0] for name in imported_modules(parsed(MODULES[module]))}


def test_every_part_has_its_layer_and_every_layer_its_part():
    assert {part_of(module) for module in MODULES} == set(ALLOWED)


@pytest.mark.parametrize("module", MODULES)
def test_imports_only_layers_above(module):
    imported = imported_modules(parsed(MODULES[module]))
    parts = {part_of(name) for name in imported if name.split(".")[0] == "geoimp_drake"}
    assert parts <= ALLOWED[part_of(module)]


def test_modules_form_no_circle():
    """Every module can be read after those that it imports."""
    left = {m: imported_modules(parsed(path)) & MODULES.keys() for m, path in MODULES.items()}
    while ready := {module for module, needed in left.items() if not needed & left.keys()}:
        left = {module: needed for module, needed in left.items() if module not in ready}
    assert not left


@pytest.mark.parametrize("module", [m for m in MODULES if part_of(m) in WITHOUT_DRAKE])
def test_rotations_and_laws_know_numpy_alone(module):
    assert roots(module) - sys.stdlib_module_names <= {"numpy", "geoimp_drake"}


@pytest.mark.parametrize("module", [m for m in MODULES if part_of(m) == "parts"])
def test_parts_know_no_drake_systems(module):
    assert not any(
        m.startswith("pydrake.systems") for m in imported_modules(parsed(MODULES[module]))
    )


@pytest.mark.parametrize("module", MODULES)
def test_imports_neither_all_of_drake_nor_anything_by_a_short_name(module):
    """`pydrake.all` is slow to import; a top-level `diagrams` may be another project's."""
    names = set(imported_names(parsed(MODULES[module])))
    assert not {"pydrake.all"} & {name for name, _ in names}
    assert ("pydrake", "all") not in names
    assert not roots(module) & {"diagrams", "models"}
    assert not any(name.startswith(".") for name, _ in names)


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("import pydrake.all as d", {"pydrake.all"}),
        ("def f():\n    import geoimp_drake.cli", {"geoimp_drake.cli"}),
        (
            "from geoimp_drake.laws.impedance import families, x",
            {"geoimp_drake.laws.impedance.families", "geoimp_drake.laws.impedance"},
        ),
        ("from . import diagrams", {"."}),
    ],
)
def test_imports_are_found_in_every_form(source, expected):
    assert imported_modules(ast.parse(source)) == expected
