"""The filter of a live target as written and compiled."""

import numpy as np
import pytest

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.target_filter import target_filter
from geoimp_drake.rotations import quaternion


@pytest.mark.parametrize("speeds", [(np.inf, np.inf), (0.1, 0.2)])
def test_both_forms_are_the_same(speeds) -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        motion, target = rng.standard_normal(19), rng.standard_normal(7)
        motion[:4], target[:4] = (quaternion.normalized(x[:4]) for x in (motion, target))
        rates = np.full((2, 19), np.nan)
        for law, rate in zip((target_filter, compiled(target_filter)), rates, strict=True):
            law(motion, target, 5.0, *speeds, rate)
        np.testing.assert_allclose(*rates, rtol=1e-12, atol=1e-12)
