"""Meshes of a peg and of a block with a blind hole, in memory.

P is at the centre of the peg's tip, z_P out of the tip. H is at the centre of the hole's mouth, z_H
out of the hole.

The time of a step goes into pairs of elements whose bounding boxes overlap, and into a contact
point for each pair that meets. So the peg has few tetrahedra, and the hole few triangles. Nearly
each triangle is a mesh of its own, since a leaf of Drake's tree holds three elements. Three sides
of a hole would fill a fat box. Where a triangle is wider than its side of the hole, the rest of it
is inside the wood.
"""

from itertools import pairwise

import numpy as np
from pydrake.geometry import Mesh

from geoimp_drake.diagrams.scene.peg_hole_config import PegHoleConfig
from geoimp_drake.diagrams.scene.polyhedra import Polyhedra, regular_polygon
from geoimp_drake.typing import Array

__all__ = ["block_shape", "hole_facets", "peg_volume"]

# Each corner of the peg's back is this much farther back than the one before [m]. Drake's tree
# halves the elements along the longest axis of their common box, the peg's. With the stagger, that
# halves them by their azimuth as well.
_STAGGER = 1e-6
_SHOWN_SIDES = 64  # of the hole that is drawn and gives the mass


def peg_volume(config: PegHoleConfig) -> Mesh:
    """Returns the peg as tetrahedra, in P.

    All of them share the one inner vertex, in the peg's middle, where Drake's pressure is the
    modulus. That vertex is far from the tip and near the sides. So landing on the bottom is softer
    than pressing on the edge of the mouth.
    """
    n = config.peg_sides
    tip = regular_polygon(n, config.peg_circumradius(), 0.0)
    back = tip - [0.0, 0.0, config.peg_length] - np.outer(np.arange(n), [0.0, 0.0, _STAGGER])
    inner = np.array([[0.0, 0.0, -config.peg_length / 2]])
    skin = np.vstack([_fan(n, 0), _band(n), _fan(n, n)[:, ::-1]])
    apex = np.full((len(skin), 1), 2 * n)
    # Drake expects the first three counterclockwise, seen from the fourth.
    volume = Polyhedra(np.vstack([tip, back, inner]), np.hstack([skin[:, ::-1], apex]))
    return volume.tetrahedra("peg")


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
    facets["bottom"] = Polyhedra(
        regular_polygon(3, 2 * radius, -config.hole_depth), np.array([[0, 1, 2]])
    )
    facets |= {f"wall{i}": _wall(config, i) for i in range(config.hole_sides)}
    return {name: facet.triangles(name) for name, facet in facets.items()}


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
    return Polyhedra(vertices, np.vstack(faces)).triangles("block")


def _fan(n: int, first: int) -> Array:
    """Triangles of a polygon seen from +z, with vertices numbered from `first`."""
    i = np.arange(1, n - 1)
    return first + np.column_stack([np.zeros_like(i), i, i + 1])


def _band(n: int) -> Array:
    """Triangles between a polygon and the next one behind it, seen from outside."""
    i = np.arange(n)
    j = (i + 1) % n
    return np.vstack([np.column_stack([i, n + i, j]), np.column_stack([j, n + i, n + j])])


def _mouth(n: int, radius: float, width: float) -> Polyhedra:
    """A square with a hole of n sides, seen from +z: the triangles quarter by quarter."""
    square = regular_polygon(4, width / np.sqrt(2), 0.0)
    triangles = []
    for corner in range(4):
        first = corner * n // 4
        ring = [(first + k) % n for k in range(n // 4 + 1)]
        triangles += [[a, n + corner, b] for a, b in pairwise(ring)]
        triangles.append([n + corner, n + (corner + 1) % 4, ring[-1]])
    return Polyhedra(np.vstack([regular_polygon(n, radius, 0.0), square]), np.array(triangles))


def _part(whole: Polyhedra, elements: Array) -> Polyhedra:
    """Some of the elements, with only their own vertices."""
    used, numbers = np.unique(elements, return_inverse=True)
    return Polyhedra(whole.vertices[used], numbers.reshape(elements.shape))


def _wall(config: PegHoleConfig, i: int) -> Polyhedra:
    """One side of the wall, seen from the hole's axis: it is tangent to the hole."""
    angle = 2 * np.pi / config.hole_sides * i
    out = np.array([np.cos(angle), np.sin(angle), 0.0])
    along = config.facet_half_width() * np.array([-np.sin(angle), np.cos(angle), 0.0])
    middle = config.hole_diameter / 2 * out
    point = middle - [0.0, 0.0, config.block_length]
    return Polyhedra(np.array([middle - along, middle + along, point]), np.array([[0, 1, 2]]))
