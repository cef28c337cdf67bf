"""`geoimp benchmark`: one page of tables, made of whatever its parts have left."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from geoimp_drake import cli
from geoimp_drake.campaigns.reproduction import SectionResult
from geoimp_drake.campaigns.table import Table
from geoimp_drake.diagrams.experiments import benchmarks
from geoimp_drake.simulation.claims import at_most

PARTS = benchmarks.parts(quick=True)


class FakeSection:
    """A part that computes nothing; counts how often it was run."""

    files = ("told.txt",)

    def __init__(self, name: str, figure: str = ""):
        self.name, self.figure, self.runs = name, figure, 0

    def run(self, out, jobs, overrides):
        self.runs += 1
        out.mkdir(parents=True, exist_ok=True)
        (out / "told.txt").write_text(f"{jobs} {list(overrides)}")
        rows = (("<this> & that", ("a page", "https://example.org/x.html")),)
        table = Table("Numbers", ("what", "where"), rows, "Made up.")
        claims = (at_most("is small", 1.0, 2.0, "N"),)
        told = "fake", "No figure.", claims, self.figure, self.files, {}, (table,)
        return SectionResult(self.name, *told)


def run(*arguments: str | Path) -> int:
    return cli.main(["benchmark", *map(str, arguments)])


@pytest.fixture
def fakes(monkeypatch):
    fakes = {name: FakeSection(name) for name in ("springs", "speed")}
    monkeypatch.setattr(benchmarks, "parts", lambda **_: fakes)
    return fakes


def test_the_page_has_what_to_use_when_then_tables_then_claims(fakes, tmp_path, capsys):
    assert run("--jobs", "3", "--out", tmp_path) == 0
    assert capsys.readouterr().out.startswith("2 claims: 2 holds\n")
    page = (tmp_path / "report.html").read_text("utf-8")
    order = ("<h1>Against the others, on the same work</h1>", "What to use when", ">Numbers<")
    places = [page.index(text) for text in (*order, '<h2 id="claims">')]
    assert places == sorted(places)
    assert "&lt;this&gt; &amp; that" in page
    assert '<a href="https://example.org/x.html">a page</a>' in page
    assert page.count("Made up.") == page.count("No figure.") == 2
    assert "<img" not in page
    assert (tmp_path / "speed" / "told.txt").read_text() == "3 []"


@pytest.mark.parametrize(
    ("figure", "title"), [("figure_5_12", "Figure 5.12"), ("peg_at_scale", "Peg at scale")]
)
def test_a_figure_has_its_name_in_words(figure, title, monkeypatch, tmp_path):
    monkeypatch.setattr(benchmarks, "parts", lambda **_: {"one": FakeSection("one", figure)})
    assert run("--out", tmp_path) == 0
    assert f">{title}<" in (tmp_path / "report.html").read_text("utf-8")


def test_sections_are_chosen_by_name(fakes, tmp_path, capsys):
    assert run("--only", "speed", "--out", tmp_path) == 0
    assert {name: fake.runs for name, fake in fakes.items()} == {"springs": 0, "speed": 1}
    assert run("--only", "sped", "--out", tmp_path / "none") == 2
    assert "Did you mean 'speed'?" in capsys.readouterr().err
    assert not (tmp_path / "none").exists()


def test_quick_is_handed_on_and_asks_for_less(monkeypatch, tmp_path):
    asked = []
    monkeypatch.setattr(benchmarks, "parts", lambda **asks: asked.append(asks) or {})
    assert run("--quick", "--out", tmp_path) == 0
    assert run("--scheduler", "tcp://a:1", "--out", tmp_path) == 0
    assert asked == [
        {"quick": True, "scheduler": None},
        {"quick": False, "scheduler": "tcp://a:1"},
    ]
    monkeypatch.undo()
    whole = benchmarks.parts(quick=False)["schemes"]
    assert len(PARTS["schemes"].variants) < len(whole.variants)


def test_every_part_has_its_name_and_a_study_compares_what_it_runs():
    assert list(PARTS) == [
        "orientation_loop",
        "schemes",
        "springs",
        "peg_at_scale",
        "speed",
        "published_metrics",
    ]
    names = [variant.name for variant in PARTS["orientation_loop"].variants]
    assert names == list(PARTS["orientation_loop"].compared) == ["quaternion", "axis-angle"]


def test_every_scheme_is_run_with_every_error_of_the_quick_ones():
    names = {variant.name for variant in PARTS["schemes"].variants}
    schemes = ("inner-loop", "direct", "natural-inertia", "admittance")
    errors = ("exact", "mass-10", "friction-1")
    assert names == {f"{scheme}-{error}" for scheme in schemes for error in errors}
    assert set(PARTS["schemes"].compared) == names


def test_started_again_it_runs_what_is_missing_and_folds_single_runs(monkeypatch, tmp_path):
    study = PARTS["schemes"]
    short = tuple(
        replace(variant, settings=(*variant.settings, "duration=0.01"))
        for variant in study.variants
        if variant.name.endswith("-exact")
    )[:2]
    names = tuple(variant.name for variant in short)
    study = replace(study, variants=short, compared=names)
    monkeypatch.setattr(benchmarks, "parts", lambda **_: {"schemes": study})
    assert run("--jobs", "1", "--out", tmp_path) == 0
    journal, page = tmp_path / "journal.jsonl", (tmp_path / "report.html").read_bytes()
    lines = journal.read_text("utf-8").splitlines()
    assert json.loads(lines[0])["plan"] == {"command": "benchmark"}
    assert [json.loads(line)["key"] for line in lines[1:]] == [f"schemes/{name}" for name in names]
    assert run("--jobs", "1", "--out", tmp_path) == 0
    assert journal.read_text("utf-8").splitlines() == lines
    assert (tmp_path / "report.html").read_bytes() == page
    text = page.decode()
    assert "<details><summary>2 runs</summary>" in text
    row = "<td>the plant as known</td><td>inner-loop</td>" + "<td>–</td>" * 5
    assert row in text  # a run that is cut off has no numbers


def test_links_of_the_page_lead_to_pages_of_the_documentation():
    docs = Path(__file__).parents[3] / "docs"
    cells = [cell for table in benchmarks.page().tables for row in table.rows for cell in row]
    links = [cell[1] for cell in cells if not isinstance(cell, str)]
    assert links
    for link in links:
        name = re.fullmatch(r"https://[\w.]+/geoimp-drake/(\w+/\w+)\.html", link)
        assert name, link
        assert (docs / f"{name[1]}.md").is_file(), link
