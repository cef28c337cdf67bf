"""The rollout of a contact: the sampled loop's own steps while it touches, and what is between."""

from dataclasses import replace

import numpy as np
import pytest

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.prediction.contact_rollout import along, contact_rollout
from geoimp_drake.laws.prediction.sampled_loop import SampledLoop

STEP, M, D, K, K_E, D_E = 1e-3, 9.0, 300.0, 700.0, 1e4, 40.0
NORMAL = np.array([0.0, 0.0, 0.0, 0.36, 0.48, 0.8])
LOOP = SampledLoop(
    np.eye(6) / 12.0,
    0.7 * np.eye(6),
    np.eye(6) / M,
    D * np.eye(6),
    K * np.eye(6),
    65.0 * np.eye(6),
    2025.0 * np.eye(6),
    STEP,
    environment=K_E * np.outer(NORMAL, NORMAL),
    environment_damping=D_E * np.outer(NORMAL, NORMAL),
)
VARIANTS = {
    "plain": {},
    "reference": {"load": "reference"},
    "plant": {"load": "plant"},
    "direct": {"is_direct": True},
    "late and filtered": {"load": "plant", "sense_late": 3, "filter_gain": 0.4},
    "rarely read": {"load": "plant", "read_every": 2, "sense_every": 3, "sense_late": 1},
    "only K": {"load": "plant", "mass_inverse": 0.0 * np.eye(6)},
}


def rolled(loop: SampledLoop, desired: np.ndarray) -> np.ndarray:
    force = np.full(len(desired), np.nan)
    compiled(contact_rollout)(along(loop, NORMAL), desired, force)
    return force


def resting(depth: float, steps: int) -> np.ndarray:
    return np.tile([depth, 0.0, 0.0], (steps, 1))


@pytest.mark.parametrize("variant", VARIANTS)
def test_in_contact_each_step_is_that_of_the_sampled_loop(variant: str) -> None:
    """From D at rest behind the wall, with deviations from equilibrium that the matrix moves on."""
    loop, depth = replace(LOOP, **VARIANTS[variant]), 0.06
    rest = K * depth / (K + K_E) if loop.mass_inverse.any() else depth
    step, count = loop.matrix()
    away, pressed = (depth - rest) * NORMAL, -K_E * rest * NORMAL
    still = np.zeros(6)
    late = [pressed] * loop.sense_late
    state = np.concatenate((away, still, away, still, away, still, pressed, pressed, *late))
    force, expected = rolled(loop, resting(depth, 60 * count)), []
    for _ in range(60):
        state = step @ state
        x, v = NORMAL @ state[:6], NORMAL @ state[6:12]
        expected.append(K_E * (rest + x) + D_E * v)
    held = int(np.argmin(np.append(expected, -1.0) > 0.0))  # until it lifts off
    assert held > 10
    np.testing.assert_allclose(force[count - 1 :: count][:held], expected[:held], rtol=1e-9)


def test_at_rest_impedance_and_wall_share_the_depth() -> None:
    force = rolled(replace(LOOP, load="plant"), resting(0.06, 5000))
    assert force[-1] == pytest.approx(K * K_E / (K + K_E) * 0.06, rel=1e-9)


def test_wall_pushes_and_never_pulls() -> None:
    """A D that leaves the wall takes the hand off it."""
    t = np.arange(4000) * STEP
    depth = 0.02 * np.sin(np.pi * t)
    desired = np.stack([depth, 0.02 * np.pi * np.cos(np.pi * t), -(np.pi**2) * depth], axis=1)
    force = rolled(replace(LOOP, load="plant"), desired)
    assert force.min() == 0.0
    assert force.max() > 5.0
    assert not force[(t > 1.3) & (t < 1.9)].any()


def test_free_hand_moves_with_d() -> None:
    """Nothing is felt until D is within a hundredth of a millimetre of the wall."""
    t = np.arange(3000) * STEP
    desired = np.stack([-0.1 + 0.03 * t**2, 0.06 * t, np.full_like(t, 0.06)], axis=1)
    force = rolled(replace(LOOP, load="plant"), desired)
    touch = np.flatnonzero(force)[0]
    assert desired[touch, 0] == pytest.approx(0.0, abs=5e-4)


def test_as_written_and_compiled_are_one() -> None:
    desired, force = resting(0.03, 300), np.zeros(300)
    loop = replace(LOOP, **VARIANTS["rarely read"])
    contact_rollout(along(loop, NORMAL), desired, force)
    np.testing.assert_allclose(force, rolled(loop, desired), rtol=1e-11)
