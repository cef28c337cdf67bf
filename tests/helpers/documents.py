"""The project's documents, README and the pages of docs/, and what there is to execute in them.

A page is executed from top to bottom, in a folder of its own, as a reader would:

- `python` blocks share one namespace;
- a `text` block that directly follows one is what it prints;
- a `yaml` block is written to the file that its first line names in a comment;
- of a `sh` block every line is run, see `execute`.

Nothing else is shown as code, so nothing is shown that no test has tried.
"""

import ast
import contextlib
import io
import re
import shlex
import tokenize
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

from library_tree import PYPROJECT, ROOT, parsed
from markdown_it import MarkdownIt

from geoimp_drake import cli
from geoimp_drake.diagrams.experiments import benchmarks
from geoimp_drake.simulation import bench

README = ROOT / "README.md"
COMMAND_LINE = ROOT / "docs" / "howto" / "command_line.md"
DOCS = sorted(ROOT.glob("docs/**/*.md"))
PAGES = [*sorted(ROOT.glob("*.md")), *DOCS]

# The sections of a docstring, and what an entry of one begins with.
_SECTION = re.compile(r"^(?:Args|Attributes|Ports|Raises|Returns|Yields):$", re.MULTILINE)
_ENTRY = re.compile(r"^(?=(?:input |output )?[\w.*]+: )", re.MULTILINE)

