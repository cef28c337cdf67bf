"""The start of an arm: a posture, or a pose of its end effector and inverse kinematics."""

from dataclasses import dataclass, field

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.start_posture import find_start_posture, inverse_kinematics
from geoimp_drake.arm.state import evaluate_arm
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.motion_control.resolved_acceleration import check_regular
from geoimp_drake.rotations import euler, so3
from geoimp_drake.typing import Array
from geoimp_drake.validation import finite_vector, key

__all__ = ["StartConfig", "start_posture"]

# A start must be well away from a singularity, not just short of one.
_SMALLEST_SINGULAR_VALUE = 1e-2


@dataclass
class StartConfig:
    """Pose of E at the start; the posture follows by inverse kinematics, or is given.

    E's orientation is given by XYZ Euler angles, then turned about `tilt_axis` by `tilt_deg`.
    """

    # Of E in W [m]; null: a posture away from limits and singularities is searched for.
    position: Array | None = None
    attitude_deg: Array = field(default_factory=lambda: np.array([180.0, 0.0, 0.0]))
    tilt_axis: Array = field(default_factory=lambda: np.array([1.0, 1.0, 0.0]))  # in W
    tilt_deg: float = 0.0
    guess: Array | None = None  # posture near which to search [rad, m]; everywhere if not given
    posture: list[float] | None = None  # joint positions [rad, m]; they need no search

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        if self.position is not None:
            finite_vector(self.position, key(name, "position"), 3)
        finite_vector(self.attitude_deg, key(name, "attitude_deg"), 3)
        axis = finite_vector(self.tilt_axis, key(name, "tilt_axis"), 3)
        if np.linalg.norm(axis) < 1e-6:
            raise ConfigurationError(f"{key(name, 'tilt_axis')} is zero; give a direction.")
        if self.position is None and self.posture is None:
            self._check_anywhere(name)

    def _check_anywhere(self, name: str) -> None:
        """Raises ConfigurationError if something is given that means nothing without a place."""
        usual = StartConfig()
        for part in ("attitude_deg", "tilt_axis", "tilt_deg", "guess"):
            value = getattr(self, part)
            if not np.array_equal(value, getattr(usual, part)):
                raise ConfigurationError(
                    f"{key(name, part)} is {np.asarray(value).tolist()} and "
                    f"{key(name, 'position')} is null, which looks for a posture anywhere. Give "
                    f"{key(name, 'position')}, the place of E in W, or leave {part} out."
                )

    def pose(self) -> RigidTransform:
        """Returns X_WE."""
        R = euler.to_rotation(np.deg2rad(self.attitude_deg))
        axis = np.asarray(self.tilt_axis) / np.linalg.norm(self.tilt_axis)
        R_WE = so3.rotation_about(axis, np.deg2rad(self.tilt_deg)) @ R
        return RigidTransform(RotationMatrix.ProjectToRotationMatrix(R_WE), self.position)


def start_posture(
    model: ControlModel, start: StartConfig, name: str = "start", *, regular: bool = True
) -> tuple[Array, RigidTransform]:
    """Returns the joint positions and the pose X_WE at the start.

    Args:
        model: the arm.
        start: where it starts.
        name: of `start` in the scenario, for errors.
        regular: refuse a singular posture, as a controller without limits requires.

    Raises:
        ConfigurationError: the number of joints is wrong, or the start is outside the joint limits
            or out of reach.
        SingularityError: the posture is singular, and `regular` is set.
    """
    if start.posture is not None:
        q = finite_vector(np.array(start.posture), key(name, "posture"), model.num_joints)
    elif start.position is None:
        q = find_start_posture(model)
    elif start.guess is None:
        q = find_start_posture(model, start.pose())
    else:
        q = _near_guess(model, start, name)
    _check_limits(model, q)
    arm = evaluate_arm(
        model, model.plant.CreateDefaultContext(), np.concatenate((q, np.zeros_like(q)))
    )
    if regular:
        check_regular(arm.Jv_V_WE, _SMALLEST_SINGULAR_VALUE)
    return q, RigidTransform(RotationMatrix(arm.R_WE), arm.p_WE)


def _near_guess(model: ControlModel, start: StartConfig, name: str) -> Array:
    guess = finite_vector(np.array(start.guess), key(name, "guess"), model.num_joints)
    X_WE = start.pose()
    q = inverse_kinematics(model, X_WE, guess)
    if q is None:
        raise ConfigurationError(
            f"No posture within the joint limits puts the end effector at "
            f"{key(name, 'position')} = {X_WE.translation().tolist()} with that attitude "
            f"(searched from {key(name, 'guess')}). Give a nearer guess or a pose within reach."
        )
    return q


def _check_limits(model: ControlModel, q: Array) -> None:
    lower, upper = model.plant.GetPositionLowerLimits(), model.plant.GetPositionUpperLimits()
    outside = np.flatnonzero((q < lower) | (q > upper))
    if outside.size:
        raise ConfigurationError(
            "The start posture is outside the joint limits: "
            + "; ".join(
                f"{model.joint_names[i]} at {q[i]:.4f}, allowed {lower[i]:.4f} to {upper[i]:.4f}"
                for i in outside
            )
            + "."
        )
