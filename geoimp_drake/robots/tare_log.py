"""The load on an arm that its model does not know, from a logged motion."""

import numpy as np
from pydrake.multibody.tree import JacobianWrtVariable, MultibodyForces

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.laws.sensing.load_identification import (
    IdentifiedLoad,
    identify_load,
    identify_load_from_joints,
)
from geoimp_drake.simulation.log_data import joint_columns
from geoimp_drake.typing import Array

__all__ = ["identify_from_log"]


def identify_from_log(
    log: dict[str, Array], arm: str, model: ControlModel, *, gravity: str, at_wrist: bool
) -> IdentifiedLoad:
    """Returns the load on E beyond the model, with its inertia, and biases as `identify_payload`.

    From the joints' torques it subtracts M v̇ + C v + F v, and the weight of the model unless the
    robot itself holds that. The load explains the rest.

    Args:
        log: arrays of a run or a drive, by key.
        arm: the arm's name in the log.
        model: the arm with its weight, without the unknown load.
        gravity: who held the weight, `controller` or `robot`.
        at_wrist: uses the logged wrench instead of the logged torques.

    Raises:
        ConfigurationError: the log is too short or not of this arm, or its motion does not tell a
            load from a bias. The message then has the condition number.
    """
    t, q, v, u, wrench = joint_columns(log, arm, model)
    dv, readings, moving = np.gradient(v, t, axis=0), [], _Moving(model, gravity)
    places = [moving.at(*row) for row in zip(q, v, dv, strict=True)]
    attitudes, jacobians, torques, speeds = (list(part) for part in zip(*places, strict=True))
    rates = np.gradient(np.array(speeds), t, axis=0)
    motions = [(V[:3], A[:3], A[3:]) for V, A in zip(speeds, rates, strict=True)]
    g = model.plant.gravity_field().gravity_vector()
    if at_wrist:
        readings = [(h.reshape(2, 3) @ R).ravel() for h, R in zip(wrench, attitudes, strict=True)]
        return identify_load(readings, attitudes, g, motions)
    felt = [own - exerted for own, exerted in zip(torques, u, strict=True)]
    return identify_load_from_joints(felt, jacobians, attitudes, g, motions)


class _Moving:
    """The model at an instant of a motion."""

    def __init__(self, model: ControlModel, gravity: str):
        self._model, self._holds = model, gravity == "controller"
        self._context = model.plant.CreateDefaultContext()

    def at(self, q: Array, v: Array, dv: Array) -> tuple[Array, Array, Array, Array]:
        """Returns R_WE, J, the model's torques and V_WE."""
        model, plant, context = self._model, self._model.plant, self._context
        E, W = model.end_effector, model.world
        plant.SetPositions(context, q)
        plant.SetVelocities(context, v)
        kind = JacobianWrtVariable.kV
        J = plant.CalcJacobianSpatialVelocity(context, kind, E, np.zeros(3), W, W)
        torque = plant.CalcInverseDynamics(context, dv, MultibodyForces(plant))
        torque += model.viscous_friction * v
        if self._holds:
            torque -= plant.CalcGravityGeneralizedForces(context)
        return E.CalcPoseInWorld(context).rotation().matrix(), J, torque, J @ v