_BLOCK = re.compile(r"^```(\S+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)

# What makes a command of the documents quick, where it does not say so itself. That it runs at all,
# writes what it should and ends well does not depend on how long it runs.
_SHORT = {
    "run": {"--duration": "0.01"},
    "compare": {"--duration": "0.01"},
    "bench": {"--only": "single_free"},
    "tune": {
        "--set": "segments=[{duration: 2.5, displacement: [0.0, 0.0, -0.24]}, {duration: 1.5}]",
        "--evaluations": "30",
        "--jobs": "1",
    },
    "sweep": {"--duration": "0.01", "--samples": "1", "--jobs": "1"},
}


class Block(NamedTuple):
    language: str
    text: str
    line: int
    follows_code: bool  # stands directly after a block of Python


def blocks(page: Path) -> list[Block]:
    """The fenced blocks of a page; directives such as {toctree} are not among them."""
    text = page.read_text(encoding="utf-8")
    found, end, before = [], 0, ""
    for match in _BLOCK.finditer(text):
        between = text[end : match.start()]
        line = text[: match.start()].count("\n") + 2
        found.append(Block(match[1], match[2], line, before == "python" and not between.strip()))
        end, before = match.end(), match[1]
    return [block for block in found if not block.language.startswith("{")]


def prose(text: str) -> Iterator[str]:
    """The paragraphs and list items of Markdown; headings, tables and fenced blocks are no prose.

    Code and formulas within a line stand as one word.
    """
    said = {"text": str, "softbreak": lambda _: " ", "code_inline": lambda _: "Code"}
    outside = 0
    for token in MarkdownIt("commonmark").enable("table").parse(text):
        if re.match("(heading|table)_", token.type):
            outside += token.nesting
        elif token.type == "inline" and not outside:
            parts = (said[c.type](c.content) for c in token.children if c.type in said)
            yield re.sub(r"\{[\w:]+\}Code", "Code", "".join(parts))


def long_sentences(text: str, most: int = 25) -> list[str]:
    """The sentences of Markdown with more words than `most`, each after its number of words."""
    end = r"(?:(?<=[.!?])|(?<=[.!?][)”])) +(?=[^a-z])| · "
    sentences = (sentence for part in prose(text) for sentence in re.split(end, part))
    counted = ((len(re.findall(r"\S*\w\S*", sentence)), sentence) for sentence in sentences)
    return [f"{count} words: {sentence}" for count, sentence in counted if count > most]


def explanations(path: Path) -> Iterator[str]:
    """The docstrings of a Python file and its comments on lines of their own, as Markdown.

    An entry of a section, such as an argument, is a paragraph.
    """
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            text, *sections = _SECTION.split(ast.get_docstring(node) or "")
            outward = (re.sub("^ {4}", "", section, flags=re.MULTILINE) for section in sections)
            yield "\n".join((text, *(_ENTRY.sub("\n", section) for section in outward)))
    with tokenize.open(path) as file:
        tokens = [t for t in tokenize.generate_tokens(file.readline) if t.type == tokenize.COMMENT]
    alone = [t for t in tokens if t.line.lstrip().startswith("#")]
    for _, block in groupby(enumerate(alone), lambda row: row[1].start[0] - row[0]):
        yield "\n".join(token.string.lstrip("# ") for _, token in block)


def commands(page: Path, program: str) -> list[list[str]]:
    """The arguments of every call of a program in a page's shell blocks."""
    lines = (line for b in blocks(page) if b.language == "sh" for line in b.text.splitlines())
    split = (shlex.split(line, comments=True) for line in lines)
    return [words[1:] for words in split if words and Path(words[0]).name == program]


def shortened(arguments: list[str]) -> list[str]:
    """A command of `geoimp` with what makes it quick."""
    options = _SHORT.get(arguments[0], {})
    added = [(key, value) for key, value in options.items() if key not in arguments]
    return [*arguments, *(word for option in added for word in option)]


def execute_page(page: Path, names: dict[str, Any] | None = None) -> dict[str, Any]:
    """Executes a page in the current folder; returns the names that its Python has defined."""
    names, printed = names or {}, ""
    for block in blocks(page):
        where = f"{page.name}, line {block.line}"
        if block.language == "python":
            # The empty lines make a traceback point into the page.
            code = compile("\n" * (block.line - 1) + block.text, str(page), "exec")
            with contextlib.redirect_stdout(io.StringIO()) as output:
                exec(code, names)
            printed = output.getvalue()
        elif block.language == "text":
            assert not block.follows_code or block.text.strip() == printed.strip(), where
        elif block.language == "yaml":
            file = re.match(r"# (\S+\.yaml)\n", block.text)
            assert file, f"{where}: the first line must name the file"
            Path(file[1]).write_text(block.text, encoding="utf-8")
        else:
            assert block.language == "sh", f"{where}: nothing executes {block.language}"
            for line in block.text.splitlines():
                execute(line)
    return names


def execute(line: str) -> None:
    """Executes a line of a shell block: `geoimp` in earnest but shortened.

    Of what would install or test the project once more it is looked up that there is such a thing.
    """
    words = shlex.split(line, comments=True)
    if not words:
        return
    program, arguments = Path(words[0]).name, words[1:]
    if program == "geoimp":
        with contextlib.redirect_stdout(io.StringIO()), _quick_bench():
            assert cli.main(shortened(arguments)) == 0, line
    elif program == "make":
        assert arguments, line
        assert set(arguments) <= make_targets(), line
    elif program == "pip" and arguments[0] == "install":
        (extras,) = re.findall(r"^(?:\.|geoimp-drake)(?:\[([\w,-]+)\])?$", arguments[1])
        assert set(filter(None, extras.split(","))) <= extras_of_the_project(), line
    else:
        assert words == ["python3", "-m", "venv", ".venv"], f"nothing executes {line!r}"


def make_targets() -> set[str]:
    text = (ROOT / "Makefile").read_text(encoding="utf-8")
    return set(re.findall(r"^([\w-]+):", text, re.MULTILINE))


def extras_of_the_project() -> set[str]:
    return set(PYPROJECT["project"]["optional-dependencies"])


@contextlib.contextmanager
def _quick_bench() -> Iterator[None]:
    """Lets `geoimp bench` time a moment at the start, and `benchmark` write a page of no runs."""
    kept = bench._WINDOWS, bench._WINDOW, bench.time_experiment
    bench._WINDOWS, bench._WINDOW = 1, 0.01
    bench.time_experiment = lambda experiment, name, start: kept[2](experiment, name, 0.01)
    parts, benchmarks.parts = benchmarks.parts, lambda **_: {}
    try:
        yield
    finally:
        bench._WINDOWS, bench._WINDOW, bench.time_experiment = kept
        benchmarks.parts = parts
