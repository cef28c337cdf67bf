"""The analysis of a controller before it runs: its modes, and the walls on which it rings."""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from geoimp_drake.analysis.ringing import critical_damping, largest_stiffness, least_stable, rings
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.prediction.modes import Mode, modes_of, second_order_poles
from geoimp_drake.laws.prediction.sampled_loop import SampledLoop
from geoimp_drake.typing import Array

__all__ = [
    "TRANSLATION",
    "WALL",
    "Analysis",
    "Direction",
    "analyze",
    "directions_of",
    "loop_of",
    "ringing_warning",
]

ROTATION, TRANSLATION = slice(0, 3), slice(3, 6)
# Stiffness of an unknown wall: a sheet of plexiglas.
WALL = {"rotation": 20.0, "translation": 1e4}  # [Nm/rad, N/m]
_PARTS = {"rotation": ROTATION, "translation": TRANSLATION}
# A surface with less than this share of its stiffness along a direction does not count there.
_LEAST = 0.1
# The number of modes of the sampled loop that are printed: the others are faster.
_SHOWN = 8


@dataclass(frozen=True)
class Direction:
    """The analysis along one direction.

    Attributes:
        vector: [rotation; translation] in W (6), a unit vector.
        unit: of its stiffness.
        wall: stiffness of the wall [N/m or Nm/rad].
        largest_surface_stiffness: above it a wall rings; infinite if none does.
        damping: D along it [Ns/m or Nms/rad].
        critical_damping: the range in which the hand does not ring on the wall; nan if there is
            none.
    """

    vector: list[float]
    unit: str
    wall: float
    largest_surface_stiffness: float
    damping: float
    critical_damping: tuple[float, float]


@dataclass(frozen=True)
class Analysis:
    """The answer of `analyze`.

    Attributes:
        rings: whether the hand rings on the surface, or in free air if there is none.
        growth: factor by which its fastest-growing motion grows in a second.
        ringing_frequency: of the least stable mode that oscillates [Hz].
        impedance: modes of M, D, K.
        inner_loop: modes of K_P, K_D.
        contact: modes of the sampled loop, slowest first.
        directions: along the principal axes of the stiffness, and the surface's normal.
    """

    rings: bool
    growth: float
    ringing_frequency: float
    impedance: list[Mode]
    inner_loop: list[Mode]
    contact: list[Mode]
    directions: dict[str, Direction]

    def as_dict(self) -> dict[str, Any]:
        """Returns it for JSON; infinite and undefined numbers become null."""
        by_direction = {name: asdict(value) for name, value in self.directions.items()}
        told = {
            "rings": self.rings,
            "growth_in_a_second": self.growth,
            "ringing_frequency": self.ringing_frequency,
            "modes": {
                name: [asdict(mode) for mode in getattr(self, name)]
                for name in ("impedance", "inner_loop", "contact")
            },
            "largest_surface_stiffness": {
                name: value["largest_surface_stiffness"] for name, value in by_direction.items()
            },
            "critical_damping": {
                name: value["critical_damping"] for name, value in by_direction.items()
            },
            "directions": by_direction,
        }
        finite: dict[str, Any] = _finite(told)
        return finite

    def __str__(self) -> str:
        """Returns tables for a terminal."""
        surface = "rings" if self.rings else "does not ring"
        rows = [
            f"on its surface the hand {surface} (least stable at {self.ringing_frequency:.3g} Hz)."
        ]
        rows.append(
            f"\n{'direction':16}{'wall':>12}{'rings from':>14}{'D':>10}{'D that does not ring':>26}"
        )
        for name, at in self.directions.items():
            low, high = at.critical_damping
            between = "none" if np.isnan(low) else f"{low:.3g} to {high:.3g}"
            rows.append(
                f"{name:16}{at.wall:12.3g}{at.largest_surface_stiffness:14.3g}{at.damping:10.4g}"
                f"{between:>26}  {at.unit}"
            )
        rows.append(f"\n{'modes':16}{'[Hz]':>12}{'damping ratio':>16}{'time constant [s]':>20}")
        for name in ("impedance", "inner_loop", "contact"):
            rows.extend(
                f"{name.replace('_', ' '):16}{mode.frequency / (2 * np.pi):12.4g}"
                f"{mode.damping_ratio:16.3f}{mode.time_constant:20.4g}"
                for mode in _distinct(getattr(self, name))[:_SHOWN]
            )
        return "\n".join(rows)


