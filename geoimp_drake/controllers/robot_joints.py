"""Readings and torques in a robot's own order of joints."""

from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.typing import Array

__all__ = ["RobotJoints"]


class RobotJoints:
    """An arm's joints as its robot numbers them.

    Args:
        model: the arm.
        names: of its joints in the robot's order; by default that from base to hand.

    Attributes:
        names: the order.
        effort_limits: in that order (n) [Nm or N].

    Raises:
        ConfigurationError: the names are not those of the arm's joints.
    """

    def __init__(self, model: ControlModel, names: Sequence[str] | None = None):
        n, own = model.num_joints, model.joint_names
        self.names = tuple(own if names is None else names)
        if sorted(self.names) != sorted(own):
            raise ConfigurationError(
                f"The robot's joints are {', '.join(self.names) or 'none'}; the arm has "
                f"{', '.join(own)}. Give each of these once, in the robot's order."
            )
        self._model, self._place = model, np.array([own.index(name) for name in self.names])
        # Where they stand in a reading, and which actuators drive them.
        order = model.state_order
        self._q, self._v = _places(order[self._place]), _places(order[n + self._place])
        self._actuators = np.argsort(model.actuation_order)[self._place]
        self.effort_limits = model.effort_limits[self._place]

    def reading(self, q: Array, v: Array, written: Array | None = None) -> Array:
        """Returns [q; v] in the plant's order (2n).

        Args:
            q: joint positions in the robot's order (n) [rad, m].
            v: joint velocities, likewise (n) [rad/s, m/s].
            written: where to write, a new array by default (2n).

        Raises:
            SignalError: there are not as many as the arm has joints.
        """
        n = len(self.names)
        if len(q) != n or len(v) != n:
            raise SignalError(
                f"There are {len(q)} joint positions and {len(v)} velocities; the arm has "
                f"{n} joints: {', '.join(self.names)}."
            )
        reading = np.empty(2 * n) if written is None else written
        reading[self._q] = q
        reading[self._v] = v
        return reading

    def split(self, reading: Array) -> tuple[Array, Array]:
        """Returns positions and velocities (n) of [q; v] (2n); the inverse of `reading`."""
        return reading[self._q].copy(), reading[self._v].copy()

    def torques(self, actuation: Array) -> Array:
        """Returns torques in the order of the plant's actuators (n) in the robot's order."""
        torques: Array = actuation[self._actuators]
        return torques

    def actuation(self, torques: Array) -> Array:
        """Returns torques in the robot's order (n) in that of the actuators; undoes `torques`."""
        actuation = np.empty(len(self.names))
        actuation[self._actuators] = torques
        return actuation

    def from_base(self, values: Array) -> Array:
        """Returns values in the robot's order (n) in the order from base to hand."""
        ordered = np.empty(len(self.names))
        ordered[self._place] = values
        return ordered

    def pose(self, q: Array) -> RigidTransform:
        """Returns X_WE at joint positions in the robot's order (n) [rad, m]."""
        plant = self._model.plant
        context = plant.CreateDefaultContext()
        plant.SetPositions(context, self.from_base(q))
        return self._model.end_effector.CalcPoseInWorld(context)


def _places(indices: Array) -> Array | slice:
    """Returns a slice if the indices are consecutive, which takes less time, or the indices."""
    first, n = int(indices[0]), len(indices)
    return slice(first, first + n) if np.array_equal(indices, first + np.arange(n)) else indices
