"""The sampled loop: where a tool's load or held readings make it unstable, by arithmetic."""

from dataclasses import replace

import numpy as np
import pytest

from geoimp_drake.laws.prediction.sampled_loop import SampledLoop

T, K_D, K_P = 1e-3, 65.0, 2250.0
IDENTITY = np.eye(6)


def loop(share: float, mass: float = 1e6, *, follows: bool, gain: float = K_D) -> SampledLoop:
    """A tool of 1 kg and 1 kg m² that is a share of what moves, under an impedance of that mass."""
    return SampledLoop(
        share * IDENTITY,
        IDENTITY,
        IDENTITY / mass,
        20.0 * mass * IDENTITY,
        100.0 * mass * IDENTITY,
        gain * IDENTITY,
        K_P * IDENTITY,
        T,
        "reference" if follows else "none",
    )


@pytest.mark.parametrize("follows", [True, False])
@pytest.mark.parametrize("gain", [40.0, 65.0, 130.0])
def test_largest_share_is_that_of_the_printed_bound(follows: bool, gain: float) -> None:
    bound = gain / (gain + K_P * T)
    assert loop(bound - 0.001, follows=follows, gain=gain).growth() <= 1.0
    assert loop(bound + 0.001, follows=follows, gain=gain).growth() > 1.0


def test_impedance_lighter_than_the_tool_is_unstable_at_any_share() -> None:
    """The factor (Λ⁻¹ − M⁻¹) M_t is the share less the ratio of the masses, beyond −1."""
    assert loop(0.3, mass=1.0, follows=False).growth() < 1.0
    assert loop(0.3, mass=0.7, follows=False).growth() > 1.0
    assert loop(0.3, mass=0.7, follows=True).growth() < 1.0


def test_held_readings_are_unstable_from_when_a_loop_without_tool_swings() -> None:
    free = loop(0.0, follows=True)
    assert replace(free, read_every=15).growth() < 1.0  # the controllers' limit, 1/K_D
    assert replace(free, read_every=22).growth() > 1.0


def swing(stiffness: float, *, acts_within: bool) -> np.ndarray:
    """What a step does to [z; v_z] of a hand of 5 kg on a wall along z."""
    wall = np.zeros((6, 6))
    wall[5, 5] = stiffness
    hand = replace(loop(0.2, follows=True), environment=wall, acts_within=acts_within)
    x, v = hand.hand_step()
    return np.array([[x[5, 5], x[5, 11]], [v[5, 5], v[5, 11]]])


@pytest.mark.parametrize("stiffness", [0.0, 2e4, 5e8])
def test_wall_within_the_step_is_that_of_a_mass_on_a_spring(stiffness: float) -> None:
    omega = np.sqrt(0.2 * stiffness)
    expected = [
        [np.cos(omega * T), T * np.sinc(omega * T / np.pi)],
        [-omega * np.sin(omega * T), np.cos(omega * T)],
    ]
    np.testing.assert_allclose(swing(stiffness, acts_within=True), expected, rtol=1e-9, atol=1e-9)


def test_wall_at_the_end_of_the_step_damps() -> None:
    """det = 1/(1 + ω²T²): Drake's wall hides ringing."""
    step = swing(2e4, acts_within=False)
    assert np.linalg.det(step) == pytest.approx(1.0 / (1.0 + 0.2 * 2e4 * T * T), rel=1e-12)


@pytest.mark.parametrize("late", [5e-3, 20e-3])
def test_late_wrench_rings_from_where_the_delayed_equation_does(late: float) -> None:
    """A heavy hand that is its own C: M ẍ + D ẋ + K x + K_e x(t − τ) = 0 has s = jω."""
    M, D, K, step = 9.0, 400.0, 700.0, 5e-4
    # The phase, with K_e = D ω / sin ωτ, is right where M ω² − K = D ω / tan ωτ.
    grid = np.linspace(0.01, 0.999 * np.pi, 200001) / late
    k = np.argmax(M * grid**2 - K > D * grid / np.tan(grid * late))
    critical = D * grid[k] / np.sin(grid[k] * late)
    wall = np.zeros((6, 6))

    def growth(stiffness: float) -> float:
        wall[5, 5] = stiffness
        return SampledLoop(
            0.0 * IDENTITY,
            0.0 * IDENTITY,
            IDENTITY / M,
            D * IDENTITY,
            K * IDENTITY,
            0.0 * IDENTITY,
            0.0 * IDENTITY,
            step,
            "plant",
            is_direct=True,
            environment=wall,
            sense_late=round(late / step),
        ).growth()

    assert growth(0.98 * critical) < 1.0
    assert growth(1.02 * critical) > 1.0
