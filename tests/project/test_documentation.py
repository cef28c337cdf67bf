"""The documentation is true: it builds without a warning, and all that it shows runs as printed."""

import json
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import pytest
from documents import (
    COMMAND_LINE,
    DOCS,
    PAGES,
    README,
    blocks,
    commands,
    execute,
    execute_page,
    explanations,
    long_sentences,
)
from library_tree import MODULES, ROOT

from geoimp_drake import cli
from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS

CLAIMS = ROOT / "docs" / "validation" / "claims.md"
LOG = ROOT / "docs" / "howto" / "reading_the_log.md"
GALLERY = ROOT / "docs" / "validation" / "gallery.md"
CONCEPTS = [page for page in DOCS if page.parent.name == "concepts" and page.stem != "index"]
# Pages whose commands a test of their own runs.
BY_ITSELF = (CLAIMS, COMMAND_LINE)

# A command with the table of what it claims.
WITH_TABLE = re.findall(
    r"^```sh\n(geoimp run .*)\n```\n\n((?:^\|.*\n)+)", CLAIMS.read_text("utf-8"), re.MULTILINE
)
# The library's sources by the folder that they lie in.
SOURCES: defaultdict[str, list[Path]] = defaultdict(list)
for source in MODULES.values():
    SOURCES["/".join(source.relative_to(ROOT).parts[:-1][:2])].append(source)
# Folders of a log's keys; their names stand as code with a slash, as paths do.
LOG_FOLDERS = {"six", "seven", "object", "surface", "world", "hole", "program", "grasp"}


