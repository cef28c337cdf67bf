"""The sampled loop through a tool's inertial load: where it is stable, by arithmetic."""

import numpy as np
import pytest

from geoimp_drake.laws.sensing.sensed_inertia import SampledLoop, SensedInertia

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
        follows,
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
    assert free.growth(read_every=15) < 1.0  # the controllers' limit, 1/K_D
    assert free.growth(read_every=22) > 1.0


def test_share_is_that_of_the_part_beyond_whatever_the_axes() -> None:
    """Two bodies that move together: share m_2/(m_1 + m_2) in translation, less in rotation."""
    whole = np.diag([3.0, 4.0, 5.0, 8.0, 8.0, 8.0])
    tool = np.diag([1.0, 1.0, 1.0, 6.0, 6.0, 6.0])
    turn, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    R = np.kron(np.eye(2), turn)
    seen = SensedInertia(R @ np.linalg.inv(whole) @ R.T, R @ tool @ R.T, turn, T)
    assert seen.share() == pytest.approx(0.75)
