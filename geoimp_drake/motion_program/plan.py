"""From a motion program to one trajectory of the joints."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex
from pydrake.trajectories import (
    CompositeTrajectory,
    PathParameterizedTrajectory,
    PiecewisePolynomial,
    Trajectory,
)

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.motion_program.postures import ArmPostures
from geoimp_drake.motion_program.program import (
    JointMove,
    LinearMove,
    MotionProgram,
    SpeedOverride,
    ToolMove,
)
from geoimp_drake.motion_program.speed_profile import trapezoidal_profile
from geoimp_drake.motion_program.straight_line import pose_distance, straight_path
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, finite_vector, key, positive, positive_vector

__all__ = ["MotionPlan", "PlanConfig", "ProgramSegment", "plan"]

_NOTHING = 1e-9  # a move shorter than this takes no time [m or rad]
_CHECKS_A_KNOT = 4  # how often the joints' speeds are checked
_RAMP = 0.5  # time to the greatest joint speed where no acceleration is given [s]


@dataclass
class PlanConfig:
    """Nominal speeds and accelerations (those of 100 per cent), and the limits of each joint."""

    linear_speed: float = 0.3  # of the tool frame's origin [m/s]
    linear_acceleration: float = 0.6  # [m/s²]
    rotational_speed: float = 1.0  # [rad/s]
    rotational_acceleration: float = 2.0  # [rad/s²]
    joint_move_speed: float = 0.5  # of joint moves, as a fraction of `joint_speeds`
    # One a joint, from the base to the hand:
    joint_speeds: Array | None = None  # greatest [rad/s or m/s]; the plant's limits if not given
    joint_accelerations: Array | None = None  # of joint moves; `joint_speeds` in 0.5 s by default
    joint_weights: Array | None = None  # see `plan`; 1 by default

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it.

        The number of entries in a field of joints depends on the arm; `plan` checks it.
        """
        for part in (
            "linear_speed",
            "linear_acceleration",
            "rotational_speed",
            "rotational_acceleration",
        ):
            positive(getattr(self, part), key(name, part))
        positive(self.joint_move_speed, key(name, "joint_move_speed"))
        if self.joint_move_speed > 1:
            raise ConfigurationError(
                f"{key(name, 'joint_move_speed')} is {self.joint_move_speed:g}; it is a part of "
                f"the greatest speeds, above 0 and up to 1."
            )
        for part in ("joint_speeds", "joint_accelerations", "joint_weights"):
            if (value := getattr(self, part)) is not None:
                positive_vector(value, key(name, part))

    def vector(self, name: str, size: int, default: Array) -> Array:
        """Returns a field with one number a joint, or the default where none is given."""
        value = getattr(self, name)
        return default if value is None else positive_vector(value, f"speeds.{name}", size)


class ProgramSegment(NamedTuple):
    """One move of a plan."""

    name: str
    begin: float  # [s]
    end: float  # [s]


@dataclass(frozen=True)
class MotionPlan:
    """A motion program as set-points of an arm's joints.

    Attributes:
        trajectory: joint positions over time, from the base to the hand (n) [rad or m].
        segments: each move with its begin and end, in their order.
        joint_names: of the trajectory's rows.
    """

    trajectory: Trajectory
    segments: tuple[ProgramSegment, ...]
    joint_names: tuple[str, ...]


def plan(
    plant: MultibodyPlant,
    model_instance: ModelInstanceIndex,
    tool_frame: Frame,
    program: MotionProgram,
    start_posture: Array,
    config: PlanConfig | None = None,
    start_time: float = 0.0,
) -> MotionPlan:
    """Plans a motion program for one arm of `plant`.

    Every move runs from rest to rest with a trapezoidal speed profile. The override scales speeds
    and accelerations alike, so that the nominal time to full speed remains. Along straight lines,
    position and attitude take the same time, the longer of their two.

    A redundant arm takes, at each step along a line, the posture nearest to the one before: the
    smallest Σ w Δq² with `joint_weights`. With the default of 1 a metre of track counts as much as
    a radian, so track and arm share a motion along it. A large weight of the track leaves the
    motion to the arm.

    Joint moves bound the accelerations of the joints; straight lines bound those of the tool frame.

    Args:
        plant: finalized, contains the arm.
        model_instance: the arm, as for `ControlModel.of_arm`.
        tool_frame: T, fixed in the hand; its z axis is the approach axis.
        program: the moves.
        start_posture: joint positions from the base to the hand (n) [rad or m].
        config: speeds, accelerations and weights.
        start_time: when the first move starts [s].

    Raises:
        ModelError: the plant does not contain such an arm.
        ConfigurationError: a field or target cannot be used, a joint would exceed its limit or
            speed, or a pose is out of reach. The message names the move and the place on its path.
        SingularityError: a straight line leads through a singularity.
    """
    config = config or PlanConfig()
    check(config, "speeds")
    program.validate()
    if not np.isfinite(start_time):
        raise ConfigurationError(f"start_time is {start_time} s; it must be finite.")
    model = ControlModel.of_arm(plant, model_instance, tool_frame)
    limits = _speed_limits(plant, model_instance, model.joint_names)
    return _Planner(model, config, limits, start_posture, start_time).run(program)


