"""Noise by count: the numbers of a generator constructed for the sample, whatever came before."""

import copy

import numpy as np
import pytest

from geoimp_drake.parts.counted_noise import CountedNoise

COUNTS = [*range(1, 300), 2**31, 2**32, 2**40, 2**53]


def constructed(seed: int, count: int, size: int) -> np.ndarray:
    bits = np.random.Philox(key=seed, counter=[0, 0, 0, count])
    return np.random.Generator(bits).standard_normal(size)


@pytest.mark.parametrize("seed", [0, 1, 7, 2**32, 2**63, 2**64 + 5, 2**128 - 1])
def test_numbers_are_those_of_a_new_generator(seed: int) -> None:
    noise = CountedNoise(seed)
    for count in COUNTS:
        np.testing.assert_array_equal(noise.draw(count, 6), constructed(seed, count, 6))


def test_a_draw_leaves_nothing_for_the_next() -> None:
    noise = CountedNoise(3)
    for size in (1, 2, 3, 5, 50):  # whatever is left of the generator's block of four
        noise.draw(9, size)
        np.testing.assert_array_equal(noise.draw(4, 6), constructed(3, 4, 6))


def test_a_copy_draws_by_itself() -> None:
    noise = CountedNoise(3)
    other = copy.deepcopy(noise)
    assert other._generator.bit_generator is not noise._generator.bit_generator
    for count in range(1, 20):
        np.testing.assert_array_equal(other.draw(count, 6), noise.draw(count, 6))
