"""The arguments and the results of a task function."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from pydrake.systems.framework import Context

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.state import ArmState
from geoimp_drake.typing import Array
from geoimp_drake.validation import unknown_name

__all__ = ["Instant", "NoTask", "TaskFunction", "TaskValue", "joint_index"]


@dataclass
class Instant:
    """The arm at one instant, as a task function sees it.

    Two attributes are evaluated on first use: `arm`, its kinematics and dynamics, and
    `scratch`, a context of the control model's plant at its posture.
    """

    time: float  # [s]
    q: Array  # (n) joint positions [rad or m]
    v: Array  # (n) joint velocities
    start_posture: Array  # joint positions when the simulation was initialized (n) [rad or m]
    evaluate_arm: Callable[[], ArmState]
    position_scratch: Callable[[], Context]

    @cached_property
    def arm(self) -> ArmState:
        """Kinematics and dynamics of the arm."""
        return self.evaluate_arm()

    @cached_property
    def scratch(self) -> Context:
        """A context of the control model's plant at the arm's posture and velocity."""
        return self.position_scratch()


@dataclass(slots=True)
class TaskValue:
    """A task function and its derivatives at one instant; rates are along the arm's motion."""

    value: float  # w
    value_rate: float  # ẇ = ∂w/∂t + ∂w/∂q q̇
    gradient: Array  # ∂w/∂q (n)
    gradient_rate: Array  # d/dt ∂w/∂q (n), the explicit dependence on time included


class TaskFunction(Protocol):
    """A function w(t, q); it holds no state."""

    def evaluate(self, instant: Instant) -> TaskValue:
        """Returns w and its derivatives."""


class NoTask:
    """w = 0: the null-space motion is damped towards rest."""

    def evaluate(self, instant: Instant) -> TaskValue:
        """Returns zeros."""
        zero = np.zeros_like(instant.q)
        return TaskValue(0.0, 0.0, zero, zero)


def joint_index(model: ControlModel, name: str) -> int:
    """Returns the index of a joint in the vectors of the model.

    Raises:
        ConfigurationError: there is no such joint; the message lists the valid ones.
    """
    if name not in model.joint_names:
        raise unknown_name(name, "joint", model.joint_names)
    return model.joint_names.index(name)
