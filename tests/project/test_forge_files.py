"""What a forge reads (workflows, templates, updates, citation) is what it takes, and true."""

import json
import os
import re
import subprocess
import sys

import pytest
import yaml
from library_tree import PYPROJECT, ROOT

PROJECT = PYPROJECT["project"]
GITHUB = ROOT / ".github"
SCHEMAS = {
    "github-workflows": sorted((GITHUB / "workflows").glob("*.yml")),
    "github-issue-forms": [GITHUB / "ISSUE_TEMPLATE" / name for name in ("bug.yml", "feature.yml")],
    "github-issue-config": [GITHUB / "ISSUE_TEMPLATE" / "config.yml"],
    "dependabot": [GITHUB / "dependabot.yml"],
    "citation-file-format": [ROOT / "CITATION.cff"],
}
WORKFLOWS = {path.stem: yaml.safe_load(path.read_text()) for path in SCHEMAS["github-workflows"]}
STEPS = [
    step for flow in WORKFLOWS.values() for job in flow["jobs"].values() for step in job["steps"]
]


@pytest.mark.parametrize("schema", SCHEMAS)
def test_file_is_of_its_schema(schema):
    check = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", f"vendor.{schema}"]
    done = subprocess.run([*check, *SCHEMAS[schema]], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_workflows_call_targets_that_exist():
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    called = {name for step in STEPS for name in re.findall(r"make (\w+)", step.get("run", ""))}
    assert called == {"test", "docs", "dist"}
    assert called <= targets


def test_pages_of_each_version_are_published_beside_the_others(tmp_path):
    """The step is run as it stands, in a repository of its own."""
    (step,) = (s["run"] for s in WORKFLOWS["docs"]["jobs"]["publish"]["steps"] if "name" in s)
    shell = "git init -qb main; git -c user.name=a -c user.email=a@b commit -qm 0 --allow-empty"
    for version in ("main", "v0.9.0", "v0.10.0"):  # each in a fresh checkout
        work = tmp_path / version
        (work / "build" / "docs").mkdir(parents=True)
        (work / "build" / "docs" / "index.html").write_text(version)
        origin = f"git init -q --bare ../origin; git remote add origin $PWD/../origin; {step}"
        environment = os.environ | {"GITHUB_REF_NAME": version}
        script = ["bash", "-ec", f"{shell}; {origin}"]
        subprocess.run(script, cwd=work, env=environment, check=True, capture_output=True)
    site = work / "site"
    assert json.loads((site / "versions.json").read_text()) == ["v0.10.0", "v0.9.0", "main"]
    assert "url=v0.10.0/" in (site / "index.html").read_text()
    pages = {page.parent.name: page.read_text() for page in site.glob("*/index.html")}
    assert pages == {name: name for name in ("main", "v0.9.0", "v0.10.0")}


def test_pythons_tested_are_those_that_the_metadata_name():
    rows = WORKFLOWS["test"]["jobs"]["test"]["strategy"]["matrix"]["include"]
    named = re.findall(r"Python :: (3\.\d+)", " ".join(PROJECT["classifiers"]))
    assert {row["python"] for row in rows} == set(named)
    assert {row["os"].partition("-")[0] for row in rows} == {"ubuntu", "macos"}


def test_oldest_drake_tested_is_the_lower_bound():
    rows = WORKFLOWS["test"]["jobs"]["test"]["strategy"]["matrix"]["include"]
    (bound,) = [d.partition(">=")[2] for d in PROJECT["dependencies"] if d.startswith("drake>=")]
    oldest = {row["drake"] for row in rows if "drake" in row}
    assert len(oldest) == 1
    assert oldest.pop().startswith(f"{bound}.")


def test_every_address_of_the_project_is_the_one_that_pyproject_names():
    repository = PROJECT["urls"]["Repository"]
    files = subprocess.check_output(["git", "ls-files"], cwd=ROOT, text=True).split()
    texts = [(ROOT / name).read_text() for name in files if name.endswith((".md", ".yml", ".cff"))]
    named = re.findall(r"https://github\.com/[\w-]+/geoimp-drake", " ".join(texts))
    assert len(named) >= 4
    assert set(named) == {repository}


def test_citation_names_the_version():
    from geoimp_drake import __version__

    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert citation["version"] == __version__
    assert citation["license"] == PROJECT["license"]


def test_changelog_has_a_section_of_the_version_for_the_release_to_take():
    from geoimp_drake import __version__

    assert re.search(rf"^## {re.escape(__version__)}\b", (ROOT / "CHANGELOG.md").read_text(), re.M)
