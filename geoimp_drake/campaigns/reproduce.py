"""Runs every experiment with every variant that its figures need: one folder, one page about it.

```
 OUT/report.html
 OUT/EXPERIMENT/comparison.png, .pdf, .json    across the variants
 OUT/EXPERIMENT/VARIANT/                       what a run writes
 OUT/SECTION/                                  of what is no experiment with variants
 OUT/journal.jsonl                             what has finished
```
"""

import contextlib
import importlib.util
import logging
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator

from geoimp_drake.campaigns.compare import COMPARISON_FILES, compare_runs
from geoimp_drake.campaigns.fastest_form import fastest_form
from geoimp_drake.campaigns.journal import Finished, Journal
from geoimp_drake.campaigns.many_runs import check_jobs, run_many
from geoimp_drake.campaigns.report import REPORT, check_report, write_report
from geoimp_drake.campaigns.reproduction import (
    Reproduction,
    Section,
    StudyResult,
    VariantResult,
)
from geoimp_drake.campaigns.study import Study
from geoimp_drake.campaigns.study_run import (
    RUN_FIELDS,
    StudyRun,
    identity_of,
    is_current,
    run_study_run,
)
from geoimp_drake.campaigns.table import Page
from geoimp_drake.errors import OutputError
from geoimp_drake.output_folder import check_folder
from geoimp_drake.scenario.loading import plain_data, read_yaml
from geoimp_drake.simulation.experiment import RUN_FILES
from geoimp_drake.simulation.style import figure_files

__all__ = ["reproduce"]

JOURNAL = "journal.jsonl"
PAGE = Page("reproduce", "The experiments, reproduced")

_log = logging.getLogger("drake")


def reproduce(
    studies: Sequence[Study],
    out: Path,
    *,
    jobs: int = 1,
    duration: float | None = None,
    seed: int | None = None,
    sections: Sequence[Section] = (),
    page: Page = PAGE,
) -> Reproduction:
    """Does the runs that `out` does not have yet, compares the variants and writes the report.

    A run counts as done if it has ended and its files are as it left them. Neither its scenario nor
    this library may have changed since.

    Args:
        studies: the experiments to run.
        out: folder to write into; made if need be.
        jobs: processes on this machine.
        duration: simulated time of every run [s], instead of the scenarios' own.
        seed: of the sensors' noise, instead of the scenarios' own.
        sections: further ones to run.
        page: the report's title and further contents.

    Raises:
        ConfigurationError: an option or the folder cannot be used, or an extra is missing; nothing
            has been written.
        OutputError: the disk is full; the message names the missing runs, the others are kept.
    """
    label = f"geoimp {page.command}"
    # The journal belongs to the command; `is_current` decides for each run in it if it still
    # counts.
    plan = {"command": page.command}
    check_report(label)
    check_jobs(jobs, label)
    check_folder(out, _files(studies, sections))
    given = {"duration": duration, "seed": seed}
    overrides = tuple(f"{name}={value}" for name, value in given.items() if value is not None)
    runs = _runs(studies, out.absolute(), overrides)
    done = Journal(out / JOURNAL, plan, RUN_FIELDS).read()
    missing = [
        run for key, run in runs.items() if key not in done or not is_current(run, done[key])
    ]
    _log.info(f"{len(missing)} of {len(runs)} runs are to be done, {jobs} at a time.")
    _compile_laws(missing)
    finished = run_many(
        runs,
        run_study_run,
        jobs=jobs,
        journal=out / JOURNAL,
        plan=plan,
        label=label,
        fields=RUN_FIELDS,
        is_current=lambda key, ended: key in runs and is_current(runs[key], ended),
    )
    try:
        results = tuple(_result(study, out, finished) for study in studies)
        made = tuple(section.run(out / section.name, jobs, overrides) for section in sections)
        reproduction = Reproduction(results, duration, made)
        write_report(reproduction, out, page)
    except OutputError as error:
        without = [key for key, ended in finished.items() if ended.result is None]
        raise OutputError(
            f"{error} Runs without results: {', '.join(without) or 'none'}."
        ) from error
    return reproduction


def _files(studies: Sequence[Study], sections: Sequence[Section]) -> Iterator[str]:
    """Yields the paths of all files that are written, relative to the folder."""
    yield from (JOURNAL, REPORT)
    yield from (f"{section.name}/{file}" for section in sections for file in section.files)
    for study in studies:
        yield from (f"{study.name}/{file}" for file in COMPARISON_FILES)
        for variant in study.variants:
            files = (*RUN_FILES, *figure_files(*variant.figures))
            yield from (f"{study.name}/{variant.name}/{file}" for file in files)


def _runs(studies: Sequence[Study], out: Path, overrides: tuple[str, ...]) -> dict[str, StudyRun]:
    """Returns every run by its key, the longest first so that no process idles at the end."""
    runs = {}
    for study in sorted(studies, key=lambda study: -study.cost):
        for variant in study.variants:
            key = f"{study.name}/{variant.name}"
            data = plain_data(
                study.experiment.scenario((fastest_form(),), (*variant.settings, *overrides))
            )
            main = variant is study.variants[0]
            identity = identity_of(data, html=main)
            runs[key] = StudyRun(study.experiment, data, out / key, main, identity)
    return runs


def _compile_laws(missing: Sequence[StudyRun]) -> None:
    """Compiles the control laws, if numba is installed, so that two processes do not do so at once.

    Each set-up with each scheme and orientation family has laws of its own; one step of it compiles
    them.
    """
    if importlib.util.find_spec("numba") is None:
        return
    kinds = {
        (
            run.experiment.setup,
            run.scenario.get("scheme"),
            run.scenario["impedance"]["orientation"],
        ): run
        for run in missing
        if run.scenario["engine"] == "drake"
    }
    for run in kinds.values():
        # A run that fails reports that itself, when it is its turn.
        with contextlib.suppress(Exception, SystemExit):
            scenario = run.experiment.scenario((run.scenario,))
            setup = run.experiment.build(scenario)
            Simulator(setup.diagram).AdvanceTo(2 * scenario.plant.time_step)


def _result(study: Study, out: Path, finished: dict[str, Finished]) -> StudyResult:
    """Returns the results of a study's runs, with their comparison."""
    variants = tuple(
        VariantResult.of(variant, out / study.name, finished[f"{study.name}/{variant.name}"])
        for variant in study.variants
    )
    compared = {
        result.variant.name: _saved(study, result.folder)
        for result in variants
        if result.files and result.variant.name in study.compared
    }
    if not compared:
        return StudyResult(study, variants, (), ())
    claims, files = compare_runs(
        study.name, study.comparison, compared, out / study.name, study.kind
    )
    tables = study.comparison.tables(compared)
    return StudyResult(study, variants, tuple(claims), tuple(files), tuple(tables))


def _saved(study: Study, folder: Path) -> tuple[dict[str, Any], Any]:
    """Returns log and scenario of a run from its files."""
    with np.load(folder / "log.npz") as log:
        return dict(log), study.experiment.scenario((read_yaml(folder / "scenario.yaml"),))
