"""Everything in one folder: what is in it, what is done again, and its pages in a real browser."""

import collections
import contextlib
import io
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import BROWSERS, find_browser, visit
from matplotlib.image import imread

from geoimp_drake import cli
from geoimp_drake.campaigns.fastest_form import fastest_form
from geoimp_drake.campaigns.journal import Finished
from geoimp_drake.campaigns.reproduction import CONTRAST, VariantResult
from geoimp_drake.campaigns.study import Study, Variant
from geoimp_drake.diagrams.experiments import reproduction
from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS, get_experiment
from geoimp_drake.diagrams.experiments.comparisons import COMPARISONS
from geoimp_drake.diagrams.experiments.simulators import SIMULATORS
from geoimp_drake.scenario.loading import plain_data
from geoimp_drake.simulation.claims import FAILS, HOLDS, Claim

SHORT = ("--duration", "0.1", "--jobs", "2")
ALL = reproduction.studies()
MOST_VARIANTS = 4  # of a study that is no table of schemes and errors


def with_few_variants(study: Study) -> Study:
    """The study with one error of each scheme: what is drawn of a scheme is the same for all."""
    if len(study.variants) <= MOST_VARIANTS:
        return study
    few = tuple({str(variant.figures): variant for variant in reversed(study.variants)}.values())
    return replace(study, variants=few, compared=tuple(variant.name for variant in few))


STUDIES = tuple(with_few_variants(study) for study in ALL)
RUNS = {f"{study.name}/{variant.name}": variant for study in STUDIES for variant in study.variants}
MAIN = {study.name: study.variants[0].name for study in STUDIES}


def run(*arguments: str | Path) -> int:
    try:
        return cli.main(["reproduce", *map(str, arguments)])
    except SystemExit as stop:
        return int(stop.code or 0)


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> tuple[Path, str]:
    """The folder of a reproduction, every run cut short, and what was printed."""
    out = tmp_path_factory.mktemp("whole") / "results"
    with few_variants(), contextlib.redirect_stdout(io.StringIO()) as printed:
        assert run(*SHORT, "--out", out) == 0
    return out, printed.getvalue()


@contextlib.contextmanager
def few_variants():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reproduction, "studies", lambda: STUDIES)
        yield


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out"


def keys_in(out: Path) -> list[str]:
    """Keys of the runs in a journal, in the order in which they ended."""
    lines = (out / "journal.jsonl").read_text("utf-8").splitlines()
    return [json.loads(line)["key"] for line in lines[1:]]


def claims_in(out: Path) -> list[dict[str, object]]:
    files = [*out.glob("*/*/metrics.json"), *out.glob("*/comparison.json")]
    worlds = json.loads((out / "worlds" / "worlds.json").read_text("utf-8"))
    claims = (json.loads(file.read_text("utf-8"))["claims"] for file in files)
    return [*worlds, *(claim for of_file in claims for claim in of_file)]


def test_every_experiment_is_reproduced():
    twice = [f"{name}_two_simulators" for name in SIMULATORS]
    assert [study.name for study in ALL] == [*EXPERIMENTS, *twice]
    for study in ALL:
        assert {*study.compared} <= {variant.name for variant in study.variants}


LEFT_OUT = [
    pytest.param(study.experiment, variant.settings, id=f"{study.name}/{variant.name}")
    for study in ALL
    for variant in study.variants
    if f"{study.name}/{variant.name}" not in RUNS
]


@pytest.mark.parametrize(("experiment", "settings"), LEFT_OUT)
def test_variants_that_are_not_run_here_can_be_built(experiment, settings):
    experiment.build(experiment.scenario((fastest_form(),), settings))