class _Planner:
    """Posture, time and override while the moves of a program are planned one by one."""

    def __init__(
        self,
        model: ControlModel,
        config: PlanConfig,
        speed_limits: Array,
        start_posture: Array,
        start_time: float,
    ):
        n = model.num_joints
        self.model, self.config = model, config
        self.arm = ArmPostures(model, config.vector("joint_weights", n, np.ones(n)))
        self.joint_speeds = config.vector("joint_speeds", n, speed_limits)
        _check_bounded(self.joint_speeds, model.joint_names)
        self.joint_accelerations = config.vector(
            "joint_accelerations", n, self.joint_speeds / _RAMP
        )
        self.time = float(start_time)
        self.override = 1.0
        self.q = self.posture(start_posture, "The start posture")
        self.parts: list[Trajectory] = []
        self.segments: list[ProgramSegment] = []

    def run(self, program: MotionProgram) -> MotionPlan:
        """Plans every step."""
        for step in program.steps:
            if isinstance(step, SpeedOverride):
                self.override = step.percent / 100.0
                continue
            label = f"{step.place}: {step.name}" if step.place else step.name
            begin = self.time
            part = self.part(step, label)
            if part is not None:
                self.parts.append(part)
                self.time, self.q = part.end_time(), part.value(part.end_time())[:, 0]
            self.segments.append(ProgramSegment(step.name, begin, self.time))
        if not self.parts:
            raise ConfigurationError(f"Nothing moves in the program '{program.name}'.")
        trajectory = CompositeTrajectory(self.parts)
        return MotionPlan(trajectory, tuple(self.segments), self.model.joint_names)

    def part(self, move: JointMove | LinearMove | ToolMove, label: str) -> Trajectory | None:
        """Returns a move's trajectory from the present posture and time; None if nothing moves."""
        if isinstance(move, JointMove):
            return self.joint_part(self.posture(move.target, label), label)
        if isinstance(move, LinearMove):
            return self.straight_part(move.X_WT, label)
        X_WT = self.arm.tool_pose(self.q) @ RigidTransform(move.displacement)
        return self.straight_part(X_WT, label)

    def joint_part(self, target: Array, label: str) -> Trajectory | None:
        """Returns the trajectory of a joint move; the joint that needs longest sets the time."""
        change = target - self.q
        if np.abs(change).max() < _NOTHING:
            return None
        speeds = self.config.joint_move_speed * self.joint_speeds
        speed = 1.0 / np.max(np.abs(change) / speeds)
        acceleration = 1.0 / np.max(np.abs(change) / self.joint_accelerations)
        path = PiecewisePolynomial.FirstOrderHold([0.0, 1.0], np.column_stack((self.q, target)))
        return self.timed(path, speed, acceleration, label)

    def straight_part(self, X_WT: RigidTransform, label: str) -> Trajectory | None:
        """Returns the trajectory of a straight move; position and attitude take the same time."""
        path_of_tool = np.array(pose_distance(self.arm.tool_pose(self.q), X_WT))
        if path_of_tool.max() < _NOTHING:
            return None
        c = self.config
        speed = 1.0 / np.max(path_of_tool / (c.linear_speed, c.rotational_speed))
        acceleration = 1.0 / np.max(
            path_of_tool / (c.linear_acceleration, c.rotational_acceleration)
        )
        path = straight_path(self.arm, self.q, X_WT, label)
        part = self.timed(path, speed, acceleration, label)
        self.check_speeds(part, path.get_number_of_segments(), label)
        return part

    def timed(self, path: Trajectory, speed: float, acceleration: float, label: str) -> Trajectory:
        """Returns a path over s in [0, 1] as a trajectory that starts now, with the override."""
        try:
            profile = trapezoidal_profile(
                self.time, self.override * speed, self.override * acceleration
            )
        except ConfigurationError as error:
            raise ConfigurationError(f"{label}: {error}") from None
        return PathParameterizedTrajectory(path, profile)

    def posture(self, value: Array, label: str) -> Array:
        """Returns joint positions; raises ConfigurationError unless they are within the limits."""
        q = finite_vector(value, f"{label}: joint positions", self.model.num_joints)
        if outside := self.arm.outside_limits(q):
            raise ConfigurationError(f"{label}: beyond the joint limits: {outside}.")
        return q

    def check_speeds(self, part: Trajectory, knots: int, label: str) -> None:
        """Raises ConfigurationError where a joint would have to move faster than it may."""
        times = np.linspace(part.start_time(), part.end_time(), _CHECKS_A_KNOT * knots + 1)
        speeds = np.array([np.abs(part.EvalDerivative(t)[:, 0]) for t in times])
        k, joint = np.unravel_index(np.argmax(speeds / self.joint_speeds), speeds.shape)
        excess = speeds[k, joint] / self.joint_speeds[joint]
        if excess > 1.0:
            raise ConfigurationError(
                f"{label}: {self.model.joint_names[joint]} would move at {speeds[k, joint]:.3g} "
                f"{times[k] - times[0]:.3g} s after its start, allowed "
                f"{self.joint_speeds[joint]:.3g} [rad/s or m/s]. Set the speed override to "
                f"{100 * self.override / excess:.3g} % or less before it."
            )


def _speed_limits(
    plant: MultibodyPlant, model_instance: ModelInstanceIndex, joint_names: tuple[str, ...]
) -> Array:
    """Returns the greatest speed of each joint in both directions; infinite if it has none."""
    joints = [plant.GetJointByName(name, model_instance) for name in joint_names]
    return np.array(
        [
            min(-joint.velocity_lower_limits()[0], joint.velocity_upper_limits()[0])
            for joint in joints
        ]
    )


def _check_bounded(speeds: Array, joint_names: tuple[str, ...]) -> None:
    unbounded = [name for name, speed in zip(joint_names, speeds, strict=True) if np.isinf(speed)]
    if unbounded:
        raise ConfigurationError(
            f"The plant has no speed limit for: {', '.join(unbounded)}. Give program.joint_speeds."
        )
