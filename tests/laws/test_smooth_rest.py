"""The smooth step: a fifth-order polynomial from rest to rest, with its derivatives."""

import numpy as np
import pytest

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.smooth_rest import smooth_step

DURATION = 2.5
STEP = np.polynomial.Polynomial([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])


@pytest.mark.parametrize("law", [smooth_step, compiled(smooth_step)])
def test_rates_are_the_derivatives_of_the_polynomial(law) -> None:
    for x in np.linspace(0.0, 1.0, 101):
        expected = [STEP.deriv(k)(x) / DURATION**k if k else STEP(x) for k in range(3)]
        np.testing.assert_allclose(law(x * DURATION, DURATION), expected, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize(("time", "s"), [(-1.0, 0.0), (0.0, 0.0), (DURATION, 1.0), (9.0, 1.0)])
def test_step_rests_at_both_ends_and_beyond(time: float, s: float) -> None:
    assert smooth_step(time, DURATION) == (s, 0.0, 0.0)