def analyze(loop: SampledLoop) -> Analysis:
    """Returns the analysis of a loop; its environment is the surface, zero for none."""
    worst = least_stable(loop)
    poles = worst.poles()
    oscillating = [mode for mode in modes_of(poles) if mode.ringing > 0.0]
    frequency = oscillating[0].ringing / (2.0 * np.pi) if oscillating else 0.0
    return Analysis(
        rings(loop),
        float(np.exp(poles.real.max())),
        frequency,
        modes_of(_poles_of(loop.mass_inverse, loop.damping, loop.stiffness)),
        modes_of(second_order_poles(np.eye(6), loop.K_D, loop.K_P)),
        modes_of(poles),
        {name: _direction(loop, name, vector) for name, vector in directions_of(loop).items()},
    )


def loop_of(setup: Any) -> SampledLoop:
    """Returns the loop of a set-up.

    Raises:
        ConfigurationError: it has none.
    """
    loop: SampledLoop | None = setup.loop
    if loop is None:
        raise ConfigurationError(
            f"{setup.scenario.experiment}: no wrench closes a loop through the torques under "
            f"scheme '{setup.scenario.scheme}' with these settings, so there is nothing to "
            f"analyze. Give scheme inner-loop, or direct with inertia desired."
        )
    return loop


def directions_of(loop: SampledLoop) -> dict[str, Array]:
    """Returns unit vectors (6) by name: the surface's normal, and the stiffness' principal axes."""
    found = {}
    if loop.environment.any():
        found["normal"] = np.linalg.eigh(loop.environment)[1][:, -1]
    for name in ("translation", "rotation"):
        part = _PARTS[name]
        _, axes = np.linalg.eigh(loop.stiffness[part, part])
        for k, axis in enumerate(axes.T):
            vector = np.zeros(6)
            vector[part] = axis * np.sign(axis[np.argmax(np.abs(axis))])
            found[f"{name} {k + 1}"] = vector
    return found


def ringing_warning(loop: SampledLoop) -> str:
    """Returns a line on a loop that rings on its surface alone, empty if it does not.

    Motion that grows in free air, too, comes from the sensor, which warns when it is made.
    """
    if not rings(loop) or rings(_free(loop)):
        return ""
    poles = least_stable(loop).poles()
    mode = modes_of(poles)[0]
    return (
        f"on its surface the hand rings at {mode.ringing / (2 * np.pi):.3g} Hz and grows by "
        f"{100 * (np.exp(poles[0].real * loop.step) - 1):.2g} % in a step of {1e3 * loop.step:g} "
        f"ms. `geoimp analyze` shows which dampings and surfaces do not."
    )


def _direction(loop: SampledLoop, name: str, vector: Array) -> Direction:
    is_rotation = bool(vector[ROTATION].any())
    part = "rotation" if is_rotation else "translation"
    wall = float(vector @ loop.environment @ vector)
    if wall <= _LEAST * np.linalg.norm(loop.environment, 2):
        wall = WALL[part]
    D = float(vector @ loop.damping @ vector)
    pressed = replace(_free(loop), environment=wall * np.outer(vector, vector))
    low, high = critical_damping(pressed, _PARTS[part])
    return Direction(
        vector.tolist(),
        "Nm/rad, Nms/rad" if is_rotation else "N/m, Ns/m",
        wall,
        largest_stiffness(loop, vector),
        D,
        (low * D, high * D),
    )


def _free(loop: SampledLoop) -> SampledLoop:
    none = 0.0 * loop.environment
    return replace(loop, environment=none, environment_damping=none)


def _poles_of(M_inv: Array, D: Array, K: Array) -> Array:
    """Returns the poles of the compliant directions."""
    moves = np.any(M_inv, axis=1)
    axes = np.ix_(moves, moves)
    return second_order_poles(M_inv[axes], D[axes], K[axes])


def _distinct(modes: list[Mode]) -> list[Mode]:
    """Returns modes without those that equal the one before."""
    kept: list[Mode] = []
    for mode in modes:
        look = tuple(f"{value:.3g}" for value in asdict(mode).values())
        if not kept or look != tuple(f"{value:.3g}" for value in asdict(kept[-1]).values()):
            kept.append(mode)
    return kept


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(inner) for inner in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
