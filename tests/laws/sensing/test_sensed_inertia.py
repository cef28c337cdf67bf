"""What a wrist sensor carries of what moves."""

import numpy as np
import pytest

from geoimp_drake.laws.sensing.sensed_inertia import SensedInertia


def test_share_is_that_of_the_part_beyond_whatever_the_axes() -> None:
    """Two bodies that move together: share m_2/(m_1 + m_2) in translation, less in rotation."""
    whole = np.diag([3.0, 4.0, 5.0, 8.0, 8.0, 8.0])
    tool = np.diag([1.0, 1.0, 1.0, 6.0, 6.0, 6.0])
    turn, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    R = np.kron(np.eye(2), turn)
    seen = SensedInertia(R @ np.linalg.inv(whole) @ R.T, R @ tool @ R.T, turn, 1e-3)
    assert seen.share() == pytest.approx(0.75)
