"""Linear equations, eliminated when compiled, against LAPACK."""

import numpy as np
import pytest

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.compilation.small_arrays import sized
from geoimp_drake.laws.dynamics.linear_equations import inverse, solution


def of_arrays(A, b):
    return solution(A, b), inverse(A @ A.T)


def of_small_arrays(A, b):
    M = sized(A, 6, 6)
    return solution(M, sized(b, 6)), inverse(M @ M.T)


def solved(A, b):
    return solution(A, b)


def inverted(A):
    return inverse(A)


@pytest.mark.parametrize("law", [of_arrays, of_small_arrays])
@pytest.mark.parametrize("seed", range(5))
def test_they_are_those_of_lapack(law, seed: int) -> None:
    rng = np.random.default_rng(seed)
    A, b = rng.normal(size=(6, 6)), rng.normal(size=6)
    A[0, 0] = A[3, 3] = 0.0  # rows must be exchanged
    before = A.copy(), b.copy()
    x, X = compiled(law)(A, b)
    np.testing.assert_allclose(x, np.linalg.solve(A, b), rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(X, np.linalg.inv(A @ A.T), rtol=1e-8)
    np.testing.assert_array_equal(A, before[0])
    np.testing.assert_array_equal(b, before[1])


def test_rows_that_must_be_exchanged_are() -> None:
    A, b = np.array([[1e-20, 1.0], [1.0, 1.0]]), np.array([1.0, 2.0])
    np.testing.assert_allclose(compiled(solved)(A, b), [1.0, 1.0], rtol=1e-15)


@pytest.mark.parametrize("unit", [1.0, 1e3, 1e6])
def test_inverse_of_an_inertia_does_not_mind_units(unit: float) -> None:
    rng = np.random.default_rng(0)
    A = rng.normal(size=(7, 7))
    B, scale = A @ A.T + np.eye(7), np.diag([unit, 1, 1, 1, unit, 1, 1])
    ours = compiled(inverted)(scale @ B @ scale)
    np.testing.assert_allclose(scale @ ours @ scale, np.linalg.inv(B), rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("form", [lambda law: law, compiled])
def test_a_singular_matrix_is_refused(form) -> None:
    A = np.ones((3, 3))
    with pytest.raises(np.linalg.LinAlgError):
        form(solved)(A, np.ones(3))
    with pytest.raises(np.linalg.LinAlgError):
        form(inverted)(np.zeros((3, 3)))
