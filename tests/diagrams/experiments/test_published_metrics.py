"""Numbers that others publish stand beside ours: each with its source, ours measured."""

import csv
from pathlib import Path

import numpy as np
import pytest

from geoimp_drake.analysis.response_metrics import (
    ideal_response,
    impedance_power,
    root_mean_square,
)
from geoimp_drake.diagrams.experiments import published_metrics
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.experiments.published_metrics import (
    PublishedMetricsSection,
    step_metrics,
    task_metrics,
)
from geoimp_drake.diagrams.experiments.published_table import report_table, rows_of
from geoimp_drake.scenario.loading import read_yaml

PLAN = read_yaml(Path(published_metrics.__file__).with_suffix(".yaml"))


def scenario_of(name: str):
    """The scenario of one of the runs."""
    run = PLAN["runs"][name]
    return get_experiment(run["experiment"]).scenario((), tuple(run["settings"]))


def motion(positions, velocities, angle=0.0):
    """Frame motions (N×19) with given positions and velocities, turned about x [rad]."""
    rows = np.zeros((len(positions), 19))
    rows[:, 0], rows[:, 1] = np.cos(angle / 2.0), np.sin(angle / 2.0)
    rows[:, 4:7], rows[:, 10:13] = positions, velocities
    return rows


def test_every_published_number_has_a_metric_a_source_and_what_was_read():
    for row in PLAN["published"]:
        metric, source = PLAN["metrics"][row["metric"]], PLAN["sources"][row["source"]]
        assert row["value"] >= 0.0
        assert all((row["of"], row["conditions"], source["cited"], source["read"]))
        assert all((metric["name"], metric["unit"], metric["differs"]))
    assert {row["source"] for row in PLAN["published"]} == PLAN["sources"].keys()
    assert PLAN["not_found"]


def test_a_report_has_one_row_a_metric_with_theirs_and_ours():
    values = {"known plant": {"overshoot": 31.0}}
    table = report_table(PLAN, rows_of(PLAN, values))
    assert len(table.rows) == len(PLAN["metrics"])
    (row,) = (row for row in table.rows if row[0].startswith("force overshoot"))
    assert row[2] == "31, known plant"
    assert all(
        f"{own['value']:.4g}" in row[1] for own in PLAN["published"] if own["metric"] == "overshoot"
    )
    assert row[3] == PLAN["metrics"]["overshoot"]["differs"]


def test_what_was_derived_is_the_published_watts_over_the_ideal_power_of_that_step():
    times = np.arange(0.0, 0.2495, 0.001)
    M, D, K = 10.0 * np.eye(3), 134.164 * np.eye(3), 800.0 * np.eye(3)
    x, v = ideal_response(times, np.tile([320.0, 0.0, 0.0], (len(times), 1)), M, D, K)
    power = impedance_power(x - [0.4, 0.0, 0.0], v, D, K)
    assert (power.max(), power.min()) == pytest.approx((168.0, -74.0), abs=0.5)
    ideal = root_mean_square(power)
    assert ideal == pytest.approx(91.2, abs=0.05)
    values = {name: [] for name in ("fidelity", "relative_fidelity")}
    for row in PLAN["published"]:
        values.get(row["metric"], []).append(row["value"])
    derived = np.array(values["fidelity"]) / ideal
    np.testing.assert_allclose(values["relative_fidelity"], derived, atol=5e-4)


