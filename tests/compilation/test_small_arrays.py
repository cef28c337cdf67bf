"""Small arrays do, compiled, what NumPy does with ordinary ones."""

import numpy as np
import pytest

from geoimp_drake.compilation import compiled as module
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.compilation.small_arrays import (
    identity_like,
    joined,
    matrix,
    sized,
    sized_like,
    stored,
    vector,
)

pytestmark = pytest.mark.skipif(not module.is_available(), reason="numba is not installed")

MIDDLE = slice(1, 3)


def arithmetic(a, b, A, B):
    a, b, A, B = sized(a, 3), sized(b, 3), sized(A, 3, 3), sized(B, 3, 4)
    return (
        a + b,
        A - A.T,
        2.0 * a,
        A * 2,
        a * b,
        B / 3.0,
        -B,
        a @ b,
        A @ b,
        a @ B,
        A @ B,
        B.T @ A,
        a.T,
    )


def places(a, b, A, B):
    a, A, B = sized(a, 3), sized(A, 3, 3), sized(B, 3, 4)
    return (a[0], a[-1], a[1:], a[MIDDLE], A[1], A[0, 2], B[:, 3], B[:, :3], B[1:, 1:3], B.T[3, 1])


def made(a, b, A, B):
    x, y, z = a[0], a[1], a[2]
    row = (x, y, z)
    small = sized(A, 3, 3)
    return (
        vector(x, 1, z),
        matrix(row, (y, x, z), row),
        joined(sized(a, 3), vector(x, y)),
        identity_like(small),
        identity_like(A),
        stored(small)[:2],
        stored(a),
        sized_like(A, small) @ sized(b, 3),
        sized_like(A, B),
        sized(small, 3, 3),
    )


def in_branches(a, b, A, B):
    c = sized(a, 3)
    if a[0] > b[0]:
        c = -sized(b, 3)
    for _ in range(3):
        c = c + sized(a, 3)
    return (c,)


def written(a, b, A, B):
    motion, rows = np.zeros(19), np.zeros((3, 6))
    motion[4:7] = sized(a, 3)
    motion[:3] = 2.0 * sized(b, 3)
    rows[1, :3] = sized(a, 3)
    rows[:3, 2:6] = sized(B, 3, 4)
    rows[:, 1][MIDDLE] = sized(a, 3)[1:]
    return motion, rows


@pytest.mark.parametrize("law", [arithmetic, places, made, in_branches, written])
def test_compiled_it_is_what_numpy_does(law) -> None:
    rng = np.random.default_rng(0)
    # A view whose entries do not follow each other in memory among them.
    signals = (
        rng.normal(size=3),
        rng.normal(size=6)[::2],
        rng.normal(size=(3, 3)),
        rng.normal(size=(3, 4)),
    )
    plain, fast = law(*signals), compiled(law)(*signals)
    assert len(plain) == len(fast)
    for expected, ours in zip(plain, fast, strict=True):
        assert np.shape(ours) == np.shape(expected)
        np.testing.assert_allclose(ours, expected, rtol=1e-15, atol=1e-15)


def products(A, B, a, b):
    A, B, a, b = sized(A, 6, 11), sized(B, 11, 7), sized(a, 11), sized(b, 70)
    return A @ B, A @ A.T, (A @ B).T @ A, a @ B, A @ a, b @ b


def test_long_products_are_what_numpy_does() -> None:
    rng = np.random.default_rng(1)
    signals = [rng.normal(size=shape) for shape in ((6, 11), (11, 7), (11,), (70,))]
    for expected, ours in zip(products(*signals), compiled(products)(*signals), strict=True):
        assert np.shape(ours) == np.shape(expected)
        np.testing.assert_allclose(ours, expected, rtol=1e-13, atol=1e-13)


def test_long_products_sum_as_short_ones_do(monkeypatch) -> None:
    """To the bit, so that where the loop begins does not show."""
    from geoimp_drake.compilation import small_array_operations as compiled_arrays

    signals = [np.random.default_rng(k).normal(size=(6, 7)) for k in range(2)]

    def in_a_loop(A, B):
        return sized(A, 6, 7) @ sized(B, 6, 7).T

    def written_out(A, B):
        return sized(A, 6, 7) @ sized(B, 6, 7).T

    found = []
    for law, limit in ((in_a_loop, 0), (written_out, 10_000)):
        monkeypatch.setattr(compiled_arrays, "_WRITTEN_OUT", limit)
        found.append(compiled(law)(*signals))
    np.testing.assert_array_equal(*found)


def test_a_compiled_small_array_is_a_copy() -> None:
    def law(a):
        before = sized(a, 3)
        a[0] = 5.0
        return before[0]

    assert compiled(law)(np.zeros(3)) == 0.0


def sum_of_unequal(a, A):
    return sized(a, 3) + sized(A[0], 2)


def product_of_unequal(a, A):
    return sized(A, 3, 3) @ sized(a, 2)


def sum_with_an_array(a, A):
    return sized(a, 3) + a


def too_long_for_its_place(a, A):
    a[:2] = sized(A[0], 3)


def place_without_end(a, A):
    a[1:] = sized(A[0], 2)


def place_from_behind(a, A):
    a[-2:3] = sized(A[0], 2)


def size_not_a_constant(a, A):
    return sized(a, len(a))


def of_other_dimensions(a, A):
    return sized(A, 9)


@pytest.mark.parametrize(
    "law",
    [
        sum_of_unequal,
        product_of_unequal,
        sum_with_an_array,
        too_long_for_its_place,
        place_without_end,
        place_from_behind,
        size_not_a_constant,
        of_other_dimensions,
    ],
)
def test_what_does_not_fit_is_refused_when_it_is_compiled(law) -> None:
    from numba.core.errors import NumbaError

    with pytest.raises(NumbaError):
        compiled(law)(np.zeros(3), np.zeros((3, 3)))


def test_integers_are_not_taken_for_floats() -> None:
    from numba.core.errors import NumbaError

    def law(a):
        return sized(a, 3)

    with pytest.raises(NumbaError):
        compiled(law)(np.arange(3))
