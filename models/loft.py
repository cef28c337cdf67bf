"""Castings as meshes: a surface lofted through rounded cross-sections, written as an OBJ file."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from geoimp_drake.typing import Array

__all__ = ["loft"]

# A section lies in the plane z = `height`: (height, half width in x, half width in y, centre x, y).
Section = tuple[float, float, float, float, float]

_SIDES = 32


def loft(sections: Sequence[Section], squareness: float = 4.0) -> str:
    """Returns the OBJ text of the closed surface through `sections`, bottom to top.

    Each section is a superellipse |x/a|ⁿ + |y/b|ⁿ = 1 with n = `squareness`: 2 is an ellipse, 4 a
    well rounded rectangle. The sides are shaded smoothly round the section, flat along the loft.
    """
    rings = [_ring(section, squareness) for section in sections]
    writer = _Writer()
    for lower, upper in pairwise(rings):
        writer.add_band(lower, upper)
    writer.add_cap(rings[0][::-1], np.array([0.0, 0.0, -1.0]))
    writer.add_cap(rings[-1], np.array([0.0, 0.0, 1.0]))
    return writer.text()


def _ring(section: Section, squareness: float) -> Array:
    """Returns the points of a section, counter-clockwise about +z, one row each."""
    height, a, b, x, y = section
    angle = 2 * np.pi * np.arange(_SIDES) / _SIDES
    c, s = np.cos(angle), np.sin(angle)
    round_off = 2 / squareness
    return np.column_stack(
        [
            x + a * np.sign(c) * np.abs(c) ** round_off,
            y + b * np.sign(s) * np.abs(s) ** round_off,
            np.full(_SIDES, height),
        ]
    )


class _Writer:
    """Collects vertices, normals and faces of an OBJ file."""

    def __init__(self) -> None:
        self._points: list[Array] = []
        self._normals: list[Array] = []
        self._faces: list[tuple[int, ...]] = []

    def add_band(self, lower: Array, upper: Array) -> None:
        """Adds the quadrilaterals between two rings, with normals averaged round the ring."""
        flat = _normals(lower, upper)
        smooth = flat + np.roll(flat, 1, axis=0)
        smooth /= np.linalg.norm(smooth, axis=1, keepdims=True)
        first = self._add(np.vstack([lower, upper]), np.vstack([smooth, smooth]))
        for i in range(_SIDES):
            j = (i + 1) % _SIDES
            self._faces.append((first + i, first + j, first + _SIDES + j, first + _SIDES + i))

    def add_cap(self, ring: Array, normal: Array) -> None:
        """Closes the loft with the polygon `ring`, counter-clockwise about `normal`."""
        first = self._add(ring, np.tile(normal, (_SIDES, 1)))
        self._faces.extend((first, first + i, first + i + 1) for i in range(1, _SIDES - 1))

    def text(self) -> str:
        """Returns the file's text; indices count from one."""
        lines = ["# Written by `python -m geoimp_drake.models.generate`."]
        lines += [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in self._points]
        lines += [f"vn {x:.4f} {y:.4f} {z:.4f}" for x, y, z in self._normals]
        lines += ["f " + " ".join(f"{i}//{i}" for i in face) for face in self._faces]
        return "\n".join(lines).replace("-0.00000 ", "0.00000 ") + "\n"

    def _add(self, points: Array, normals: Array) -> int:
        first = len(self._points) + 1
        self._points.extend(points)
        self._normals.extend(normals)
        return first


def _normals(lower: Array, upper: Array) -> Array:
    """Returns the outward unit normals of the quadrilaterals between two rings."""
    along = np.roll(lower, -1, axis=0) - lower + np.roll(upper, -1, axis=0) - upper
    rise = upper - lower + np.roll(upper, -1, axis=0) - np.roll(lower, -1, axis=0)
    # The cross product, written out.
    normals = along[:, [1, 2, 0]] * rise[:, [2, 0, 1]] - along[:, [2, 0, 1]] * rise[:, [1, 2, 0]]
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)
