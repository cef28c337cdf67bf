"""Compiled laws give the numbers of the laws as written, in the closed loop as well."""

import os
import subprocess
import sys
from functools import cache

import numpy as np
import pytest
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator

from geoimp_drake.compilation import compiled as module
from geoimp_drake.compilation.compiled import SWITCH, compilable, compiled
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.laws.impedance.compliant_motion import compliant_motion, frame_state_rate
from geoimp_drake.laws.impedance.families import FAMILIES, make_family
from geoimp_drake.laws.motion_control.orientation_control import ORIENTATION_LAWS, orientation_law
from geoimp_drake.laws.motion_control.tracking_acceleration import tracking_acceleration

needs_numba = pytest.mark.skipif(not module.is_available(), reason="numba is not installed")
NATURAL = ("scheme=direct", "inertia=natural", "sensor.inertial_load=plant")
TIGHT = {"rtol": 1e-12, "atol": 1e-12}


@compilable
def doubled(a):
    return 2.0 * a


def sum_of_doubled(a):
    return doubled(a).sum()


def spd(rng: np.random.Generator) -> np.ndarray:
    A = rng.normal(size=(3, 3))
    return A @ A.T + 3.0 * np.eye(3)


def motions(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Returns the motions of two frames whose orientations differ by less than a right angle."""
    near, far = rng.normal(size=(2, 19))
    near[:4] = far[:4] = [0.9, 0.3, -0.2, 0.1]
    far[:4] += rng.uniform(-0.1, 0.1, 4)
    for motion in (near, far):
        motion[:4] /= np.linalg.norm(motion[:4])
    return near, far


def both(law, *arguments, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns what a law writes, as written and compiled."""
    plain, fast = np.zeros((2, size))
    assert law(*arguments, plain)
    assert compiled(law)(*arguments, fast)
    return plain, fast


@needs_numba
def test_a_law_calls_another_that_is_marked() -> None:
    a = np.arange(3.0)
    assert compiled(sum_of_doubled) is not sum_of_doubled
    assert compiled(sum_of_doubled)(a) == sum_of_doubled(a) == 6.0


def test_a_marked_law_stays_as_it_is() -> None:
    assert doubled.__module__ == __name__
    np.testing.assert_array_equal(doubled(np.array([1, 2], dtype=object)), [2.0, 4.0])


def test_the_switch_leaves_every_law_as_it_is(monkeypatch) -> None:
    monkeypatch.setenv(SWITCH, "0")
    assert compiled(sum_of_doubled) is sum_of_doubled


def test_without_the_extra_every_law_is_as_it_is(monkeypatch, caplog) -> None:
    monkeypatch.setattr(module.importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(module, "_is_installed", cache(module._is_installed.__wrapped__))
    assert [compiled(law) for law in (doubled, sum_of_doubled)] == [doubled, sum_of_doubled]
    assert len(caplog.records) == 1  # what to install, see tests/project/test_extras.py


@needs_numba
@pytest.mark.parametrize("name", FAMILIES)
def test_impedance_is_the_same_compiled(name: str) -> None:
    rng = np.random.default_rng(0)
    family = make_family(name, spd(rng), spd(rng), spd(rng))
    law = compliant_motion(family.law)
    C, D = motions(rng)
    gains = np.array([spd(rng) for _ in range(3)])
    rotation = np.array([family.M_inv, family.D_o, family.K_o])
    for parts in (
        [True, True, False, False, False],
        [True, True, True, False, True],
        [True, True, False, True, True],
        [True, True, True, True, False],
        [False, False, False, False, False],
    ):
        given = gains, rotation, np.array([spd(rng), spd(rng)]), np.array(parts)
        plain, fast = both(law, C[:13], D, rng.normal(size=6), *given, size=19)
        np.testing.assert_allclose(fast, plain, **TIGHT)
        assert np.abs(plain[13:]).max() > 0.1
    rates = np.zeros((2, 13))
    frame_state_rate(plain, rates[0])
    compiled(frame_state_rate)(plain, rates[1])
    np.testing.assert_allclose(*rates, **TIGHT)


@needs_numba
@pytest.mark.parametrize("name", ORIENTATION_LAWS)
def test_tracking_is_the_same_compiled(name: str) -> None:
    rng = np.random.default_rng(1)
    reference, E = motions(rng)
    gains = np.array([65.0 * np.eye(3), 4500.0 * np.eye(3)])
    law = tracking_acceleration(orientation_law(name))
    plain, fast = both(law, reference, E[:4], E[4:7], E[7:13], gains, gains, size=6)
    np.testing.assert_allclose(fast, plain, **TIGHT)


def state_after(name: str, duration: float, *overrides: str) -> np.ndarray:
    experiment = get_experiment(name)
    setup = experiment.build(experiment.scenario(({"form": "compiled"},), overrides))
    simulator = Simulator(setup.diagram)
    ApplySimulatorConfig(setup.scenario.simulator, simulator)
    simulator.AdvanceTo(duration)
    context = simulator.get_context()
    return np.concatenate(
        [
            setup.plant.GetPositionsAndVelocities(setup.plant.GetMyContextFromRoot(context)),
            context.get_continuous_state_vector().CopyToVector(),
        ]
    )


@needs_numba
@pytest.mark.parametrize(
    ("name", "duration", "overrides"),
    [
        ("plexiglas", 0.1, ()),
        ("plexiglas", 0.02, NATURAL),
        ("redundancy", 0.02, ()),
        ("bar", 0.02, ()),
        ("limits", 0.02, ()),
        ("collision", 0.02, ()),
    ],
)
def test_closed_loop_is_the_same_compiled(monkeypatch, name, duration, overrides) -> None:
    fast = state_after(name, duration, *overrides)
    monkeypatch.setenv(SWITCH, "0")
    plain = state_after(name, duration, *overrides)
    np.testing.assert_allclose(fast, plain, rtol=1e-12, atol=1e-12)


@needs_numba
def test_listing_the_experiments_does_not_import_numba() -> None:
    code = (
        "import sys; from geoimp_drake.diagrams.experiments import catalogue;"
        "assert 'numba' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, env=os.environ)
