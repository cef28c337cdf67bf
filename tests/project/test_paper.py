"""The paper cites what its bibliography has, and shows figures that the repository has."""

import re

from library_tree import ROOT

PAPER = ROOT / "paper"
TEXT = (PAPER / "paper.md").read_text(encoding="utf-8")
SECTIONS = ("Summary", "Statement of need", "State of the field", "Functionality", "Validation")


def test_bibliography_has_what_is_cited_and_nothing_else():
    entries = re.findall(r"^@\w+\{(\w+),", (PAPER / "paper.bib").read_text("utf-8"), re.MULTILINE)
    cited = re.findall(r"(?<![\w.])@(\w+)", TEXT)
    assert len(entries) == len(set(entries))
    assert set(cited) == set(entries)


def test_figures_are_files_of_the_repository():
    figures = re.findall(r"!\[.+?\]\((.+?)\)", TEXT)
    assert len(figures) == 2
    assert [f for f in figures if not (PAPER / f).resolve().is_relative_to(ROOT)] == []
    assert [f for f in figures if not (PAPER / f).is_file()] == []


def test_paper_has_the_sections_that_the_journal_asks_for():
    assert re.findall(r"^# (.+)$", TEXT, re.MULTILINE) == [*SECTIONS, "References"]
    assert 250 <= len(TEXT.split()) <= 1200
