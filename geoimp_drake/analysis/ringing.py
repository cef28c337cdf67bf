"""The surfaces and dampings that make a sampled loop ring, by the eigenvalues of its step.

A wall is modelled in two ways. Drake's plants evaluate it at the end of a step; a real wall acts
all through the step. Drake's way hides ringing that a robot shows. The results here hold for both.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from geoimp_drake.laws.prediction.sampled_loop import SampledLoop
from geoimp_drake.typing import Array
from geoimp_drake.validation import non_negative, positive

__all__ = [
    "critical_damping",
    "delayed",
    "largest_stiffness",
    "least_stable",
    "on_surface",
    "on_wall",
    "rings",
]

# Rounding may bring an eigenvalue of one this far above one.
_TOLERANCE = 1e-7
# Stiffnesses that are tried, in N/m or Nm/rad.
_STIFFNESSES = np.geomspace(1.0, 1e9, 19)
# Dampings that are tried, as factors of the given one.
_FACTORS = np.geomspace(1e-3, 1e3, 25)
_BISECTIONS = 12
_LONGEST = 0.1  # delay; each sample of it is six states more [s]


def on_wall(loop: SampledLoop, environment: Array) -> tuple[SampledLoop, SampledLoop]:
    """Returns the loop in contact, with a wall as in Drake's plants and with a real one.

    Args:
        loop: of a hand.
        environment: K_e (6×6) at E in W.
    """
    wall = replace(loop, environment=environment)
    return replace(wall, acts_within=False), replace(wall, acts_within=True)


def on_surface(loop: SampledLoop, stiffness: float) -> SampledLoop:
    """Returns a loop on an undamped surface, which lies in X, Y of W if there was none.

    Args:
        loop: of a hand.
        stiffness: along the surface's normal [N/m].

    Raises:
        ConfigurationError: the stiffness is not positive.
    """
    positive(stiffness, "surface_stiffness", "N/m")
    size = np.linalg.norm(loop.environment, 2)
    shape = loop.environment / size if size else np.diag(np.eye(6)[-1])
    return replace(loop, environment=stiffness * shape, environment_damping=0.0 * shape)


def delayed(loop: SampledLoop, delay: float) -> SampledLoop:
    """Returns a loop whose wrench is late by a delay, rounded to a whole number of samples.

    Args:
        loop: of a hand.
        delay: [s].

    Raises:
        ConfigurationError: the delay is negative, or longer than 0.1 s.
    """
    non_negative(delay, "delay", "s")
    non_negative(_LONGEST - delay, f"{_LONGEST:g} s less delay", "s")
    samples = round(delay / (loop.step * loop.sense_every))
    return replace(loop, sense_late=loop.sense_late + samples)


def rings(loop: SampledLoop) -> bool:
    """Returns whether a motion in contact grows, with either kind of wall."""
    return any(wall.growth() > 1.0 + _TOLERANCE for wall in on_wall(loop, loop.environment))


def least_stable(loop: SampledLoop) -> SampledLoop:
    """Returns the loop with the kind of wall on which motions grow faster."""
    return max(on_wall(loop, loop.environment), key=lambda wall: wall.growth())


def largest_stiffness(loop: SampledLoop, direction: Array) -> float:
    """Returns the smallest stiffness at which a wall rings [N/m or Nm/rad]; infinite if none does.

    A wall with damping rings at a larger stiffness.

    Args:
        loop: of a hand.
        direction: along which the wall resists, [rotation; translation] (6,), a unit vector.
    """
    resists = np.outer(direction, direction)
    undamped = replace(loop, environment_damping=0.0 * resists)
    return _first(lambda k: rings(replace(undamped, environment=k * resists)), _STIFFNESSES)


def critical_damping(loop: SampledLoop, part: slice, *, either: bool = True) -> tuple[float, float]:
    """Returns the smallest and largest factor of a damping between which the loop does not ring.

    They are nan if it rings with each factor that was tried.

    Args:
        loop: in contact.
        part: of the damping, rotation or translation.
        either: whether ringing on either kind of wall counts, or only on the loop's own.
    """
    at = _FACTORS[np.argmin(np.abs(np.log(_FACTORS)))]

    def with_factor(factor: float) -> bool:
        damping = loop.damping.copy()
        damping[part, part] *= factor
        damped = replace(loop, damping=damping)
        return rings(damped) if either else damped.growth() > 1.0 + _TOLERANCE

    stable = [factor for factor in _FACTORS if not with_factor(factor)]
    if not stable:
        return np.nan, np.nan
    start = min(stable, key=lambda factor: abs(np.log(factor / at)))
    lower = _first(with_factor, _FACTORS[start >= _FACTORS][::-1])
    upper = _first(with_factor, _FACTORS[start <= _FACTORS])
    return (0.0 if np.isinf(lower) else lower), upper


def _first(fails: Callable[[float], bool], values: Iterable[float]) -> float:
    """Returns the value of a sequence at which something begins to fail; infinite if none does."""
    before = None
    for value in values:
        if not fails(value):
            before = value
            continue
        if before is None:
            return float(value)
        for _ in range(_BISECTIONS):
            middle = np.sqrt(before * value)
            before, value = (before, middle) if fails(middle) else (middle, value)
        return float(np.sqrt(before * value))
    return np.inf
