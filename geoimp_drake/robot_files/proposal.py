"""Where an arm may start, how compliant it may be and what it may do at first, by its own mass."""

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

# Of the impedance: its frequency ω [rad/s], which turns by so much in a sample at most, and ζ.
_FREQUENCY, _ANGLE_PER_SAMPLE, _DAMPING_RATIO = 20.0, 0.02, 2.5
# The hand resists a turn about E at least as it resists the shift of a point so far from E [m].
_LEVER = 0.15
# The hand's first move in parts of the arm's length, and what the first push does [m].
_MOVE, _PUSHED = 0.1, 0.02
# Of what gravity leaves of the actuators' limits, the first push takes this part at most.
_SHARE_OF_EFFORT = 0.25
# So many start postures are looked at.
_POSTURES = 100
_DIGITS = 3


@dataclass(frozen=True)
class Proposal:
    """What an arm may begin with.

    Attributes:
        posture: joint positions (n) in the control model's order [rad or m].
        impedance: that suits the arm's mass.
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
    """Returns what an arm may begin with; its default positions become the posture's.

    Args:
        plant: finalized.
        arm: the arm's model instance.
        end_effector_frame: E.
        scene_graph: of the plant; without one, links may touch in the posture.
        period: of the controller [s].

    Raises:
        ModelError: there is no such arm, as `ControlModel.of_arm`.
        SingularityError: every posture that was found is singular.
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
    """Returns Λ = (J B⁻¹ Jᵀ)⁻¹ (6×6), what a wrench at E has to accelerate; [angular; linear]."""
    J = arm.Jv_V_WE
    return np.linalg.inv(J @ np.linalg.solve(arm.B, J.T))


def propose_impedance(arm: ArmState, period: float = 1e-3) -> ImpedanceConfig:
    """Returns an impedance that suits an arm's mass, the same in all directions.

    M_p is the smallest eigenvalue of Λ's translational block: the arm is never made to feel
    lighter than it is. M_o is that of the rotational block, at least M_p (0.15 m)²: about its own
    axis the last link alone would be too light to be held. D = 2ζω M and K = ω² M with ζ = 2.5 and
    ω = 20 rad/s, or 0.02 rad in a sample if that is less: D/M is a tenth of what would bring a
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
    """Returns the first posture without a warning, or else that with the fewest."""
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
    """Returns the length of the way through all joints to E [m]."""
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
    """Returns a number with so many digits that count."""
    return float(f"{value:.{digits}g}")
