"""Which walls and dampings make the loop ring: against the simulated arm, and by themselves."""

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geoimp_drake.analysis.report import analyze, directions_of, ringing_warning
from geoimp_drake.analysis.ringing import (
    critical_damping,
    delayed,
    largest_stiffness,
    on_surface,
    rings,
)
from geoimp_drake.errors import ConfigurationError

_FILE = Path(__file__).parents[2] / "docs/validation/studies/ringing.py"
_spec = importlib.util.spec_from_file_location("ringing_study", _FILE)
assert _spec is not None
assert _spec.loader is not None
study = importlib.util.module_from_spec(_spec)
sys.modules["ringing_study"] = study  # where its dataclasses look for their module
_spec.loader.exec_module(study)

NORMAL = np.eye(6)[5]


@pytest.fixture(scope="module")
def trial():
    return study.Trial()


@pytest.mark.parametrize("point", [*study.POINTS[:4:2], study.POINTS[6]], ids=str)
def test_damping_at_which_the_arm_begins_to_ring_and_how_fast(trial, point) -> None:
    """Within 5 % and 3 %, as the study shows of twelve contacts."""
    critical = trial.predicted(point)
    (falls, _), (grows, frequency) = (trial.ring(point, f * critical) for f in (1.05, 0.95))
    assert falls < 1.0 < grows
    said = study.frequency_of(trial.loop(point, 0.95 * critical))
    assert frequency == pytest.approx(said, rel=0.03)


def test_stiffness_from_which_on_walls_ring_is_the_border(trial) -> None:
    loop = trial.loop(study.Point(2.0, 1e4, 4e-3), 60.0)
    border = largest_stiffness(loop, NORMAL)
    assert not rings(on_surface(loop, 0.99 * border))
    assert rings(on_surface(loop, 1.01 * border))
    later = largest_stiffness(delayed(loop, 15e-3), NORMAL)
    assert later < 0.5 * border


def test_dampings_that_do_not_ring_lie_between_two_borders(trial) -> None:
    point = study.Point(2.0, 1e5, 2e-3)
    low, high = critical_damping(trial.loop(point, 100.0), slice(3, 6))
    for factor, expected in ((0.98 * low, True), (1.02 * low, False), (1.02 * high, True)):
        assert rings(trial.loop(point, 100.0 * factor)) is expected
    assert rings(trial.loop(point, 100.0 * 0.98 * high)) is False


def test_analysis_says_what_the_parts_say(trial) -> None:
    point = study.Point(2.0, 1e5, 2e-3)
    loop = trial.loop(point, 20.0)
    told = analyze(loop)
    assert told.rings
    assert told.growth > 1.0
    assert told.ringing_frequency == pytest.approx(study.frequency_of(loop), rel=0.05)
    assert told.directions["normal"].wall == pytest.approx(1e5)
    assert told.directions["normal"].critical_damping[0] > 20.0
    assert f"{told.ringing_frequency:.3g} Hz" in ringing_warning(loop)
    assert not ringing_warning(trial.loop(point, 100.0))
    json = told.as_dict()
    assert json["critical_damping"]["normal"][0] == told.directions["normal"].critical_damping[0]
    assert len(json["modes"]["impedance"]) >= 6
    assert "normal" in str(told)


def test_directions_are_the_principal_axes_of_the_stiffness(trial) -> None:
    loop = trial.loop(study.Point(2.0, 1e5, 2e-3), 20.0)
    turn, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    K = np.kron(np.eye(2), turn) @ np.diag([1.0, 2, 3, 4, 5, 6]) @ np.kron(np.eye(2), turn).T
    found = directions_of(replace(loop, stiffness=K))
    for name, vector in found.items():
        if name != "normal":
            np.testing.assert_allclose(K @ vector, (vector @ K @ vector) * vector, atol=1e-9)
    assert next(iter(found)) == "normal"
    assert len(found) == 7


def test_what_cannot_be_is_refused_with_the_number(trial) -> None:
    loop = trial.loop(study.Point(2.0, 1e5, 0.0), 20.0)
    with pytest.raises(ConfigurationError, match="delay is -1 s"):
        delayed(loop, -1.0)
    with pytest.raises(ConfigurationError, match="delay"):
        delayed(loop, 1.0)
    with pytest.raises(ConfigurationError, match="surface_stiffness is 0 N/m"):
        on_surface(loop, 0.0)
