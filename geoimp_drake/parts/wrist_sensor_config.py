"""A wrist sensor's errors, load and mounting."""

from dataclasses import dataclass, field

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.tree import BodyIndex

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.sensing.sensed_inertia import SensedInertia
from geoimp_drake.typing import Array
from geoimp_drake.validation import (
    LARGEST_SEED,
    UNBOUNDED,
    choice,
    finite_array,
    finite_vector,
    key,
    non_negative,
    positive,
    whole_number,
)

__all__ = ["SensorMounting", "ToolLoad", "WristSensor", "WristSensorConfig"]

_MOST_LATE = 1000  # delayed samples


@dataclass
class WristSensorConfig:
    """Sampling, errors and range of a wrist sensor; the default is ideal, read every 1 ms."""

    period: float = 1e-3  # [s]
    # Beyond these the reading is clipped, and reported.
    force_range: float = field(default=np.inf, metadata=UNBOUNDED)  # [N]
    moment_range: float = field(default=np.inf, metadata=UNBOUNDED)  # [Nm]
    force_resolution: float = 0.0  # quantisation step, zero for none [N]
    moment_resolution: float = 0.0  # [Nm]
    force_noise: float = 0.0  # standard deviation of a sample [N]
    moment_noise: float = 0.0  # [Nm]
    bias: Array = field(default_factory=lambda: np.zeros(6))  # [moment; force] in S
    filter_cutoff: float = 0.0  # of a first-order low-pass, zero for none [Hz]
    delay: float = 0.0  # age of a reading when it arrives, whole periods [s]
    # Whose motion gives the inertial load to remove: plant, reference; or none. What is left of it
    # can make the loop unstable, see `sensed_inertia`.
    inertial_load: str = "plant"
    seed: int = 0  # of the noise, with the name of the sensor's joint

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        positive(self.period, key(name, "period"), "s")
        for part in ("force_range", "moment_range"):
            if (largest := getattr(self, part)) != np.inf:
                positive(largest, key(name, part), "(.inf for none)")
        for part in (
            "force_resolution",
            "moment_resolution",
            "force_noise",
            "moment_noise",
            "filter_cutoff",
        ):
            non_negative(getattr(self, part), key(name, part))
        self._check_delay(key(name, "delay"))
        whole_number(self.seed, key(name, "seed"), 0, LARGEST_SEED)
        finite_vector(self.bias, key(name, "bias"), 6)
        choice(self.inertial_load, key(name, "inertial_load"), ("none", "plant", "reference"))

    @property
    def late_samples(self) -> int:
        """By how many samples a reading is late."""
        return round(self.delay / self.period)

    def _check_delay(self, name: str) -> None:
        non_negative(self.delay, name, "s")
        samples = self.delay / self.period
        if samples > _MOST_LATE or abs(samples - round(samples)) > 1e-6:
            raise ConfigurationError(
                f"{name} is {self.delay:g} s; give a multiple of the sensor's period, "
                f"{self.period:g} s, of {_MOST_LATE} periods at most."
            )


@dataclass
class ToolLoad:
    """The tool's load on a sensor, which is removed from its reading."""

    mass: float = 0.0  # [kg]
    centre_of_mass: Array = field(default_factory=lambda: np.zeros(3))  # p_SC in S [m]
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))  # about C, in S [kg m²]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        non_negative(self.mass, key(name, "mass"), "kg")
        finite_vector(self.centre_of_mass, key(name, "centre_of_mass"), 3)
        finite_array(self.inertia, key(name, "inertia"), (3, 3))


@dataclass(frozen=True)
class SensorMounting:
    """Where the sensor is mounted in its plant.

    Frames: S the weld joint's frame on its child body; T the tool, the body on the joint's far
    side; E the end effector.
    """

    joint: int  # its place among the plant's joints, in whose order the reaction forces are
    tool_body: BodyIndex
    X_TS: RigidTransform
    X_TE: RigidTransform
    gravity: Array  # in W (3) [m/s²]
    sign: float = 1.0  # −1 if the tool is the joint's parent: a reaction acts on the child
    path: Array | None = None  # to the tool, see `kinematic_tree.path_to`; None takes `body_poses`
    num_states: int = 0  # of the plant, if there is a path
    joint_name: str = ""  # of the weld, with its model instance's; empty: `joint` stands for it
    end_effector: str = ""  # the name of E, with its model instance's; empty: not known


@dataclass(frozen=True)
class WristSensor:
    """One sensor: its mounting, its tool and its configuration."""

    mounting: SensorMounting
    tool: ToolLoad
    config: WristSensorConfig
    initial_wrench: Array | None = None  # h until the first sample (6), zero unless given [Nm, N]
    name: str = ""  # in warnings; that of the system if empty
    inertia: SensedInertia | None = None  # None: not known, and not checked
