"""The base of the controllers of one arm that are called by hand: its state, gains and outputs."""

from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.robot_joints import RobotJoints
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.part import Part
from geoimp_drake.parts.part_loop import PartLoop
from geoimp_drake.parts.passivity import Passivity
from geoimp_drake.systems.frame_motion import frame_motion_at_rest
from geoimp_drake.typing import Array

__all__ = ["ArmLoop"]


class ArmLoop:
    """A whole controller of one arm, called by hand at each tick of a robot.

    Args:
        part: the controller.
        name: of the loop, in messages.
        model: the arm.
        joints: the joints' names in the robot's order; by default that from base to hand.
        period: of a tick [s].

    Attributes:
        model: the arm.
        joints: the order of q, v and of returned values.
        period: of a tick, unless it is told another [s].

    Raises:
        ConfigurationError: `joints` are not those of the arm.
    """

    def __init__(
        self,
        part: Part,
        name: str,
        model: ControlModel,
        joints: Sequence[str] | None,
        period: float,
    ):
        self.model, self.period = model, period
        self.joints = RobotJoints(model, joints)
        self._loop = PartLoop(part, name)
        self._gains: dict[str, Array] = {}

    @property
    def state(self) -> Array:
        """All that the loop remembers, one array; copy it to save it, write to it to restore it."""
        return self._loop.state

    def output(self, name: str) -> Array:
        """Returns an output of `make_impedance_controller` at the last tick.

        Args:
            name: such as `compliant_motion`; `actuation` is in the order of the plant's actuators.

        Raises:
            ConfigurationError: there is no such output.
        """
        return self._loop.output(name)

    def pose(self, q: Array) -> RigidTransform:
        """Returns X_WE at joint positions in the robot's order (n) [rad, m]."""
        return self.joints.pose(q)

    def change(self, stiffness: Array | None = None, damping: Array | None = None) -> None:
        """Requests other gains from the next tick on; `passivity.gains` lets them through.

        Args:
            stiffness: K (6, 6), [angular; linear]; None leaves it as it is.
            damping: D (6, 6); the same.

        Raises:
            ConfigurationError: the configuration has no `passivity.gains`.
            SignalError: a matrix is of another size.
        """
        if not self._gains:
            raise ConfigurationError(
                "change() is for a configuration with passivity.gains: give "
                "PassivityConfig(gains=TankConfig())."
            )
        gains = {"stiffness": stiffness, "damping": damping}
        self._loop.feed({name: np.ravel(K) for name, K in gains.items() if K is not None})

    def _let_change(self, impedance: Impedance, passivity: Passivity) -> None:
        """Begins with the configured gains, if `passivity` lets others through."""
        if passivity.gains is not None:
            K, D = impedance.changing_gains.matrices()
            self._gains = {"stiffness": K, "damping": D}

    def _start(self, q: Array, v: Array, wrench: Array | None, desired: Array | None) -> None:
        """Starts the part; None is a wrench of zero, and D at rest on E."""
        self._loop.reset(
            {
                "estimated_state": self.joints.reading(q, v),
                "wrench": np.zeros(6) if wrench is None else wrench,
                "desired_motion": frame_motion_at_rest(self.pose(q))
                if desired is None
                else desired,
                **self._gains,
            }
        )
