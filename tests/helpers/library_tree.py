"""The library as it lies in the repository, read without importing it."""

import ast
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))

# Where each part of the library lies. The symlinks in geoimp_drake/ lead to the latter two.
FOLDERS = {
    "geoimp_drake": ROOT / "geoimp_drake",
    "geoimp_drake.diagrams": ROOT / "diagrams",
    "geoimp_drake.models": ROOT / "models",
}
SYMLINKS = [ROOT / "geoimp_drake" / name for name in ("diagrams", "models")]
LEFT_OUT = {"__pycache__"}


def files() -> Iterator[tuple[str, Path]]:
    """Yields every file of the library: the package that its folder would be, and its path."""
    for root, folder in FOLDERS.items():
        for path in sorted(folder.rglob("*")):
            inner = path.relative_to(folder)
            beyond_symlink = any(link in (path, *path.parents) for link in SYMLINKS)
            if path.is_file() and not beyond_symlink and not LEFT_OUT & set(inner.parts):
                yield ".".join((root, *inner.parts[:-1])), path


MODULES = {
    package if path.stem == "__init__" else f"{package}.{path.stem}": path
    for package, path in files()
    if path.suffix == ".py"
}


def parsed(path: Path) -> ast.Module:
    """Returns the syntax tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def imported_names(tree: ast.AST) -> Iterator[tuple[str, str | None]]:
    """Yields what is imported anywhere in a syntax tree: module, and name for `from … import`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, None) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = "." * node.level + (node.module or "")
            yield from ((module, alias.name) for alias in node.names)


def imported_modules(tree: ast.AST) -> set[str]:
    """Returns the modules that a syntax tree imports; `from a import b` is a.b if that is one."""
    return {
        f"{module}.{name}" if f"{module}.{name}" in MODULES else module
        for module, name in imported_names(tree)
    }
