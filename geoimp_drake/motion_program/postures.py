"""Postures of an arm that put its tool frame at a given pose."""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.solvers import SnoptSolver, Solve, SolverOptions

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.typing import Array

__all__ = ["ArmPostures"]

_RIGHT_ANGLE = 0.5 * np.pi
_LIMIT_TOLERANCE = 1e-6  # that of the solver [rad or m]


class ArmPostures:
    """Forward and inverse kinematics of an arm; every vector from the base to the hand.

    Args:
        model: the arm; its end effector is the tool frame T.
        weights: of each joint in the distance between two postures (n), positive.
    """

    def __init__(self, model: ControlModel, weights: Array):
        self.model = model
        self._weights = weights
        self._context = model.plant.CreateDefaultContext()
        self._lower = model.plant.GetPositionLowerLimits()
        self._upper = model.plant.GetPositionUpperLimits()
        self._options = SolverOptions()
        self._options.SetOption(SnoptSolver.id(), "Major feasibility tolerance", 1e-8)

    def tool_pose(self, q: Array) -> RigidTransform:
        """Returns X_WT."""
        self.model.plant.SetPositions(self._context, q)
        return self.model.end_effector.CalcPoseInWorld(self._context)

    def nearest(
        self, X_WT: RigidTransform, q_near: Array, within_limits: bool = True
    ) -> Array | None:
        """Returns the posture that puts T at a pose and is nearest to another, or None.

        The nearest one has the smallest Σ w (q − q_near)² with the joints' weights. T must be less
        than a quarter turn away at `q_near`.
        """
        plant, T, W = self.model.plant, self.model.end_effector, self.model.plant.world_frame()
        problem = InverseKinematics(plant, with_joint_limits=within_limits)
        p, R = X_WT.translation(), X_WT.rotation().matrix()
        problem.AddPositionConstraint(T, np.zeros(3), W, p, p)
        # Three right angles fix the attitude. Unlike the gradient of the angle between two
        # attitudes, theirs do not vanish at the solution.
        for wanted, own in ((0, 1), (0, 2), (1, 2)):
            problem.AddAngleBetweenVectorsConstraint(
                W, R[:, wanted], T, np.eye(3)[own], _RIGHT_ANGLE, _RIGHT_ANGLE
            )
        problem.prog().AddQuadraticErrorCost(np.diag(self._weights), q_near, problem.q())
        for joint, weight in zip(problem.q(), self._weights, strict=True):
            problem.prog().SetVariableScaling(joint, 1.0 / np.sqrt(weight))
        result = Solve(problem.prog(), q_near, self._options)
        return np.asarray(result.GetSolution(problem.q())) if result.is_success() else None

    def outside_limits(self, q: Array) -> str:
        """Returns which joints are outside their limits, for a message; empty if none is."""
        lower, upper = self._lower, self._upper
        outside = np.flatnonzero((q < lower - _LIMIT_TOLERANCE) | (q > upper + _LIMIT_TOLERANCE))
        return "; ".join(
            f"{self.model.joint_names[i]} at {q[i]:.4f}, allowed {lower[i]:.4f} to {upper[i]:.4f}"
            for i in outside
        )