def test_task_metrics_of_a_hand_that_is_off_by_known_amounts():
    scenario, t = scenario_of("known plant"), np.arange(0.0, 13.0005, 0.001)
    D = motion(np.zeros((len(t), 3)), np.zeros((len(t), 3)))
    moving, resting = t <= 2.0, (t > 2.0) & (t <= 6.0)
    offset = np.zeros((len(t), 3))
    offset[moving, 0] = 3e-3 * np.where(t[moving] < 1.0, 1.0, 0.0)  # half of the time 3 mm
    offset[resting, 1] = 2e-3
    E = motion(offset, 0.0 * offset, np.radians(0.5))
    E[:, 16] = 7.0 * t  # acceleration along x
    wrench = np.zeros((len(t), 6))
    wrench[t > 8.0, 5] = -12.0
    wrench[(t > 9.0) & (t <= 9.5), 5] = -24.0
    log = {"t": t, "six/motion_D": D, "six/motion_E": E, "six/motion_C": D}
    values = task_metrics(log | {"six/wrench_true": wrench, "six/wrench": wrench}, scenario)
    expected = {
        "regulation_position": 2.0,
        "regulation_orientation": 0.5,
        "tracking_position_mean": 1.5,
        "tracking_position": 3.0 / np.sqrt(2.0),
        "tracking_orientation": 0.5,
        "jerk": 7.0,
        "overshoot": 100.0,
        "peak_force": 24.0,
        "time_above_20N": 0.5,
    }
    assert values == pytest.approx(expected, rel=2e-3)
    # Of a run that ended before the contact, only what came before it.
    early = {key: rows[t <= 6.5] for key, rows in log.items()}
    assert task_metrics(early | {"six/wrench_true": wrench[t <= 6.5]}, scenario).keys() == {
        "regulation_position",
        "regulation_orientation",
        "tracking_position_mean",
        "tracking_position",
        "tracking_orientation",
        "jerk",
    }


def test_fidelity_counts_what_leaks_into_a_direction_without_a_force():
    scenario, t = scenario_of("step, known plant"), np.arange(0.0, 0.5005, 0.001)
    profile = np.array([scenario.external.profile()(time) for time in t])
    M, D, K = scenario.impedance.gains("translation")
    x, v = ideal_response(t, np.outer(profile, scenario.external.force), M, D, K)
    at_rest = motion(np.tile([0.9, 0.0, 0.7], (len(t), 1)), 0.0 * x)

    def values(dx, dv):
        E = motion(at_rest[:, 4:7] + x + dx, v + dv)
        return step_metrics({"t": t, "six/motion_D": at_rest, "six/motion_E": E}, scenario)

    assert values(0.0, 0.0)["fidelity"] == pytest.approx(0.0, abs=1e-9)
    # A tenth of the response sideways: its power is all that is off.
    dx, dv = 0.1 * x[:, [1, 0, 2]], 0.1 * v[:, [1, 0, 2]]
    early = t <= 0.249
    leak = root_mean_square(impedance_power(dx[early], dv[early], D, K))
    shift = np.linalg.solve(K, scenario.external.force)
    asked = root_mean_square(impedance_power(x[early] - shift, v[early], D, K))
    expected = {"fidelity": leak, "relative_fidelity": leak / asked}
    assert values(dx, dv) == pytest.approx(expected)


def test_the_section_leaves_table_figure_and_claims_and_runs_nothing_twice(tmp_path):
    name = "step, known plant"
    plan = {**PLAN, "runs": {name: PLAN["runs"][name]}}
    section = PublishedMetricsSection()
    first = section.run(tmp_path, 1, (), plan)
    before = (tmp_path / "journal.jsonl").read_bytes()
    again = section.run(tmp_path, 1, (), plan)
    assert (tmp_path / "journal.jsonl").read_bytes() == before
    assert first == again
    assert not first.failures
    assert {path.name for path in tmp_path.iterdir()} == {*section.files}
    (claim,) = first.claims
    assert claim.holds
    # The wrist sensor is read every 1 ms, in which a sharp force meets the arm's own inertia.
    assert 0.1 < claim.value < 0.25
    rows = list(
        csv.DictReader((tmp_path / "published_metrics.csv").read_text("utf-8").splitlines())
    )
    assert len(rows) == len(PLAN["published"]) + 2
    ours = [row for row in rows if row["of"] == f"this library, {name}"]
    assert [float(row["value"]) for row in ours][1] == pytest.approx(claim.value, rel=1e-3)
    assert all(row["not comparable"] for row in rows)
    assert all(bool(row["source"]) != (row in ours) for row in rows)


def test_theirs_stand_before_ours_metric_by_metric():
    rows = rows_of(PLAN, {"known plant": {"overshoot": 30.0, "peak_force": 16.0}})
    names = list(PLAN["metrics"])
    places = [names.index(row.metric) for row in rows]
    assert places == sorted(places)
    overshoot = [row.of for row in rows if row.metric == "overshoot"]
    assert overshoot[-1] == "this library, known plant"
    assert len(overshoot) == 3
