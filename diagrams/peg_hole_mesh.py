"""Meshes of a peg and of a block with a blind hole, in memory.

P is at the centre of the peg's tip, z_P out of the tip; H is at the centre of the hole's mouth, z_H
out of the hole.

The time of a step goes into pairs of elements whose bounding boxes overlap, and into a contact
point for each pair that meets. So the peg has few tetrahedra, and the hole few triangles, nearly
each a mesh of its own: a leaf of Drake's tree holds three, and three sides of a hole fill a fat
box. Where a triangle is wider than what it stands for, the rest of it is inside the wood.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import InMemoryMesh, Mesh

from geoimp_drake.diagrams.peg_hole_config import PegHoleConfig
from geoimp_drake.typing import Array

__all__ = ["block_shape", "hole_facets", "peg_volume"]

# The corners of the peg's back are this much farther back, one after the other [m]. Drake's tree
# halves the elements along their common box's longest axis, the peg's: with the stagger, that
# halves them by their azimuth as well.
_STAGGER = 1e-6
_SHOWN_SIDES = 64  # of the hole that is drawn and weighed


@dataclass
class _Polyhedra:
    """Vertices (N×3) and the vertices' numbers of triangles (M×3) or tetrahedra (M×4)."""

    vertices: Array
    elements: Array


def peg_volume(config: PegHoleConfig) -> Mesh:
    """Returns the peg as tetrahedra, in P.

    All of them share the one inner vertex, the peg's middle, where Drake lets the pressure be the
    modulus. Far from the tip and near the sides, it makes landing on the bottom softer than what
    the edge of the mouth presses upon.
    """
    n = config.peg_sides
    tip = _ring(n, config.peg_circumradius(), 0.0)
    back = tip - [0.0, 0.0, config.peg_length] - np.outer(np.arange(n), [0.0, 0.0, _STAGGER])
    inner = np.array([[0.0, 0.0, -config.peg_length / 2]])
    skin = np.vstack([_fan(n, 0), _band(n), _fan(n, n)[:, ::-1]])
    apex = np.full((len(skin), 1), 2 * n)
    # Drake wants the first three counterclockwise as the fourth sees them.
    volume = _Polyhedra(np.vstack([tip, back, inner]), np.hstack([skin[:, ::-1], apex]))
    return _in_memory(_vtk_text(volume), ".vtk")


def hole_facets(config: PegHoleConfig) -> dict[str, Mesh]:
    """Returns the surfaces of the block that a peg can touch, in H, by name.

    The mouth in four parts, the bottom, and each side of the wall: only the front and the hole.
    """
    radius = config.hole_diameter / 2 / np.cos(np.pi / config.hole_sides)
    mouth = _mouth(config.hole_sides, radius, config.block_width)
    facets = {
        f"mouth{i}": _part(mouth, elements)
        for i, elements in enumerate(np.split(mouth.elements, 4))
    }
    facets["bottom"] = _Polyhedra(_ring(3, 2 * radius, -config.hole_depth), np.array([[0, 1, 2]]))
    facets |= {f"wall{i}": _wall(config, i) for i in range(config.hole_sides)}
    return {name: _in_memory(_obj_text(facet), ".obj") for name, facet in facets.items()}


def block_shape(config: PegHoleConfig) -> Mesh:
    """Returns the whole block as a closed surface, its hole nearly round, in H."""
    n = _SHOWN_SIDES
    mouth = _mouth(n, config.hole_diameter / 2, config.block_width)
    bottom = mouth.vertices[:n] - [0.0, 0.0, config.hole_depth]
    back = mouth.vertices[n:] - [0.0, 0.0, config.block_length]
    vertices = np.vstack([mouth.vertices[:n], bottom, mouth.vertices[n:], back])
    front = np.where(mouth.elements < n, mouth.elements, mouth.elements + n)
    square = 2 * n
    faces = [
        front,
        _band(n)[:, ::-1],
        _fan(n, n),
        square + _band(4),
        square + _fan(4, 4)[:, ::-1],
    ]
    return _in_memory(_obj_text(_Polyhedra(vertices, np.vstack(faces))), ".obj")


def _ring(n: int, radius: float, z: float) -> Array:
    """Vertices of a regular polygon, counterclockwise; the middle of its last side is on +x."""
    angle = 2 * np.pi / n * (np.arange(n) + 0.5)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(n, z)])


def _fan(n: int, first: int) -> Array:
    """Triangles of a polygon seen from +z, its vertices numbered from `first`."""
    i = np.arange(1, n - 1)
    return first + np.column_stack([np.zeros_like(i), i, i + 1])


def _band(n: int) -> Array:
    """Triangles between a polygon and the next one behind it, seen from outside."""
    i = np.arange(n)
    j = (i + 1) % n
    return np.vstack([np.column_stack([i, n + i, j]), np.column_stack([j, n + i, n + j])])


def _mouth(n: int, radius: float, width: float) -> _Polyhedra:
    """A square with a hole of n sides, seen from +z: a quarter of the triangles after another."""
    square = _ring(4, width / np.sqrt(2), 0.0)
    triangles = []
    for corner in range(4):
        first = corner * n // 4
        ring = [(first + k) % n for k in range(n // 4 + 1)]
        triangles += [[a, n + corner, b] for a, b in pairwise(ring)]
        triangles.append([n + corner, n + (corner + 1) % 4, ring[-1]])
    return _Polyhedra(np.vstack([_ring(n, radius, 0.0), square]), np.array(triangles))


def _part(whole: _Polyhedra, elements: Array) -> _Polyhedra:
    """Some of the elements, with no vertices but theirs."""
    used, numbers = np.unique(elements, return_inverse=True)
    return _Polyhedra(whole.vertices[used], numbers.reshape(elements.shape))


def _wall(config: PegHoleConfig, i: int) -> _Polyhedra:
    """One side of the wall, seen from the hole's axis: it is tangent to the hole."""
    angle = 2 * np.pi / config.hole_sides * i
    out = np.array([np.cos(angle), np.sin(angle), 0.0])
    along = config.facet_half_width() * np.array([-np.sin(angle), np.cos(angle), 0.0])
    middle = config.hole_diameter / 2 * out
    point = middle - [0.0, 0.0, config.block_length]
    return _Polyhedra(np.array([middle - along, middle + along, point]), np.array([[0, 1, 2]]))


def _vtk_text(mesh: _Polyhedra) -> str:
    n = len(mesh.elements)
    lines = ["# vtk DataFile Version 3.0", "peg", "ASCII", "DATASET UNSTRUCTURED_GRID"]
    lines += [f"POINTS {len(mesh.vertices)} double", *_rows(mesh.vertices)]
    lines += [f"CELLS {n} {5 * n}", *(f"4 {row}" for row in _rows(mesh.elements))]
    return "\n".join([*lines, f"CELL_TYPES {n}", *["10"] * n, ""])


def _obj_text(mesh: _Polyhedra) -> str:
    lines = [f"v {row}" for row in _rows(mesh.vertices)]
    return "\n".join([*lines, *(f"f {row}" for row in _rows(mesh.elements + 1)), ""])


def _rows(table: Array) -> list[str]:
    return [" ".join(map(repr, row)) for row in table.tolist()]


def _in_memory(text: str, extension: str) -> Mesh:
    file = MemoryFile(text, extension, f"peg_hole{extension}")
    return Mesh(InMemoryMesh(mesh_file=file))