def test_each_run_has_its_folder_with_the_files_of_a_run(whole):
    out, _ = whole
    assert {str(path.parent.relative_to(out)) for path in out.glob("*/*/log.npz")} == set(RUNS)
    for key, variant in RUNS.items():
        drawn = {*variant.figures, "energy_audit"}
        figures = {f"{name}.{kind}" for name in drawn for kind in ("png", "pdf")}
        replay = {"replay.html"} if key in {f"{e}/{v}" for e, v in MAIN.items()} else set()
        files = {"log.npz", "scenario.yaml", "metrics.json"} | figures | replay
        assert {path.name for path in (out / key).iterdir()} == files, key
        scenario = (out / key / "scenario.yaml").read_text("utf-8")
        form = "blocks" if "form=blocks" in variant.settings else fastest_form()["form"]
        assert f"\nform: {form}\n" in scenario


def test_the_worlds_have_a_section_with_what_is_claimed_of_the_deviations(whole):
    out, _ = whole
    page = (out / "report.html").read_text("utf-8")
    assert '<h2 id="worlds">' in page
    assert page.count("plexiglas, mild: E off C at rest") == 1
    keys = [key.split("/")[:2] for key in keys_in(out / "worlds")]
    assert {experiment for experiment, error in keys if error == "masses"} == {
        world
        for world in EXPERIMENTS
        if world not in ("disturbance", "limits", "collision", "orientation_loop")
    }


def test_what_a_variant_breaks_on_purpose_is_a_claim_of_its_run(whole):
    for key, variant in RUNS.items():
        metrics = json.loads((whole[0] / key / "metrics.json").read_text("utf-8"))
        assert {*variant.contrast} <= {claim["claim"] for claim in metrics["claims"]}


def test_the_summary_counts_each_claim_and_names_the_report(whole):
    out, printed = whole
    count = re.match(r"(\d+) claims: .*not reached", printed)
    assert count
    assert int(count[1]) == len(claims_in(out))
    assert printed.endswith(f"report: {out / 'report.html'}\n")


def test_started_again_it_does_what_is_missing_alone_and_the_same_to_the_bit(whole, capsys):
    out, _ = whole
    before = {path: path.stat().st_mtime_ns for path in out.glob("*/*/*")}
    lost, damaged = out / "consistency" / "classical-euler", out / "nondiagonal" / "classical-euler"
    kept = {path: path.read_bytes() for folder in (lost, damaged) for path in folder.iterdir()}
    page = (out / "report.html").read_bytes()
    keys = keys_in(out)
    worlds = keys_in(out / "worlds")
    (lost / "metrics.json").unlink()
    (damaged / "log.npz").write_bytes(b"")
    with few_variants():
        assert run(*SHORT, "--out", out) == 0
    again = {path.parent for path, time in before.items() if path.stat().st_mtime_ns != time}
    assert again == {lost, damaged}
    assert sorted(keys_in(out)[len(keys) :]) == [str(p.relative_to(out)) for p in (lost, damaged)]
    assert keys_in(out / "worlds") == worlds
    assert {path: path.read_bytes() for path in kept} == kept
    assert (out / "report.html").read_bytes() == page


def small_study(**settings: tuple[str, ...]) -> Study:
    """A study of one experiment with variants by name."""
    variants = [Variant(name, name, given, {}, {}) for name, given in settings.items()]
    name = "plexiglas"
    return Study(
        get_experiment(name), name, tuple(variants), COMPARISONS[name], tuple(settings), "", "", 1.0
    )


def test_another_duration_or_seed_is_run_anew(out, monkeypatch):
    monkeypatch.setattr(reproduction, "studies", lambda: (small_study(one=()),))
    monkeypatch.setattr(reproduction, "sections", lambda: ())
    for count, (duration, seed) in enumerate([("0.01", "0"), ("0.02", "0"), ("0.02", "3")], 1):
        assert run("--duration", duration, "--seed", seed, "--jobs", "1", "--out", out) == 0
        assert len(keys_in(out)) == count
        metrics = json.loads((out / "plexiglas/one/metrics.json").read_text("utf-8"))
        assert (metrics["duration"], metrics["seed"]) == (float(duration), int(seed))


