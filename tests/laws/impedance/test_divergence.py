"""A state of C has diverged as soon as one of its entries has."""

import numpy as np
import pytest

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.impedance.compliant_motion import has_diverged


@pytest.mark.parametrize("form", [lambda law: law, compiled])
@pytest.mark.parametrize("value", [2e6, -2e6, np.inf, np.nan])
def test_one_entry_is_enough(form, value: float) -> None:
    law = form(has_diverged)
    assert not law(np.full(13, 9e5))
    for k in range(13):
        state = np.zeros(13)
        state[k] = value
        assert law(state)
