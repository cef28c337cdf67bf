"""A start posture away from limits and singularities, for an arm without a chosen one."""

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.solvers import Solve
from pydrake.systems.framework import Context

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.state import ArmState, evaluate_arm
from geoimp_drake.errors import ConfigurationError, SingularityError
from geoimp_drake.laws.motion_control.resolved_acceleration import check_regular
from geoimp_drake.typing import Array

__all__ = [
    "check_start",
    "find_start_posture",
    "inverse_kinematics",
    "limit_margin",
    "posture_quality",
    "start_postures",
]

# A start must be well away from a singularity, not just short of one.
_SINGULAR = 1e-2
# If all joints turn by less than this between their limits, the file is probably wrong [rad].
_NARROW = np.deg2rad(20.0)
# The least margin of a start: solvers keep limits only to a tolerance.
_LEAST_MARGIN = 1e-2
# A larger margin than this makes a posture no better.
_AMPLE_MARGIN = 0.3
# Joints without limits, and those of many turns, are searched within ± this [rad or m].
_WIDEST = np.pi
_SAMPLES, _GUESSES = 400, 12
# In the distance between two poses, a radian counts as this many metres.
_RADIAN = 0.3


def find_start_posture(
    model: ControlModel, X_WE: RigidTransform | None = None, *, seed: int = 0
) -> Array:
    """Returns a posture far from joint limits and singularities, the same for the same seed.

    Of the postures that it tries, it returns the one with the largest `posture_quality`. It does
    not check collisions.

    Args:
        model: the arm.
        X_WE: pose of its end effector, reached by inverse kinematics from several guesses; any pose
            by default.
        seed: of the random postures.

    Returns:
        Joint positions (n) in the control model's order [rad or m].

    Raises:
        ConfigurationError: no posture within the joint limits reaches X_WE.
        SingularityError: the best posture found is at a kinematic singularity.
    """
    best = start_postures(model, X_WE, seed=seed)[0]
    check_start(model, best)
    return best


def check_start(model: ControlModel, q: Array) -> None:
    """Refuses an arm's best posture if it is singular, and says if the joints can hardly move.

    Args:
        model: the arm.
        q: joint positions (n) in the control model's order [rad or m].

    Raises:
        SingularityError: the smallest singular value of the Jacobian is not above 0.01.
    """
    try:
        check_regular(_arm_at(model, model.plant.CreateDefaultContext(), q).Jv_V_WE, _SINGULAR)
    except SingularityError as error:
        lower, upper = model.plant.GetPositionLowerLimits(), model.plant.GetPositionUpperLimits()
        widest = float(np.max((upper - lower)[model.turns > 0.0], initial=0.0))
        if widest > _NARROW:
            raise
        raise SingularityError(
            f"{error} No joint of this arm turns by more than {np.rad2deg(widest):.3g}° between "
            f"its limits; radians in a file that counts in degrees? An MJCF does unless it has "
            f'<compiler angle="radian"/>.'
        ) from error


def start_postures(
    model: ControlModel, X_WE: RigidTransform | None = None, *, seed: int = 0
) -> list[Array]:
    """Returns all postures that `find_start_posture` tries, the best first; arguments as there.

    Raises:
        ConfigurationError: no posture within the joint limits reaches X_WE.
    """
    context = model.plant.CreateDefaultContext()
    postures = _samples(model, seed)
    if X_WE is not None:
        nearest = sorted(postures, key=lambda q: _distance(_arm_at(model, context, q), X_WE))
        postures = _reaching(model, X_WE, nearest[:_GUESSES])
    return sorted(postures, key=lambda q: -posture_quality(model, context, q))


def inverse_kinematics(model: ControlModel, X_WE: RigidTransform, guess: Array) -> Array | None:
    """Returns the posture nearest to a guess that puts the end effector at a pose, or None.

    Args:
        model: the arm; the posture is within its joint limits.
        X_WE: the pose.
        guess: joint positions (n) in the control model's order [rad or m].
    """
    plant, E, W = model.plant, model.end_effector, model.plant.world_frame()
    problem = InverseKinematics(plant, with_joint_limits=True)
    p = X_WE.translation()
    problem.AddPositionConstraint(E, np.zeros(3), W, p, p)
    problem.AddOrientationConstraint(W, X_WE.rotation(), E, RotationMatrix(), 0.0)
    problem.prog().AddQuadraticErrorCost(np.eye(model.num_joints), guess, problem.q())
    problem.prog().SetInitialGuess(problem.q(), guess)
    result = Solve(problem.prog())
    return np.asarray(result.GetSolution(problem.q())) if result.is_success() else None


def limit_margin(model: ControlModel, q: Array) -> float:
    """Returns how far a posture is from the joint limits: 1 in mid-range, 0 at a limit.

    Args:
        model: the arm; joints that have no limits do not count.
        q: joint positions (n) in the control model's order [rad or m].
    """
    lower, upper = model.plant.GetPositionLowerLimits(), model.plant.GetPositionUpperLimits()
    limited = np.isfinite(upper - lower)
    room = np.minimum(q - lower, upper - q)[limited] / (upper - lower)[limited]
    return float(2.0 * room.min(initial=0.5))


def posture_quality(model: ControlModel, context: Context, q: Array) -> float:
    """Returns σ, the smallest singular value of the Jacobian, less where a limit is near.

    A `limit_margin` below 0.3 counts against it in proportion.

    Args:
        model: the arm.
        context: of its plant; it is left at the posture.
        q: joint positions (n) in the control model's order [rad or m].
    """
    sigma = np.linalg.svd(_arm_at(model, context, q).Jv_V_WE, compute_uv=False)[-1]
    return float(sigma) * min(limit_margin(model, q) / _AMPLE_MARGIN, 1.0)


def _samples(model: ControlModel, seed: int) -> list[Array]:
    lower = np.maximum(model.plant.GetPositionLowerLimits(), -_WIDEST)
    upper = np.minimum(model.plant.GetPositionUpperLimits(), _WIDEST)
    random = np.random.default_rng(seed)
    return list(random.uniform(lower, np.maximum(lower, upper), (_SAMPLES, model.num_joints)))


def _arm_at(model: ControlModel, context: Context, q: Array) -> ArmState:
    return evaluate_arm(model, context, np.concatenate((q, np.zeros_like(q))))


def _distance(arm: ArmState, X_WE: RigidTransform) -> float:
    """Returns how far the end effector is from a pose [m], rotation included."""
    R_WE = RotationMatrix(arm.R_WE)
    angle = R_WE.InvertAndCompose(X_WE.rotation()).ToAngleAxis().angle()
    return float(np.linalg.norm(arm.p_WE - X_WE.translation()) + _RADIAN * angle)


def _reaching(model: ControlModel, X_WE: RigidTransform, guesses: list[Array]) -> list[Array]:
    """Returns the postures that reach a pose, one for each guess that leads to one."""
    reached = [inverse_kinematics(model, X_WE, guess) for guess in guesses]
    found = [q for q in reached if q is not None and limit_margin(model, q) > _LEAST_MARGIN]
    if not found:
        raise ConfigurationError(
            f"No posture within the joint limits puts the end effector at "
            f"{np.round(X_WE.translation(), 4).tolist()} with that attitude (searched from "
            f"{len(guesses)} guesses). Give a pose within reach."
        )
    return found
