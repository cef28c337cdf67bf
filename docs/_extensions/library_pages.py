"""What the pages take from the repository: its modules, and its equation index.

`.. modules:: geoimp_drake.laws` documents every module of a package, a section each;
`.. modules:: geoimp_drake` with the option `:except:` those that no other page has.
"""

import re
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import ClassVar

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

_LIBRARY = "geoimp_drake"
_LINK_TO_CODE = re.compile(r"\[`([\w.]+):(\w+)`\]\([\w./]+\)")


def setup(app: Sphinx) -> dict[str, bool]:
    """Registers the directive and what happens to the equation index."""
    app.add_directive("modules", Modules)
    app.connect("include-read", _link_to_reference)
    return {"parallel_read_safe": True}


class Modules(SphinxDirective):
    """Documents modules, or every module of a package."""

    required_arguments = 1
    optional_arguments = 50
    option_spec: ClassVar[dict] = {"except": directives.unchanged}

    def run(self) -> list[nodes.Node]:
        """Returns a section for each module."""
        left_out = self.options.get("except", "").split()
        names = [name for argument in self.arguments for name in _modules(argument, left_out)]
        text = "\n".join(map(_section, names))
        return self.parse_text_to_nodes(text, allow_section_headings=True)


def _modules(name: str, left_out: list[str]) -> list[str]:
    """Returns the public modules of a package, itself included, or the one module."""
    module = import_module(name)
    path = getattr(module, "__path__", None)
    inner = list(iter_modules(path)) if path else []
    names = [name, *(f"{name}.{part.name}" for part in inner if not part.ispkg)]
    # Of the library itself, each package has a page of its own.
    for part in inner if name != _LIBRARY else ():
        names += _modules(f"{name}.{part.name}", left_out) if part.ispkg else []
    return [n for n in names if n not in left_out and not n.rpartition(".")[2].startswith("_")]


def _section(module: str) -> str:
    title = module.removeprefix(f"{_LIBRARY}.")
    options = f"   :members: {', '.join(own)}\n" if (own := _own_names(module)) else ""
    return f"{title}\n{'-' * len(title)}\n\n.. automodule:: {module}\n{options}\n"


def _own_names(name: str) -> list[str]:
    """Returns the public classes and functions of a module that are not another one's."""
    module = import_module(name)
    public = {n: getattr(module, n) for n in getattr(module, "__all__", ())}
    return [n for n, target in public.items() if getattr(target, "__module__", "") == name]


def _link_to_reference(app: Sphinx, path: Path, docname: str, content: list[str]) -> None:
    """Makes the links of EQUATIONS.md lead to the reference instead of the source."""
    if path.name == "EQUATIONS.md":
        content[0] = _LINK_TO_CODE.sub(rf"{{py:obj}}`\1:\2 <{_LIBRARY}.\1.\2>`", content[0])
