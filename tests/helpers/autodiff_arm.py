"""Derivatives of an arm's Jacobian and inertia, by AutoDiff through the plant itself."""

import numpy as np
from pydrake.autodiffutils import AutoDiffXd, ExtractGradient
from pydrake.multibody.tree import JacobianWrtVariable

from geoimp_drake.arm.control_model import ControlModel


class AutoDiffArm:
    """J and B of an arm with their derivatives with respect to q."""

    def __init__(self, model: ControlModel, frame: str = ""):
        self.plant = model.plant.ToAutoDiffXd()
        self.context = self.plant.CreateDefaultContext()
        self.E = (
            self.plant.GetBodyByName(frame).body_frame()
            if frame
            else self.plant.get_frame(model.end_effector.index())
        )

    def along(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns J and B with one derivative, along v."""
        self.plant.SetPositions(
            self.context, np.array([AutoDiffXd(a, [b]) for a, b in zip(q, v, strict=True)])
        )
        W = self.plant.world_frame()
        J = self.plant.CalcJacobianSpatialVelocity(
            self.context, JacobianWrtVariable.kV, self.E, np.zeros(3), W, W
        )
        return J, self.plant.CalcMassMatrix(self.context)

    def inertia_rate(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Returns Ḃ along v."""
        return derivative(self.along(q, v)[1])

    def christoffel_matrix(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Returns C_ij = ½ Σ_k (∂_k B_ij + ∂_j B_ik − ∂_i B_jk) q̇_k."""
        dB = np.stack([self.inertia_rate(q, unit) for unit in np.eye(len(q))], axis=-1)
        return 0.5 * ((dB + dB.transpose(0, 2, 1) - dB.transpose(2, 0, 1)) @ v)


def derivative(a: np.ndarray) -> np.ndarray:
    gradient = ExtractGradient(a.reshape(-1, 1))
    return gradient.reshape(a.shape) if gradient.size else np.zeros(a.shape)