def test_the_documentation_builds_without_a_warning(tmp_path):
    """What leads nowhere or cannot be set is a warning; every module has its place, offline."""
    # No line for each function in tables of contents: the theme copies all of them to each page.
    options = ["--fail-on-warning", "--keep-going", "--quiet", "-D", "toc_object_entries=0"]
    options += ["-d", str(tmp_path / "doctrees")]
    build = [sys.executable, "-m", "sphinx", *options, str(ROOT / "docs"), str(tmp_path / "html")]
    done = subprocess.run(build, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    pages = [page.relative_to(ROOT / "docs").with_suffix(".html") for page in DOCS]
    assert not [page for page in pages if not (tmp_path / "html" / page).exists()]
    reference = (tmp_path / "html" / "equations.html").read_text(encoding="utf-8")
    assert 'href="api/laws.html#geoimp_drake.laws.impedance.quaternion_impedance' in reference
    html = "".join(page.read_text(encoding="utf-8") for page in tmp_path.glob("html/**/*.html"))
    read = [module for module in MODULES if not module.endswith(".__main__")]
    assert [module for module in read if f'id="module-{module}"' not in html] == []
    assert not re.findall(r'<(?:script|link|img)[^>]+(?:src|href)="(?:https?:)?//[^"]+"', html)


@pytest.mark.parametrize(
    "page", [p for p in DOCS if blocks(p) and p not in BY_ITSELF], ids=lambda p: p.stem
)
def test_a_page_runs_as_printed(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = execute_page(page)
    if page == LOG:
        rows = re.findall(r"^\| (`.*?) \|", page.read_text("utf-8"), re.MULTILINE)
        assert set(re.findall(r"`([\w/]+)`", "".join(rows))) == set(names["log"].files)


def test_what_the_pages_use_is_public():
    """Pages and notebooks import only from modules that the reference calls public."""
    text = (ROOT / "docs" / "api" / "index.md").read_text(encoding="utf-8")
    public = set(re.findall(r"`(geoimp_drake[\w.]*)`", text)) - {"geoimp_drake.__all__"}
    assert public <= {*MODULES, *(module.rpartition(".")[0] for module in MODULES)}
    code = [block.text for page in (README, *DOCS) for block in blocks(page)]
    code += [notebook.read_text(encoding="utf-8") for notebook in ROOT.glob("notebooks/*.ipynb")]
    used = set(re.findall(r"from (geoimp_drake[\w.]*) ", "\n".join(code)))
    assert len(used) > 20
    packages = tuple(f"{name}." for name in public - {"geoimp_drake"})
    assert {name for name in used - public if not name.startswith(packages)} == set()


def test_only_the_readme_and_the_documentation_show_code():
    assert {page for page in PAGES if blocks(page)} <= {README, *DOCS}


@pytest.mark.parametrize(("command", "table"), WITH_TABLE, ids=[row[0] for row in WITH_TABLE])
def test_claims_on_the_page_are_those_of_the_experiment(command, table, tmp_path):
    quick = re.sub(r" --duration \S+", "", command) + " --duration 0.01 --no-figures"
    execute(f"{quick} --out {tmp_path}")
    claims = json.loads((tmp_path / "metrics.json").read_text("utf-8"))["claims"]
    expected = [(c["claim"], f"{c['bound']} {c['unit']}".strip()) for c in claims]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]
    assert [(claim, bound) for claim, _, bound in rows[2:]] == expected
    assert [row for row in rows[2:] if not keeps(*row[1:])] == []


def keeps(value: str, bound: str) -> bool:
    """Whether a value of the table keeps its bound: `≤ x`, `≥ x` or `x ± y %`, with units."""
    number = float(value.split()[0])
    first, second, *rest = bound.split()
    if second == "±":
        return abs(number - float(first)) <= float(rest[0]) / 100 * abs(float(first))
    return number <= float(second) if first == "≤" else number >= float(second)


def test_every_experiment_has_its_claims_on_the_page():
    assert len(WITH_TABLE) == len(commands(CLAIMS, "geoimp"))
    assert {command.split()[2] for command, _ in WITH_TABLE} == set(EXPERIMENTS)


def test_every_experiment_is_in_the_gallery_with_a_small_picture():
    text = GALLERY.read_text(encoding="utf-8")
    rows = re.findall(r"^\| !\[.+\]\((\S+)\) \| .+ \| `geoimp run (\w+)", text, re.MULTILINE)
    assert {experiment for _, experiment in rows} == {*EXPERIMENTS, "worlds"}
    sizes = {name: (GALLERY.parent / name).stat().st_size for name, _ in rows}
    assert max(sizes.values()) < 200_000


@pytest.mark.parametrize("page", CONCEPTS, ids=lambda page: page.stem)
def test_a_concept_begins_with_a_picture(page):
    assert page.read_text(encoding="utf-8").split("\n\n")[1].startswith("![")


def links(page: Path) -> set[str]:
    targets = re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8"))
    return {target.partition("#")[0] for target in targets if "://" not in target}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_sentence_has_25_words_at_most(page):
    assert long_sentences(page.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("folder", sorted(SOURCES))
def test_a_sentence_of_docstrings_and_comments_has_25_words_at_most(folder):
    texts = ((path.name, text) for path in SOURCES[folder] for text in explanations(path))
    assert [f"{name}: {long}" for name, text in texts for long in long_sentences(text)] == []


def test_a_long_sentence_of_a_source_is_found(tmp_path):
    """In docstrings and comments; not in code, formulas, ports and trailing comments."""
    source = tmp_path / "law.py"
    source.write_text(
        '''"""One two three four five.

    x = one + two + three + four + five

Floats only.
"""

# One two three
# four six.
ONE = "one two three four five"  # one two three four five


def law(a, b):
    """Short.

    Args:
        a: two three four
            five seven.
        b: two three.

    Returns:
        One two three four eight.

        input one: two three
        output two: three four

    ```
    one two three four five
    ```
    """
''',
        encoding="utf-8",
    )
    long = [long for text in explanations(source) for long in long_sentences(text, most=4)]
    assert [sentence.split()[-1] for sentence in long] == ["five.", "seven.", "eight.", "six."]


def test_a_long_sentence_is_found():
    """Code and formulas are one word; headings, tables and blocks are no prose."""
    five = "One `a b c` ends {math}`x y` here."
    found = ["5 words: One Code ends Code here."]
    assert long_sentences(f"# {five}\n\nIt is (as so.) {five} `b` too.\n", most=4) == found
    assert long_sentences(f"```sh\n{five}\n```\n\n| {five} |\n| --- |\n", most=4) == []
    assert long_sentences("- It goes\n  on and on.", most=4) == ["5 words: It goes on and on."]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_to_files(page):
    assert {target for target in links(page) if not (page.parent / target).exists()} == set()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_paths_in_the_text_exist(page):
    """Code with a slash in it names files of the project, unless a result or a key of a log."""
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    paths = set(re.findall(r"`([\w.*-]+/[\w./*-]*)`", text))
    files = {path for path in paths if path.split("/")[0] not in {"results", *LOG_FOLDERS}}
    assert {path for path in files if not any(ROOT.glob(path.rstrip("/")))} == set()


@pytest.mark.parametrize(
    "line", ["ls", "pip install '.[nothing]'", "make nothing", "geoimp run nothing"]
)
def test_a_line_that_would_not_run_is_not_accepted(line):
    with pytest.raises(AssertionError):
        execute(line)


def test_the_command_line_is_that_of_the_pages(capsys):
    """Every subcommand of `geoimp` is shown somewhere."""
    with pytest.raises(SystemExit):
        cli.main(["--help"])
    listed = set(re.findall(r"^ {4}(\w+) ", capsys.readouterr().out, re.MULTILINE))
    shown = {words[0] for page in (README, *DOCS) for words in commands(page, "geoimp")}
    assert listed <= shown
