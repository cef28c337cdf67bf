"""The impedance that a log shows is the one asked for; what nothing excites has no number."""

import json
from copy import deepcopy

import numpy as np
import pytest
from runs import family, run

from geoimp_drake import cli
from geoimp_drake.analysis.identification import FRAMES, identify, moving
from geoimp_drake.analysis.least_squares import fitted
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.scenario.loading import dump_scenario

FAMILIES = ("quaternion", "classical-euler", "alternative-euler", "angle-axis-tan-half")
NOISY = ("plexiglas", "duration=12", "form=compiled", "sensor.force_noise=0.3")
NOISY = (*NOISY, "sensor.moment_noise=0.01")
K_C = "[[0, 0.4, 0], [0, 0, 0.3], [0.5, 0, 0]]"
COUPLED = (
    "impedance.axes=both",
    "impedance.translation={axes: desired, stiffness: [700, 300, 900], damping: [2000, 900, 1500]}",
    f"impedance.coupling={K_C}",
)


def read(name, *overrides, frame="C"):
    log, scenario, failure = run(name, *overrides)
    assert failure is None
    return {reading.part: reading for reading in identify(log, scenario.impedance, frame=frame)}


@pytest.mark.parametrize("name", FAMILIES)
def test_c_shows_the_law_of_every_family_and_e_follows_it(name):
    (computed,) = read("consistency", family(name)).values()
    assert computed.misfit < 1e-9
    assert computed.mean_error < 1e-6
    assert all(estimate.error is not None for estimate in computed.estimates)
    (done,) = read("consistency", family(name), frame="E").values()
    assert 1e-9 < done.mean_error < 0.02


def test_c_shows_gains_in_the_axes_of_d_and_what_a_coupling_leaves():
    readings = read("consistency", *COUPLED)
    assert set(readings) == {"translation", "rotation"}
    for reading in readings.values():
        assert reading.misfit < 1e-9
        assert reading.mean_error < 1e-6


def test_noise_of_the_sensor_leaves_c_exact_and_e_within_five_percent():
    for reading in read(*NOISY).values():
        assert reading.mean_error < 1e-6
    done = read(*NOISY, frame="E")
    for reading in done.values():
        assert reading.mean_error < 0.05
    z = {e.gain: e for e in done["translation"].estimates if e.axis == "z"}
    assert abs(z["stiffness"].error) < 2e-3
    assert 0.0 < z["stiffness"].half_width < 0.01 * z["stiffness"].asked
    x = next(e for e in done["translation"].estimates if (e.gain, e.axis) == ("mass", "x"))
    assert x.found is None
    assert x.error is None
    assert x.half_width > 0.5 * x.asked


def test_what_the_arm_does_is_told_whatever_was_asked():
    log, scenario, _ = run("consistency")
    asked = deepcopy(scenario.impedance)
    asked.rotation.damping = np.array([3.0, 3.0, 1.0])
    (reading,) = identify(log, asked)
    errors = [e.error for e in reading.estimates if e.gain == "damping"]
    np.testing.assert_allclose(errors, [-0.5, -0.5, 0.5], atol=1e-6)


def test_a_log_that_cannot_be_read_is_refused_in_words():
    log, scenario, _ = run("consistency")
    wrench = log["six/wrench"]
    cases = {
        "no 'six/wrench'": {k: v for k, v in log.items() if k != "six/wrench"},
        "finite": {**log, "six/wrench": np.where(wrench == wrench[5], np.nan, wrench)},
        r"shape \(301, 3\)": {**log, "six/wrench": wrench[:, :3]},
        "must be at least two": {**log, "t": np.zeros(301)},
        "needs 61": {k: v[:40] for k, v in log.items()},
    }
    for words, bad in cases.items():
        with pytest.raises(ConfigurationError, match=words):
            identify(bad, scenario.impedance)
    with pytest.raises(ConfigurationError, match="no desired motion"):
        moving({"t": log["t"]})


def test_values_that_nothing_tells_apart_have_an_infinite_interval():
    rng = np.random.default_rng(0)
    columns = rng.normal(size=(200, 3, 4))
    columns[:, :, 2] = 3.0 * columns[:, :, 1]
    columns[:, :, 3] = 0.0
    values, half_widths, condition, misfit = fitted(columns, 2.0 * columns[:, :, 0])
    assert values[0] == pytest.approx(2.0)
    assert half_widths[0] < 1e-12
    assert np.all(np.isinf(half_widths[1:]))
    assert np.isinf(condition)
    assert misfit < 1e-12
    assert np.all(np.isinf(fitted(np.zeros((60, 3, 2)), np.zeros((60, 3)))[1]))


def test_the_interval_holds_the_value_though_residuals_are_alike():
    """Noise with a memory of ten samples: intervals for independent residuals hold two in three."""
    rng = np.random.default_rng(1)
    window, held = np.ones(10) / np.sqrt(10.0), 0
    slow = np.sin(np.arange(1000) / 60.0)[:, None, None] * np.eye(3)[None]
    for _ in range(100):
        noise = [np.convolve(rng.normal(size=1009), window, "valid") for _ in range(3)]
        values, half_widths, *_ = fitted(slow, slow.sum(axis=2) + np.stack(noise, axis=1))
        held += np.count_nonzero(np.abs(values - 1.0) < half_widths)
    assert held > 0.93 * 300


@pytest.fixture
def folder(tmp_path):
    log, scenario, _ = run("consistency")
    np.savez(tmp_path / "log.npz", **log)
    (tmp_path / "scenario.yaml").write_text(dump_scenario(scenario), encoding="utf-8")
    return tmp_path


def test_the_command_prints_asked_and_found_and_writes_json(folder, capsys):
    out = folder / "found.json"
    assert cli.main(("identify", str(folder), "--json", str(out))) == 0
    printed = capsys.readouterr().out
    assert "six, rotation of C: mean error" in printed
    assert "not excited" in printed
    told = json.loads(out.read_text(encoding="utf-8"))["six"]
    assert [reading["frame"] for reading in told] == list(FRAMES)
    row = next(e for e in told[0]["estimates"] if (e["gain"], e["axis"]) == ("stiffness", "z"))
    assert row["asked"] == 2.5
    assert row["found"] == pytest.approx(2.5)


def test_the_command_wants_the_scenario_and_refuses_natural_inertia(folder, capsys):
    file = folder / "scenario.yaml"
    file.unlink()
    assert cli.main(("identify", str(folder))) == 2
    assert "Give the scenario with --scenario" in capsys.readouterr().err
    natural = "experiment: plexiglas\nscheme: direct\ninertia: natural\n"
    file.write_text(natural + "sensor: {inertial_load: plant}\n", encoding="utf-8")
    assert cli.main(("identify", str(folder))) == 2
    assert "inertia: natural" in capsys.readouterr().err
