"""Meshes of a few triangles or tetrahedra, in memory, for contact that is cheap to compute."""

from dataclasses import dataclass

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import InMemoryMesh, Mesh

from geoimp_drake.typing import Array

__all__ = ["Polyhedra", "regular_polygon"]


@dataclass
class Polyhedra:
    """Triangles, or tetrahedra, with common vertices.

    Attributes:
        vertices: [m], shape (N, 3).
        elements: numbers of vertices, shape (M, 3), counterclockwise seen from outside; or (M, 4),
            the first three counterclockwise seen from the fourth.
    """

    vertices: Array
    elements: Array

    def triangles(self, name: str) -> Mesh:
        """Returns a surface for Drake; messages use its name."""
        lines = [f"v {row}" for row in _rows(self.vertices)]
        lines += [f"f {row}" for row in _rows(self.elements + 1)]
        return _in_memory(lines, f"{name}.obj")

    def tetrahedra(self, name: str) -> Mesh:
        """Returns a volume for Drake; messages use its name."""
        n = len(self.elements)
        lines = ["# vtk DataFile Version 3.0", name, "ASCII", "DATASET UNSTRUCTURED_GRID"]
        lines += [f"POINTS {len(self.vertices)} double", *_rows(self.vertices)]
        lines += [f"CELLS {n} {5 * n}", *(f"4 {row}" for row in _rows(self.elements))]
        return _in_memory([*lines, f"CELL_TYPES {n}", *["10"] * n], f"{name}.vtk")


def regular_polygon(n: int, radius: float, z: float) -> Array:
    """Returns its vertices [m], shape (n, 3), counterclockwise about z.

    The middle of its last side is on +x.
    """
    angle = 2 * np.pi / n * (np.arange(n) + 0.5)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(n, z)])


def _rows(table: Array) -> list[str]:
    return [" ".join(map(repr, row)) for row in table.tolist()]


def _in_memory(lines: list[str], file_name: str) -> Mesh:
    extension = file_name[file_name.rindex(".") :]
    file = MemoryFile("\n".join([*lines, ""]), extension, file_name)
    return Mesh(InMemoryMesh(mesh_file=file))
