"""A law whose first arguments stay does what it does with all of them, and takes no memory."""

from copy import deepcopy
from typing import NamedTuple

import numpy as np
import pytest
from allocations import allocations_of_laws

from geoimp_drake.compilation import compiled as module
from geoimp_drake.compilation.compiled import SWITCH, bound, compilable
from geoimp_drake.compilation.small_arrays import local, sized

pytestmark = pytest.mark.skipif(not module.is_available(), reason="numba is not installed")


class Gains(NamedTuple):
    A: np.ndarray
    cube: np.ndarray
    order: np.ndarray


def law(gains: Gains, factor: float, power: int, terms: tuple, x: np.ndarray, y: np.ndarray) -> int:
    flag, b = terms
    for i in range(len(y)):
        y[i] = factor * (gains.A[i] @ x) ** power + gains.cube[1, 0, i] + b[gains.order[i]]
    return 1 if flag else 0


def signals(rows: int) -> tuple:
    rng = np.random.default_rng(rows)
    gains = Gains(rng.normal(size=(rows, 3)), rng.normal(size=(2, 2, rows)), rng.permutation(rows))
    gains.cube.flags.writeable = False
    return gains, -1.5, 3, (True, rng.normal(size=rows)), rng.normal(size=3)


@pytest.mark.parametrize("rows", [2, 4])
@pytest.mark.parametrize("kept", range(1, 6))
def test_arguments_of_every_kind_may_stay(rows: int, kept: int) -> None:
    arguments, (expected, y) = signals(rows), np.zeros((2, rows))
    law(*arguments, expected)
    assert bound(law, *arguments[:kept])(*arguments[kept:], y) == 1
    np.testing.assert_allclose(y, expected, rtol=1e-14)


def test_a_flag_is_none_of_its_like() -> None:
    """The types of the arguments that stay are known to what is kept on disk, too."""
    gains, factor, power, (_, b), x = signals(2)
    for flag in (True, False, 1, 0):
        assert bound(law, gains, factor, power, (flag, b))(x, np.zeros(2)) == int(flag)


def test_what_an_array_holds_may_change_and_a_copy_has_its_own() -> None:
    *rest, x = signals(2)
    y = np.zeros(2)
    call = bound(law, *rest, x, y)
    x[:], expected = 7.0, np.zeros(2)
    law(*rest, x, expected)
    call()
    np.testing.assert_allclose(y, expected, rtol=1e-14)
    again = deepcopy({"call": call, "x": x, "y": y})
    again["x"][:] = 0.0
    y[:] = 0.0
    again["call"]()
    assert again["y"].any()
    assert not y.any()


def test_an_array_of_gaps_is_refused() -> None:
    with pytest.raises(ValueError, match="contiguous"):
        bound(law, np.zeros((4, 4))[:, 0])


def test_without_numba_it_is_the_law_itself(monkeypatch) -> None:
    monkeypatch.setenv(SWITCH, "0")
    arguments, (expected, y) = signals(2), np.zeros((2, 2))
    law(*arguments, expected)
    bound(law, *arguments)(y)
    np.testing.assert_array_equal(y, expected)


@compilable
def doubled_in_place(a: np.ndarray) -> None:
    for k in range(len(a)):
        a[k] *= 2.0


def with_local_arrays(x: np.ndarray, y: np.ndarray) -> None:
    total = sized(x, 3)
    for _ in range(3):
        a = local(total)
        doubled_in_place(a)
        total = sized(a, 3)
    y[:3] = total


def test_a_call_takes_no_memory() -> None:
    x, y = np.arange(3.0), np.zeros(3)
    call = bound(with_local_arrays, x, y)
    call()
    before = allocations_of_laws()
    for _ in range(10):
        call()
    assert allocations_of_laws() == before
    np.testing.assert_array_equal(y, 8.0 * x)
    bound(with_local_arrays, x)(y)
    assert allocations_of_laws() > before  # an array from Python is counted
