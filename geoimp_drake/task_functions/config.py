"""Task functions as plain dataclasses, for scenario files."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.task_functions.joint_limits import JointLimitDistance
from geoimp_drake.task_functions.joint_target import JointTarget
from geoimp_drake.task_functions.manipulability import Manipulability
from geoimp_drake.task_functions.plane_distance import PlaneDistance
from geoimp_drake.task_functions.posture import Posture
from geoimp_drake.task_functions.task_function import NoTask, TaskFunction
from geoimp_drake.task_functions.weighted_sum import WeightedSum
from geoimp_drake.typing import Array
from geoimp_drake.validation import choice, key

__all__ = ["KINDS", "TaskConfig", "TermConfig"]


@dataclass
class TermConfig:
    """One task function, chosen by `kind`; the fields of other kinds are not used.

    none: w = 0. joint-target, posture: descend them. manipulability, joint-limits, plane-distance:
    climb them.
    """

    kind: str = "none"
    weight: float = 1.0  # factor of w
    joints: list[str] = field(default_factory=list)  # names; joint-limits: all if none is given
    target: Array = field(default_factory=lambda: np.zeros(1))  # of joint-target, one per joint
    initial: Array | None = None  # of joint-target; the posture at the start if not given
    start: float = 0.0  # of joint-target [s]
    duration: float = 4.0  # of joint-target [s]
    margin: float = 0.2  # of joint-limits: the fraction of the half range that counts
    link: str = ""  # of plane-distance
    normal: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  # in W
    offset: float = 0.0  # of plane-distance [m]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it.

        `make` checks what depends on the arm (names, limits).
        """
        choice(self.kind, key(name, "kind"), MAKERS)

    def make(self, model: ControlModel) -> TaskFunction:
        """Returns the task function without its weight.

        Raises:
            ConfigurationError: a name or number does not fit the arm; valid names are listed.
        """
        return MAKERS[self.kind](self, model)


@dataclass
class TaskConfig(TermConfig):
    """The task of a redundant arm: one function, or with `kind: weighted-sum` the sum of terms."""

    terms: list[TermConfig] = field(default_factory=list)

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        choice(self.kind, key(name, "kind"), KINDS)
        if self.kind == "weighted-sum" and not self.terms:
            raise ConfigurationError(f"{key(name, 'terms')} is empty; a weighted sum needs terms.")

    def make(self, model: ControlModel) -> TaskFunction:
        """Returns the task function, weights included.

        Raises:
            ConfigurationError: a name or number does not fit the arm; valid names are listed.
        """
        if self.kind == "weighted-sum":
            terms = [(self.weight * term.weight, term.make(model)) for term in self.terms]
            return WeightedSum(terms)
        task = super().make(model)
        return task if self.weight == 1.0 else WeightedSum([(self.weight, task)])


MAKERS: dict[str, Callable[[TermConfig, ControlModel], TaskFunction]] = {
    "none": lambda term, model: NoTask(),
    "joint-target": lambda term, model: JointTarget(
        model,
        term.joints,
        term.target,
        initial=term.initial,
        start=term.start,
        duration=term.duration,
    ),
    "manipulability": lambda term, model: Manipulability(),
    "posture": lambda term, model: Posture(model),
    "joint-limits": lambda term, model: JointLimitDistance(model, term.joints, term.margin),
    "plane-distance": lambda term, model: PlaneDistance(model, term.link, term.normal, term.offset),
}

KINDS = (*MAKERS, "weighted-sum")
