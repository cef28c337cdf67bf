"""Maps of ringing: over mass and damping, and over damping and the wall."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure

from geoimp_drake.analysis.report import TRANSLATION, Analysis
from geoimp_drake.analysis.ringing import least_stable, on_surface
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.prediction.modes import modes_of
from geoimp_drake.laws.prediction.sampled_loop import SampledLoop
from geoimp_drake.simulation.style import figure_style, make_logarithmic
from geoimp_drake.typing import Array

__all__ = ["damping_ratio", "ringing_figure"]

_FINENESS = 15
_FACTORS = np.geomspace(0.02, 20.0, _FINENESS)
_WALLS = np.geomspace(1e2, 1e7, _FINENESS)
# Damping ratios at which shades change; below zero the hand rings.
_LEVELS = (-1.0, 0.0, 0.1, 0.3, 0.7, 1.01)


def ringing_figure(loop: SampledLoop, analysis: Analysis, title: str) -> Figure:
    """Returns a figure of two maps along the first direction, with the given gains marked in each.

    Args:
        loop: of a hand.
        analysis: of the same.
        title: of the figure.

    Raises:
        ConfigurationError: nothing is compliant along this direction.
    """
    name, first = next(iter(analysis.directions.items()))
    along, wall, damping = np.array(first.vector), first.wall, first.damping
    softness = float(along @ loop.mass_inverse @ along)
    if softness <= 0.0:
        raise ConfigurationError(
            f"{title}: the hand is not compliant along {name}; give axes that have it."
        )
    mass = 1.0 / softness

    def with_gains(m: float, d: float, k: float) -> float:
        """The damping ratio with m times the mass and d times the damping of translation."""
        M, D = loop.mass_inverse.copy(), loop.damping.copy()
        M[TRANSLATION, TRANSLATION] /= m
        D[TRANSLATION, TRANSLATION] *= d
        wall = on_surface(replace(loop, environment=np.outer(along, along)), k)
        return damping_ratio(replace(wall, mass_inverse=M, damping=D))

    with figure_style():
        figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
        drawn = _draw(left, lambda m, d: with_gains(m, d, wall), _FACTORS, mass, damping)
        left.set(
            xlabel="mass M along the direction [kg]",
            ylabel="damping D [Ns/m]",
            title=f"on a wall of {wall:.3g} N/m",
        )
        left.plot(mass, damping, "o", color="k", label="as given")
        _draw(right, lambda k, d: with_gains(1.0, d, k), _WALLS, 1.0, damping)
        right.set(
            xlabel="stiffness of the wall [N/m]",
            title=f"with M = {mass:.3g} kg",
            ylabel="damping D [Ns/m]",
        )
        right.plot(wall, damping, "o", color="k", label="as given")
        left.legend(loc="lower right")
        bar = figure.colorbar(
            drawn, ax=(left, right), label="damping ratio of what oscillates longest [-]"
        )
        bar.set_ticks([0.0, 0.1, 0.3, 0.7, 1.0])
        figure.suptitle(f"{title}: what rings along {name}, and how it is damped")
    return figure


def damping_ratio(loop: SampledLoop) -> float:
    """Returns the damping ratio of the longest oscillation, one for none; below zero it rings."""
    modes = modes_of(least_stable(loop).poles())
    return next((mode.damping_ratio for mode in modes if mode.ringing > 0.0), 1.0)


def _draw(
    axes: Axes, ratio: Callable[[float, float], float], x: Array, x_unit: float, d_unit: float
) -> ContourSet:
    """Draws one map; returns the artist for a colour bar."""
    values = [[ratio(a, d) for a in x] for d in _FACTORS]
    drawn = axes.contourf(
        x * x_unit, _FACTORS * d_unit, np.clip(values, -0.99, 1.0), levels=_LEVELS, cmap="cividis"
    )
    axes.contour(x * x_unit, _FACTORS * d_unit, values, levels=[0.0], colors="#D55E00")
    make_logarithmic(axes, "x", "y")
    return drawn
