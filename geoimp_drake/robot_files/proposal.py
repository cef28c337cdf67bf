"""Proposes a start posture, an impedance and a first motion that suit an arm's own mass."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.start_posture import (
    check_start,
    inverse_kinematics,
    posture_quality,
    start_postures,
)
from geoimp_drake.arm.state import ArmState, evaluate_arm
from geoimp_drake.controllers.impedance_config import (
    ImpedanceConfig,
    RotationGains,
    TranslationGains,
)
from geoimp_drake.robot_files.preflight import find_self_contact, find_unheld_joints
from geoimp_drake.robot_files.self_contact import SelfContact
from geoimp_drake.typing import Array

__all__ = ["Proposal", "apparent_inertia", "propose", "propose_impedance"]

# Of the impedance: its frequency ω [rad/s], the largest ω times a sample [rad], and ζ.
_FREQUENCY, _ANGLE_PER_SAMPLE, _DAMPING_RATIO = 20.0, 0.02, 2.5
# The hand resists a rotation about E at least as much as the shift of a point so far from E [m].
_LEVER = 0.15
# The hand's first move as a fraction of the arm's length, and the deflection by the first push [m].
_MOVE, _PUSHED = 0.1, 0.02
# The first push takes at most this share of the effort that gravity leaves.
_SHARE_OF_EFFORT = 0.25
# The number of start postures that are checked.
_POSTURES = 100
_DIGITS = 3


@dataclass(frozen=True)
class Proposal:
    """A proposal for an arm's first run.

    Attributes:
        posture: joint positions (n) in the control model's order [rad or m].
        impedance: one that suits the arm's mass.
        displacement: of the hand's first move, in W (3) [m]; zero if there is none.
        push: a force (3) on the hand, in W, downward [N].
    """

    posture: Array
    impedance: ImpedanceConfig
    displacement: Array
    push: Array


def propose(
    plant: MultibodyPlant,
    arm: ModelInstanceIndex,
    end_effector_frame: Frame,
    scene_graph: SceneGraph | None = None,
    period: float = 1e-3,
) -> Proposal:
    """Returns a proposal for an arm's first run; sets the arm's default positions to its posture.

    Args:
        plant: finalized.
        arm: the arm's model instance.
        end_effector_frame: E.
        scene_graph: of the plant; without one, links may touch in the posture.
        period: of the controller [s].

    Raises:
        ModelError: there is no such arm, as `ControlModel.of_arm`.
        SingularityError: every posture found is singular.
    """
    model = ControlModel.of_arm(plant, arm, end_effector_frame)

    contact = SelfContact(plant, scene_graph, [arm]) if scene_graph is not None else None

    def warnings_at(q: Array) -> int:
        plant.SetDefaultPositions(arm, model.in_plant_order(q))
        start = plant.GetDefaultPositions()
        touching = find_self_contact(contact, start) if contact is not None else []
        return len(touching) + len(find_unheld_joints(model, q))

    tried = (np.round(q, _DIGITS) for q in start_postures(model)[:_POSTURES])
    q = _fewest(tried, warnings_at)
    plant.SetDefaultPositions(arm, model.in_plant_order(q))
    check_start(model, q)
    state = _at_rest(model, q)
    impedance = propose_impedance(state, period)
    return Proposal(q, impedance, _move(model, q, state), _push(model, state, impedance))


def apparent_inertia(arm: ArmState) -> Array:
    """Returns Λ = (J B⁻¹ Jᵀ)⁻¹ (6×6), the inertia that a wrench at E feels; [angular; linear]."""
    J = arm.Jv_V_WE
    return np.linalg.inv(J @ np.linalg.solve(arm.B, J.T))


def propose_impedance(arm: ArmState, period: float = 1e-3) -> ImpedanceConfig:
    """Returns an impedance that suits an arm's mass, the same in all directions.

    M_p is the smallest eigenvalue of Λ's translational block, so the arm never feels lighter than
    it is. M_o is that of the rotational block, but at least M_p (0.15 m)². About its own axis the
    last link alone would be too light to be held. D = 2ζω M and K = ω² M with ζ = 2.5 and ω = 20
    rad/s, or 0.02 rad in a sample if that is less. D/M is then a tenth of the value that brings a
    velocity to rest in one sample.

    Args:
        arm: at its start.
        period: of the controller [s].
    """
    inertia = apparent_inertia(arm)
    mass = float(np.linalg.eigvalsh(inertia[3:, 3:])[0])
    turned = max(float(np.linalg.eigvalsh(inertia[:3, :3])[0]), mass * _LEVER**2)
    omega = min(_FREQUENCY, _ANGLE_PER_SAMPLE / period)

    def gains(M: float) -> dict[str, Any]:
        values = {"mass": M, "damping": 2.0 * _DAMPING_RATIO * omega * M, "stiffness": omega**2 * M}
        return {name: np.array(_rounded(value)) for name, value in values.items()}

    return ImpedanceConfig(TranslationGains(**gains(mass)), RotationGains(**gains(turned)))


def _fewest(postures: Iterable[Array], warnings_at: Callable[[Array], int]) -> Array:
    """Returns the first posture without a warning, or else the one with the fewest."""
    found: list[tuple[int, Array]] = []
    for q in postures:
        found.append((warnings_at(q), q))
        if not found[-1][0]:
            break
    return min(found, key=lambda warned: warned[0])[1]


def _move(model: ControlModel, q: Array, start: ArmState) -> Array:
    """Returns the displacement along an axis of W that leads to the best posture, or zero."""
    context, R_WE = model.plant.CreateDefaultContext(), RotationMatrix(start.R_WE)
    distance = _rounded(_MOVE * _length(model), 1)
    best, quality = np.zeros(3), 0.0
    for direction in (*np.eye(3), *-np.eye(3)):
        displacement = distance * direction + 0.0  # no minus zero
        X_WE = RigidTransform(R_WE, start.p_WE + displacement)
        end = inverse_kinematics(model, X_WE, q)
        if end is None or find_unheld_joints(model, end):
            continue
        if (found := posture_quality(model, context, end)) > quality:
            best, quality = displacement, found
    return best


def _length(model: ControlModel) -> float:
    """Returns the length of the path through all joints to E [m]."""
    context = model.plant.CreateDefaultContext()
    joints = [model.plant.GetJointByName(name).frame_on_parent() for name in model.joint_names]
    frames = [*joints, model.end_effector]
    places = np.array([frame.CalcPoseInWorld(context).translation() for frame in frames])
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def _push(model: ControlModel, start: ArmState, impedance: ImpedanceConfig) -> Array:
    """Returns a force downward that the arm can bear and that shifts the hand a little."""
    _, _, K_p = impedance.gains("translation")
    force = _PUSHED * float(K_p[2, 2])
    torque = np.abs(start.Jv_V_WE[5])
    left = np.maximum(model.effort_limits - np.abs(start.g), 0.0)
    bearable = np.divide(left, torque, out=np.full_like(left, np.inf), where=torque > 0.0).min()
    return np.array([0.0, 0.0, -_rounded(min(force, _SHARE_OF_EFFORT * float(bearable)))]) + 0.0


def _at_rest(model: ControlModel, q: Array) -> ArmState:
    state = np.concatenate((q, np.zeros_like(q)))
    return evaluate_arm(model, model.plant.CreateDefaultContext(), state)


def _rounded(value: float, digits: int = _DIGITS) -> float:
    """Returns a number with so many significant digits."""
    return float(f"{value:.{digits}g}")
