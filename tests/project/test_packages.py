"""What the package declares, its lists of packages, data, dependencies and names, is what it is."""

import ast
import importlib
import re
import sys
from importlib.metadata import packages_distributions
from pathlib import Path, PurePosixPath

import pytest
from library_tree import MODULES, PYPROJECT, ROOT, SYMLINKS, files, imported_names, parsed

SETUPTOOLS = PYPROJECT["tool"]["setuptools"]
PACKAGES = set(SETUPTOOLS["packages"])
DATA = [(package, path) for package, path in files() if path.suffix != ".py"]


def folder_of(package: str) -> Path:
    """Where setuptools looks for a package: its own entry of package-dir, or its parent's."""
    mapped = SETUPTOOLS["package-dir"]
    if package in mapped:
        return ROOT / mapped[package]
    parent, _, name = package.rpartition(".")
    return folder_of(parent) / name


def test_list_of_packages_is_the_tree():
    tree = {name: path.parent for name, path in MODULES.items() if path.stem == "__init__"}
    assert {package: folder_of(package) for package in PACKAGES} == tree


def test_every_folder_with_modules_is_a_package():
    assert {package for package, path in files() if path.suffix == ".py"} == PACKAGES


@pytest.mark.parametrize("link", SYMLINKS, ids=lambda link: link.name)
def test_symlinks_lead_to_the_folders_at_the_top(link):
    assert link.is_symlink()
    assert link.resolve() == ROOT / link.name


def enclosing(package: str) -> tuple[str, tuple[str, ...]]:
    """The package that a folder belongs to, and the folders between the two."""
    inner: tuple[str, ...] = ()
    while package not in PACKAGES:
        package, _, name = package.rpartition(".")
        inner = (name, *inner)
    return package, inner


def pattern_for(package: str, path: Path) -> tuple[str, str] | None:
    """The pattern of package-data, and its package, by which a file is installed."""
    package, inner = enclosing(package)
    name = PurePosixPath(*inner, path.name)
    for pattern in SETUPTOOLS["package-data"].get(package, ()):
        if len(PurePosixPath(pattern).parts) == len(name.parts) and name.match(pattern):
            return package, pattern
    return None


@pytest.mark.parametrize(("package", "path"), DATA, ids=[str(p.relative_to(ROOT)) for _, p in DATA])
def test_every_data_file_is_installed(package, path):
    assert pattern_for(package, path) is not None


def test_every_pattern_of_package_data_finds_a_file():
    patterns = {
        (package, p) for package, list_ in SETUPTOOLS["package-data"].items() for p in list_
    }
    assert {pattern_for(package, path) for package, path in DATA} == patterns


def test_dependencies_are_what_the_library_imports():
    names = {name.split(".")[0] for p in MODULES.values() for name, _ in imported_names(parsed(p))}
    foreign = names - sys.stdlib_module_names - {"geoimp_drake"}
    # Drake's wheel is called drake and its package pydrake, PyYAML's is yaml; MuJoCo's has several.
    all_owners = packages_distributions()
    owners = {name: all_owners[name] for name in foreign}
    imported = {name if name in own else own[0].lower() for name, own in owners.items()}
    extras = PYPROJECT["project"]["optional-dependencies"]
    used = extras.keys() - {"docs", "notebooks", "test"}
    optional = [text for extra in used for text in extras[extra]]
    declared = [*PYPROJECT["project"]["dependencies"], *optional]
    named = {re.split(r"[<>=~! \[]", text)[0].lower() for text in declared}
    assert imported == named - {"geoimp-drake"}  # an extra takes another


def listed(module: str) -> list[str]:
    """The names in a module's `__all__`, in their order, read without importing it."""
    for node in parsed(MODULES[module]).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return ast.literal_eval(node.value)
    return []


def order(name: str) -> tuple[int, str]:
    """Constants, then classes, then the rest, each in the alphabet's order."""
    constant = len(name) > 1 and name.isupper()
    return (0 if constant else 1 if name[0].isupper() else 2), name


@pytest.mark.parametrize("module", [m for m in MODULES if listed(m)])
def test_names_in_all_exist_once_and_in_order(module):
    names = listed(module)
    assert names == sorted(set(names), key=order)
    assert not [name for name in names if not hasattr(importlib.import_module(module), name)]


@pytest.mark.parametrize("module", MODULES)
def test_every_public_class_and_function_is_in_all(module):
    defined = {
        node.name
        for node in parsed(MODULES[module]).body
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("_")
    }
    assert defined <= set(listed(module))


@pytest.mark.parametrize("module", MODULES)
def test_modules_import_from_each_other_only_what_is_in_all(module):
    """A name that another module needs is public, constants included."""
    taken = {
        (source, name)
        for source, name in imported_names(parsed(MODULES[module]))
        if source in MODULES and f"{source}.{name}" not in MODULES
    }
    assert {(source, name) for source, name in taken if name not in listed(source)} == set()