def test_a_simulation_that_fails_is_shown_and_gives_status_1(out, monkeypatch, capsys):
    # Far below any sensible inertia, the integrator of C diverges; nothing reaches 2.5 m.
    study = small_study(
        good=("duration=0.01",),
        unstable=("impedance.translation.mass=1e-4", "log_period=0.001"),
        unreachable=("start.position=[2.5, 0, 0.7]",),
    )
    monkeypatch.setattr(reproduction, "studies", lambda: (study,))
    monkeypatch.setattr(reproduction, "sections", lambda: ())
    assert run("--jobs", "2", "--out", out) == 1
    errors = capsys.readouterr().err
    assert re.search("simulation of plexiglas/unstable failed: ", errors)
    assert re.search("simulation of plexiglas/unreachable failed: .*No posture", errors)
    page = (out / "report.html").read_text("utf-8")
    assert page.count('class="failure"') == 4  # on top and in their places
    # What has no files is tried again.
    assert run("--jobs", "2", "--out", out) == 1
    assert collections.Counter(keys_in(out)) == {
        "plexiglas/good": 1,
        "plexiglas/unstable": 1,
        "plexiglas/unreachable": 2,
    }


@pytest.mark.parametrize(
    ("holds", "contrast", "verdict"),
    [(True, False, HOLDS), (False, False, FAILS), (False, True, CONTRAST), (True, True, FAILS)],
)
def test_a_contrast_must_be_seen(holds, contrast, verdict, tmp_path):
    variant = Variant("v", "v", (), {}, {"it holds": "on purpose"} if contrast else {})
    claim = Claim("it holds", 1.0, "≤ 2", "N", holds)
    result = VariantResult(variant, tmp_path, (), (claim,), None)
    assert [judged.verdict for judged in result.judged()] == [verdict]


def test_a_run_that_could_not_start_has_no_claims(tmp_path):
    finished = Finished(None, "ConfigurationError: no", 0.0)
    result = VariantResult.of(next(iter(RUNS.values())), tmp_path, finished)
    assert (result.claims, result.files, result.failure) == ((), (), "ConfigurationError: no")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--jobs", "0"), "jobs is 0"),
        (("--duration", "-1"), "duration is -1"),
        (("--seed", "-1"), "seed is -1"),
    ],
)
def test_unusable_options_write_nothing(options, message, out, capsys):
    assert run(*options, "--out", out) == 2
    assert message in capsys.readouterr().err
    assert not out.exists()


def test_a_folder_with_the_journal_of_a_sweep_is_refused(out, capsys):
    out.mkdir()
    plan = {"experiment": "plexiglas", "scenario": plain_data(EXPERIMENTS["plexiglas"].scenario())}
    (out / "journal.jsonl").write_text(json.dumps({"plan": plan}) + "\n")
    assert run(*SHORT, "--out", out) == 2
    error = capsys.readouterr().err
    assert "holds runs of another plan: command is not given there and 'reproduce' here" in error
    assert error.count("\n") == 1
    assert len(error) < 400 + len(str(out))


