"""The same tick as a user of pinocchio would write it in NumPy, for comparison.

pinocchio is no dependency of the library; without it there is no comparison.
"""

from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.laws.frame_motion import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
)
from geoimp_drake.parts.null_space_gain import DEFAULT_KAPPA
from geoimp_drake.typing import Array

__all__ = ["PinocchioTick"]


class PinocchioTick:
    """The default controller of an arm: terms by pinocchio's bindings, everything else in NumPy.

    Args:
        file: URDF of the arm.
        model: the arm as the library sees it, for data that a URDF does not have.
    """

    def __init__(self, file: str, model: ControlModel):
        self._pin = pin = import_module("pinocchio")
        self._model = pin.buildModelFromUrdf(file)
        joints = [model.plant.GetJointByName(name) for name in model.joint_names]
        self._damping = np.array([joint.default_damping() for joint in joints])
        self._frame = self._add_end_effector(model)
        self._data = self._model.createData()
        self._model.armature = self._rotors(model)
        config = ImpedanceControllerConfig()
        (self._M, self._D, self._K), (self._M_o, self._D_o, self._K_o) = (
            [float(gain[0, 0]) for gain in config.impedance.gains(part)]
            for part in ("translation", "rotation")
        )
        self._motion, self._dt = config.motion, config.sampling.period

    @staticmethod
    def is_available() -> bool:
        """Whether pinocchio is installed, with its bindings."""
        return find_spec("pinocchio") is not None and hasattr(
            import_module("pinocchio"), "buildModelFromUrdf"
        )

    def _add_end_effector(self, model: ControlModel) -> int:
        """Adds E, which need not be a link; returns its index."""
        pin, plant, last = self._pin, model.plant, model.joint_names[-1]
        frame = plant.GetJointByName(last).frame_on_child()
        context = plant.CreateDefaultContext()
        X_JE = model.end_effector.CalcPose(context, frame)
        placement = pin.SE3(X_JE.rotation().matrix(), X_JE.translation())
        joint, kind = self._model.getJointId(last), pin.FrameType.OP_FRAME
        index: int = self._model.addFrame(pin.Frame("E", joint, placement, kind))
        return index

    def _rotors(self, model: ControlModel) -> Array:
        """Returns the inertia of rotors and of friction in a discrete plant; a URDF has neither."""
        q, context = np.zeros(model.num_joints), model.plant.CreateDefaultContext()
        model.plant.SetPositions(context, q)
        B = model.plant.CalcMassMatrix(context)
        rotors: Array = np.diag(B) - np.diag(self._pin.crba(self._model, self._data, q))
        return rotors

    def reset(self, q: Array) -> None:
        """Starts C at rest on E."""
        pose = self.terms(q, np.zeros(len(q)))[0]
        x, y, z, w = self._pin.Quaternion(pose.rotation).coeffs()
        self._Q, self._p = np.array([w, x, y, z]), pose.translation.copy()
        self._w, self._v = np.zeros(3), np.zeros(3)

    def terms(self, q: Array, v: Array) -> tuple[Any, ...]:
        """Returns X_WE, J, J̇ [linear; angular], B, and the forces of velocity and gravity."""
        pin, model, data, frame = self._pin, self._model, self._data, self._frame
        axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        pin.computeJointJacobiansTimeVariation(model, data, q, v)
        J = pin.getFrameJacobian(model, data, frame, axes)
        dJ = pin.getFrameJacobianTimeVariation(model, data, frame, axes)
        B = pin.crba(model, data, q)
        B = np.triu(B) + np.triu(B, 1).T
        bias = pin.rnea(model, data, q, v, np.zeros(len(v)))
        return pin.updateFramePlacement(model, data, frame), J, dJ, B, bias

    def step(self, q: Array, v: Array, h: Array, D: Array) -> Array:
        """Returns the torques of the next tick; arguments as of `ControlLoop.step`."""
        dw, a = self._acceleration_of_C(h, D)
        self._follow(dw, a)
        dw, a = self._acceleration_of_C(h, D)
        pose, J, dJ, B, bias = self.terms(q, v)
        V = J @ v
        motion, R_E = self._motion, pose.rotation
        task = np.concatenate(
            (
                a + motion.K_Dp * (self._v - V[:3]) + motion.K_Pp * (self._p - pose.translation),
                dw
                + motion.K_Do * (self._w - V[3:])
                + motion.K_Po * (R_E @ self._between(R_E, _rotation(self._Q))[1:]),
            )
        )
        alpha = self._joint_acceleration(q, v, J, dJ, B, task - dJ @ v)
        wrench = np.concatenate((h[3:], h[:3]))
        torque: Array = B @ alpha + bias + self._damping * v + J.T @ wrench
        return torque

    def _acceleration_of_C(self, h: Array, D: Array) -> tuple[Array, Array]:
        """(3.1) and (3.30), solved for the accelerations of C."""
        dv, dp = D[LINEAR_VELOCITY] - self._v, D[POSITION] - self._p
        a = D[LINEAR_ACCELERATION] - (h[3:] - self._D * dv - self._K * dp) / self._M
        R_C = _rotation(self._Q)
        relative = D[ANGULAR_VELOCITY] - self._w
        w_CD = R_C.T @ relative
        Q_CD = self._between(R_C, _rotation(D[QUATERNION]))
        epsilon = Q_CD[1:]
        elastic = 2.0 * self._K_o * Q_CD[0] * epsilon
        dw_CD = (R_C.T @ h[:3] - self._D_o * w_CD - elastic) / self._M_o
        dw = D[ANGULAR_ACCELERATION] - np.cross(self._w, relative) - R_C @ dw_CD
        return dw, a

    def _follow(self, dw: Array, a: Array) -> None:
        """Integrates C by explicit Euler."""
        dt, w, (eta, *_) = self._dt, self._w, self._Q
        epsilon = self._Q[1:]
        rate = 0.5 * np.concatenate(([-w @ epsilon], eta * w + np.cross(w, epsilon)))
        Q = self._Q + dt * rate
        self._Q, self._p = Q / np.linalg.norm(Q), self._p + dt * self._v
        self._w, self._v = w + dt * dw, self._v + dt * a

    def _joint_acceleration(
        self, q: Array, v: Array, J: Array, dJ: Array, B: Array, task: Array
    ) -> Array:
        """(2.5), or (3.32) with (3.36)-(3.38) for W = B and β = 0."""
        if len(v) == 6:
            return np.linalg.solve(J, task)
        inverse = np.linalg.inv(B)
        Lambda = np.linalg.inv(J @ inverse @ J.T)
        J_pinv = inverse @ J.T @ Lambda
        N = np.eye(len(v)) - J_pinv @ J
        C = self._pin.computeCoriolisMatrix(self._model, self._data, q, v)
        dJ_pinv = inverse @ (dJ.T @ Lambda - (C + C.T) @ J_pinv)
        e = -N @ v
        null = N @ (dJ_pinv @ (J @ v) + DEFAULT_KAPPA * e + inverse @ (C @ e))
        acceleration: Array = J_pinv @ task + null
        return acceleration

    def _between(self, R_1: Array, R_2: Array) -> Array:
        """Returns the quaternion from one attitude to another, the shorter way round."""
        x, y, z, w = self._pin.Quaternion(R_1.T @ R_2).coeffs()
        return np.array([w, x, y, z]) * (1.0 if w >= 0.0 else -1.0)


def _rotation(Q: Array) -> Array:
    eta, epsilon = Q[0], Q[1:]
    x, y, z = epsilon
    S = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 * (eta * S + S @ S)
