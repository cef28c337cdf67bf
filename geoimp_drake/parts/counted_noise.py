"""Noise that depends on a seed and a sample's number, not on earlier draws."""

import hashlib

import numpy as np

from geoimp_drake.typing import Array

__all__ = ["CountedNoise", "noise_key"]


def noise_key(seed: int, name: str) -> int:
    """Returns the seed of one of several sources of noise, different for each seed and name."""
    return int.from_bytes(hashlib.sha256(f"{seed} {name}".encode()).digest()[:16], "little")


class CountedNoise:
    """Draws standard normal numbers that are a function of the seed and a count.

    They are those of a new `Philox(key=seed, counter=[0, 0, 0, count])`. Constructing one for
    every sample is slow, so one generator is kept and its whole state is set before each draw.

    Args:
        seed: not negative, below 2¹²⁸.
    """

    def __init__(self, seed: int):
        self._generator = np.random.Generator(np.random.Philox(key=seed))
        self._new = self._generator.bit_generator.state

    def draw(self, count: int, size: int) -> Array:
        """Returns the numbers (size,) of a count below 2⁶⁴."""
        self._new["state"]["counter"] = (0, 0, 0, count)
        self._generator.bit_generator.state = self._new
        return self._generator.standard_normal(size)