def test_a_missing_browser_is_named(monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(FileNotFoundError, match="apt-get install chromium"):
        find_browser()
    assert BROWSERS


def test_the_report_shows_every_claim_figure_and_file_without_a_network(whole):
    out, _ = whole
    with visit(out / "report.html") as visited:
        page = visited.page
        broken = page.evaluate("[...document.images].filter(i => !i.naturalWidth).map(i => i.src)")
        images = page.evaluate("[...document.images].map(i => i.getAttribute('src'))")
        links = page.evaluate("[...document.links].map(a => a.getAttribute('href'))")
        ids = page.evaluate("[...document.querySelectorAll('[id]')].map(e => e.id)")
        claims = page.evaluate(
            "[...document.querySelectorAll('tbody tr')].map(r => r.querySelector('td').innerText)"
        )
        text = page.inner_text("body")
    assert visited.errors == []
    assert [url for url in visited.requests if not url.startswith(out.resolve().as_uri())] == []
    assert broken == []
    assert {str(path.relative_to(out)) for path in out.rglob("*.png")} == set(images)
    for link in links:
        assert link[1:] in ids if link.startswith("#") else (out / link).is_file(), link
    files = {str(path.relative_to(out)) for path in out.glob("*/**/*") if path.is_file()}
    assert files - set(images) <= {link.lstrip("./") for link in links}
    expected = collections.Counter(claim["claim"] for claim in claims_in(out))
    assert expected <= collections.Counter(claims)
    for variant in RUNS.values():
        assert all(" ".join(words.split()) in text for words in variant.figures.values())


# Of each experiment an arm's link, a frame and what else is in the cell.
OBJECTS = {
    "plexiglas": ("visualizer/six/link6", "frames/E/z", "visualizer/plexiglas/plate"),
    "singularity": ("visualizer/six/link6", "frames/E/z", "visualizer/plexiglas-stiff/plate"),
    "consistency": ("visualizer/six/link6", "frames/E/z"),
    "nondiagonal": ("visualizer/six/link6", "frames/E/z"),
    "redundancy": ("visualizer/seven/link6", "frames/E/z", "visualizer/cardboard/plate"),
    "peg_in_hole": ("visualizer/peg/peg", "visualizer/block/block", "visualizer/six/link6"),
    "bar": ("visualizer/bar/bar", "visualizer/seven/link6", "frames/O/z"),
    "disturbance": ("visualizer/six/link6", "frames/E/z", "visualizer/plexiglas/plate"),
    "limits": ("visualizer/six/link6", "frames/E/z"),
    "collision": ("visualizer/six/link6", "frames/E/z"),
    "orientation_loop": ("visualizer/six/link6", "frames/E/z"),
}
ALWAYS = ("frames/D/x", "frames/C/y", "wrench/shaft", "wrench/tip")
# How many meshes are at or below a path, -1 for a path that is not there.
COUNT_MESHES = """path => {
    const node = path.split('/').reduce((n, key) => n && n.children[key], viewer.scene_tree);
    let count = node ? 0 : -1;
    if (node) node.object.traverse(o => { count += o.isMesh ? 1 : 0; });
    return count;
}"""
# Where everything is at a time of the animation.
POSES = """time => {
    viewer.animator.pause();
    viewer.animator.seek(time);
    viewer.scene.updateMatrixWorld(true);
    const all = [];
    viewer.scene.traverse(o => all.push(...o.matrixWorld.elements));
    return all;
}"""
HIDE = """() => {
    viewer.scene_tree.children['drake'].object.visible = false;
    viewer.set_dirty();
}"""


def picture(page) -> np.ndarray:
    """What the page shows, as numbers."""
    page.wait_for_timeout(200)
    return imread(io.BytesIO(page.screenshot()), format="png")


@pytest.mark.parametrize("name", OBJECTS)
def test_a_replay_loads_moves_and_shows_the_scene(name, whole):
    file = whole[0] / name / MAIN[name] / "replay.html"
    with visit(file) as visited:
        page = visited.page
        meshes = {path: page.evaluate(COUNT_MESHES, f"drake/{path}") for path in OBJECTS[name]}
        meshes |= {path: page.evaluate(COUNT_MESHES, f"drake/{path}") for path in ALWAYS}
        # Played from its beginning, it gets to its end.
        page.evaluate("viewer.animator.reset(); viewer.animator.play()")
        page.wait_for_function("viewer.animator.time >= 0.99 * viewer.animator.duration")
        duration = page.evaluate("viewer.animator.duration")
        start, end = (np.array(page.evaluate(POSES, time)) for time in (0.0, duration))
        shown = picture(page)
        page.evaluate(HIDE)
        hidden = picture(page)
    assert visited.errors == []
    assert visited.requests == [file.resolve().as_uri()]
    assert {path for path, count in meshes.items() if count < 1} == set()
    assert duration == pytest.approx(0.1, abs=1 / 32)
    # The push at a limit begins after what is run here.
    assert name == "limits" or np.abs(end - start).max() > 1e-6
    assert (np.abs(shown - hidden).max(axis=2) > 0.05).mean() > 0.02
