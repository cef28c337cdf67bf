"""The configuration of a surface, and the three surfaces of the chapter's experiments."""

from dataclasses import dataclass, field

import numpy as np
from pydrake.multibody.tree import SpatialInertia

from geoimp_drake.diagrams.scene.surface_looks import APPEARANCES
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.typing import Array
from geoimp_drake.validation import choice, key, non_negative, positive

__all__ = [
    "DISK_RADIUS",
    "SURFACES",
    "SurfaceConfig",
    "cardboard",
    "disk_sides",
    "plexiglas",
    "stiff_plexiglas",
]

_MOST_SIDES = 360
DISK_RADIUS = 0.055  # [m]; the stiffnesses of SURFACES are calibrated for it


@dataclass
class SurfaceConfig:
    """A compliant layer on a plate on a compliant mount; the defaults are plexiglas.

    See instead: `geoimp_drake.diagrams.scene.press.press_test`, which measures what a disk feels.
    """

    name: str = "plexiglas"  # of the model instance
    size: np.ndarray = field(default_factory=lambda: np.array([0.4, 0.4, 0.04]))  # [m] x, y, z of S
    # [m] x, y of the plate's middle in S. Its mesh is cut along the diagonals of the front: a disk
    # beside them makes a quarter of the faces and costs half.
    centre: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.11]))
    layer_stiffness: float = 6e4  # k_h [N/m] under the whole disk
    relaxation_time: float = 0.005  # [s] damping over stiffness of the layer
    mount_stiffness: float = 12363.0  # [N/m] along every axis
    mount_damping: float = 156.0  # [Ns/m]
    mount_tilt_stiffness: float = 66.9  # [Nm/rad] about every axis
    mount_tilt_damping: float = 1.33  # [Nms/rad]
    plate_mass: float = 1.0  # [kg]
    friction: float = 0.3  # [-] Coulomb's μ, static and dynamic; give the disk the same
    resolution_hint: float = 0.05  # [m] edge length of the layer's mesh
    appearance: str = "sheet"  # one of APPEARANCES
    color: np.ndarray = field(default_factory=lambda: np.array([0.62, 0.84, 0.95, 0.35]))  # rgba
    stand: bool = True  # draw a column from the floor z = 0 to the mount

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        _check_array(key(name, "size"), self.size, 3, (1e-3, 10.0))
        _check_array(key(name, "centre"), self.centre, 2, (-10.0, 10.0))
        _check_array(key(name, "color"), self.color, 4, (0.0, 1.0))
        for part in _POSITIVE:
            positive(getattr(self, part), key(name, part))
        for part in _NON_NEGATIVE:
            non_negative(getattr(self, part), key(name, part))
        choice(self.appearance, key(name, "appearance"), APPEARANCES)

    def normal_stiffness(self) -> float:
        """Returns the stiffness of layer and mount in series [N/m]."""
        return 1.0 / (1.0 / self.layer_stiffness + 1.0 / self.mount_stiffness)

    def normal_damping(self) -> float:
        """Returns the damping of layer and mount in series, for slow motions [Ns/m]."""
        layer, mount = self.layer_stiffness, self.mount_stiffness
        d_layer, d_mount = self.relaxation_time * layer, self.mount_damping
        return self.normal_stiffness() ** 2 * (d_layer / layer**2 + d_mount / mount**2)

    def check_step(self, name: str, step: float) -> None:
        """Raises ConfigurationError if the mount diverges at a plant's time step h [s].

        A bushing is an explicit force: k h² + 2 d h has to be below 4 m.
        """
        moments = SpatialInertia.SolidBoxWithMass(self.plate_mass, *self.size)
        smallest = moments.CalcRotationalInertia().get_moments().min()
        for kind, k, d, m in (
            ("mount", self.mount_stiffness, self.mount_damping, self.plate_mass),
            ("mount_tilt", self.mount_tilt_stiffness, self.mount_tilt_damping, smallest),
        ):
            if not (load := k * step**2 + 2 * d * step) < 4 * m:
                raise ConfigurationError(
                    f"{key(name, kind)}_stiffness {k:g} with {key(name, kind)}_damping {d:g} "
                    f"diverges at a time step of {step:g} s: lower them, or raise "
                    f"{key(name, 'plate_mass')}, until k h² + 2 d h, now {load:.3g}, is below "
                    f"{4 * m:.3g}."
                )


_POSITIVE = (
    "layer_stiffness",
    "mount_stiffness",
    "mount_tilt_stiffness",
    "plate_mass",
    "resolution_hint",
)
_NON_NEGATIVE = ("relaxation_time", "mount_damping", "mount_tilt_damping", "friction")


def plexiglas() -> SurfaceConfig:
    """A sheet of 10⁴ N/m and 20 Nm/rad whose layer and mount both yield."""
    return SurfaceConfig()


def stiff_plexiglas() -> SurfaceConfig:
    """A sheet of 10⁴ N/m and 20 Nm/rad that yields almost only in its mount.

    The edge of a tilted disk sinks in less than into `plexiglas`, so it loads the wrist earlier.
    """
    return SurfaceConfig(
        name="plexiglas-stiff",
        layer_stiffness=1e6,
        mount_stiffness=10116.0,
        mount_damping=141.0,
        mount_tilt_stiffness=20.88,
        mount_tilt_damping=0.74,
    )


def cardboard() -> SurfaceConfig:
    """The side of a carton, 5000 N/m and 15 Nm/rad."""
    return SurfaceConfig(
        name="cardboard",
        layer_stiffness=4e4,
        mount_stiffness=5848.0,
        mount_damping=107.0,
        mount_tilt_stiffness=71.1,
        mount_tilt_damping=1.39,
        appearance="carton",
        color=np.array([0.76, 0.60, 0.42, 1.0]),
    )


SURFACES = {config.name: config for config in (plexiglas(), stiff_plexiglas(), cardboard())}


def disk_sides(edge: float, name: str, radius: float = DISK_RADIUS) -> int:
    """Returns the number of a disk's sides for contact, each at most `edge` long [m].

    Raises:
        ConfigurationError: there are far too many for a step's time; `name` is the edge's key.
    """
    positive(edge, name, "m")
    positive(radius, f"the radius at {name}", "m")
    if (sides := np.ceil(2 * np.pi * radius / edge)) > _MOST_SIDES:
        raise ConfigurationError(
            f"{name} is {edge:g} m: the disk would have {sides:g} sides, at most {_MOST_SIDES} "
            f"are computed. Give {2 * np.pi * radius / _MOST_SIDES:.2g} m or more."
        )
    return max(3, int(sides))


def _check_array(name: str, value: Array, n: int, bounds: tuple[float, float]) -> None:
    array = np.asarray(value, dtype=float)
    low, high = bounds
    if array.shape != (n,) or not np.all((array >= low) & (array <= high)):
        raise ConfigurationError(
            f"{name} is {array.tolist()}: give {n} numbers from {low:g} to {high:g}."
        )
