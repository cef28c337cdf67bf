"""Sizes, materials and meshes of a peg and its hole."""

from dataclasses import dataclass, field

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.typing import Array
from geoimp_drake.validation import finite_vector, key, non_negative, positive

__all__ = ["PegHoleConfig"]

_LENGTHS = (
    "peg_diameter",
    "peg_length",
    "hole_diameter",
    "hole_depth",
    "block_width",
    "block_length",
)


@dataclass
class PegHoleConfig:
    """A steel peg and a wooden block with a blind hole; the defaults are the chapter's.

    In contact both are polygonal. The hole's polygon is circumscribed: its inscribed circle is the
    hole. The peg's polygon has corners as far outside the peg's circle as its sides are inside, as
    a ratio. So the play is that of the diameters within the bounds of `play_bounds`, whatever the
    direction and the roll. The time of a step grows with the sides, the peg's most of all.

    The modulus is a compromise. A peg that lands flat on the bottom at 9 mm/s gives 33 N for an
    instant. With ten times the modulus it gives 60 N. But the sharp edge of the mouth holds a peg
    that overlaps it by 0.3 mm with 40 N only after 2 mm. With ten times the modulus it does so
    after 1 mm.
    """

    peg_diameter: float = 0.017  # [m]
    peg_length: float = 0.08  # [m]
    hole_diameter: float = 0.018  # [m]
    hole_depth: float = 0.07  # [m]
    block_width: float = 0.06  # [m] side of its square front
    block_length: float = 0.09  # [m] along the hole
    peg_density: float = 7850.0  # [kg/m³] steel
    block_density: float = 600.0  # [kg/m³] wood
    friction: float = 0.3  # [-] Coulomb's μ of both, static and dynamic
    modulus: float = 5e8  # [Pa] hydroelastic, of the peg; the block is rigid
    relaxation_time: float = 0.002  # [s] damping with the SAP approximation
    dissipation: float = 10.0  # [s/m] damping with the other approximations, of Hunt and Crossley
    peg_sides: int = 24
    hole_sides: int = 16  # a multiple of 4
    peg_color: Array = field(default_factory=lambda: np.array([0.72, 0.74, 0.78, 1.0]))  # rgba
    block_color: Array = field(default_factory=lambda: np.array([0.72, 0.53, 0.33, 0.35]))  # rgba

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        for part in (*_LENGTHS, "peg_density", "block_density", "modulus"):
            positive(getattr(self, part), key(name, part))
        for part in ("friction", "relaxation_time", "dissipation"):
            non_negative(getattr(self, part), key(name, part))
        for part in ("peg_color", "block_color"):
            _check_color(getattr(self, part), key(name, part))
        _check_sides(self.peg_sides, key(name, "peg_sides"), 1)
        _check_sides(self.hole_sides, key(name, "hole_sides"), 4)
        self._check_fit(name)
        self._check_block(name)

    def play_bounds(self) -> tuple[float, float]:
        """Returns bounds of the play [m] of a peg parallel to the hole.

        The play is how far the peg can move sideways from the hole's axis. No direction and no
        roll of the peg has less than the first number or more than the second.
        """
        return (
            self.hole_diameter / 2 - self.peg_circumradius(),
            (self.hole_diameter / 2 - self.peg_circumradius() * np.cos(np.pi / self.peg_sides))
            / np.cos(np.pi / self.hole_sides),
        )

    def peg_circumradius(self) -> float:
        """Returns the distance of the peg's corners from its axis [m]."""
        return float(self.peg_diameter / 2 / np.sqrt(np.cos(np.pi / self.peg_sides)))

    def facet_half_width(self) -> float:
        """Returns half the width, at the mouth, of the triangles that make the hole's wall [m].

        At the hole's bottom each triangle is as wide as its side of the hole; it runs to a point at
        the block's back.
        """
        side = self.hole_diameter / 2 * np.tan(np.pi / self.hole_sides)
        return float(side * self.block_length / (self.block_length - self.hole_depth))

    def _check_fit(self, name: str) -> None:
        if self.peg_diameter >= self.hole_diameter:
            raise ConfigurationError(
                f"{key(name, 'peg_diameter')} {1e3 * self.peg_diameter:g} mm does not fit into "
                f"{key(name, 'hole_diameter')} {1e3 * self.hole_diameter:g} mm; make it smaller."
            )
        if (play := self.play_bounds()[0]) <= 0:
            raise ConfigurationError(
                f"a peg of {self.peg_sides} sides is {-1e6 * play:.3g} µm too wide for the hole at "
                f"its corners; raise {key(name, 'peg_sides')}, or widen the hole."
            )
        if self.peg_length <= self.peg_diameter:
            raise ConfigurationError(
                f"{key(name, 'peg_length')} {1e3 * self.peg_length:g} mm must exceed "
                f"{key(name, 'peg_diameter')} {1e3 * self.peg_diameter:g} mm."
            )

    def _check_block(self, name: str) -> None:
        if self.block_length <= self.hole_depth:
            raise ConfigurationError(
                f"{key(name, 'block_length')} {1e3 * self.block_length:g} mm must exceed "
                f"{key(name, 'hole_depth')} {1e3 * self.hole_depth:g} mm: the hole has a bottom."
            )
        bottom = 2 * self.hole_diameter / 2 / np.cos(np.pi / self.hole_sides)
        wall = np.hypot(self.hole_diameter / 2, self.facet_half_width())
        if self.block_width / 2 < max(bottom, wall):
            raise ConfigurationError(
                f"{key(name, 'block_width')} {1e3 * self.block_width:g} mm leaves too little wood "
                f"round the hole: give {2e3 * max(bottom, wall):.4g} mm or more, or raise "
                f"{key(name, 'block_length')} or {key(name, 'hole_sides')}."
            )


def _check_sides(value: int, name: str, multiple: int) -> None:
    if not (8 <= value <= 128 and value % multiple == 0):
        kind = f"a multiple of {multiple}" if multiple > 1 else "a whole number"
        raise ConfigurationError(f"{name} is {value}; give {kind} from 8 to 128.")


def _check_color(value: Array, name: str) -> None:
    color = finite_vector(value, name, 4)
    if not np.all((color >= 0) & (color <= 1)):
        raise ConfigurationError(f"{name} is {color.tolist()}; give rgba, each from 0 to 1.")
