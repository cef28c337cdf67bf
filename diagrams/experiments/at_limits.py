"""Measures the log of an arm at its limits; nothing here judges or draws."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from pydrake.multibody.plant import MultibodyPlant

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.state import ArmState, evaluate_arm
from geoimp_drake.diagrams.experiments.measures import Log, end_reached
from geoimp_drake.diagrams.setups.single_arm import add_single_arm
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.laws.impedance.translational_impedance import compliant_acceleration, turned
from geoimp_drake.parts.joint_limits import SLACK, Limited
from geoimp_drake.systems.frame_motion import POSITION, QUATERNION
from geoimp_drake.typing import Array

__all__ = ["apart", "arm_of", "measured", "torque_shares"]

# E counts as back when it stays this near to the last pose of D [m, °].
_NEAR, _ALIGNED = 1e-3, 0.1

# Of the instants at which limits act, one in so many is checked.
_EVERY = 20

# Singular value below which a direction counts as lost, the default of `redundancy.damping`.
_SINGULAR = 0.01


def measured(log: Log, scenario: SingleArmScenario) -> dict[str, float]:
    """Returns the values of a run, as far as it has come.

    Returns:
        `distance` and `angle` are the largest of E from C [mm, °]. `effort` and `speed` are the
        largest, divided by the joints' limits. `beyond` is the farthest that a joint was outside
        its range, negative if inside [rad, m]. `back` is how much later E is back at D than by the
        law alone [s]. `free` and `bound` are those of `_off_the_law`, while no torque is at its
        limit and while one is [N, Nm]. These two are missing without limits.
    """
    model, arm = arm_of(scenario), scenario.arm
    (low, high), (q, v) = model.position_limits, _joint_states(log, arm, model)
    distance, angle = apart(log[f"{arm}/motion_E"], log[f"{arm}/motion_C"])
    values = {
        "distance": 1e3 * distance.max(),
        "angle": angle.max(),
        "effort": torque_shares(log, arm, model).max(),
        "speed": (np.abs(v) / model.velocity_limits[1]).max(),
        "beyond": np.maximum(low - q, q - high).max(),
    }
    if end_reached(log, scenario.segments):
        values["back"] = _since(log, arm, log[f"{arm}/motion_E"]) - _since(
            log, arm, _law_alone(log, scenario)
        )
    if scenario.limits is not None:
        at_effort, off = _off_the_law(log, scenario, model)
        values["free"] = off[~at_effort].max(initial=0.0)
        values["bound"] = off[at_effort].max(initial=0.0)
    return {name: float(value) for name, value in values.items()}


def arm_of(scenario: SingleArmScenario) -> ControlModel:
    """Returns the model of a scenario's arm."""
    plant = MultibodyPlant(scenario.plant.time_step)
    E, _ = add_single_arm(plant, scenario)
    return ControlModel.of_arm(plant, plant.GetModelInstanceByName(scenario.arm), E)


def torque_shares(log: Log, arm: str, model: ControlModel) -> Array:
    """Returns torques divided by their limits, in the order of the actuators (N×n)."""
    return np.abs(log[f"{arm}/u"]) / model.effort_limits[model.actuation_order]


def apart(A: Array, B: Array) -> tuple[Array, Array]:
    """Returns distance [m] and angle [°] between two frames over time, from their motions."""
    cosine = np.abs(np.sum(A[:, QUATERNION] * B[:, QUATERNION], axis=1))
    distance = np.linalg.norm(A[:, POSITION] - B[:, POSITION], axis=1)
    return distance, np.degrees(2.0 * np.arccos(np.minimum(cosine, 1.0)))


def _joint_states(log: Log, arm: str, model: ControlModel) -> tuple[Array, Array]:
    """Returns positions and velocities over time in the model's order (N×n each)."""
    x = np.hstack((log[f"{arm}/q"], log[f"{arm}/v"]))[:, model.state_order]
    return x[:, : model.num_joints], x[:, model.num_joints :]


def _since(log: Log, arm: str, motion: Array) -> float:
    """Returns the time from which a frame rests at the last pose of D [s], from its motion."""
    distance, angle = apart(motion, log[f"{arm}/motion_D"][-1:])
    away = np.flatnonzero((distance > _NEAR) | (angle > _ALIGNED))
    return float(log["t"][away[-1]]) if away.size else 0.0


def _law_alone(log: Log, scenario: SingleArmScenario) -> Array:
    """Returns the motion of C that (3.1) has without an arm, under the external force (N×19).

    Only its pose is filled in. Without a moment C turns with D.
    """
    t, motion = log["t"], log[f"{scenario.arm}/motion_D"].copy()
    if scenario.external is None:
        return motion
    M, D, K = scenario.impedance.gains("translation")
    push, force = scenario.external.profile(), np.asarray(scenario.external.force, dtype=float)
    M_inv, x, v, rest = np.linalg.inv(M), np.zeros(3), np.zeros(3), np.zeros(3)
    for k, step in enumerate(np.diff(t)):
        a = compliant_acceleration(rest, -v, -x, -push(t[k]) * force, M_inv, D, K)
        x, v = x + step * v, v + step * a
        motion[k + 1, POSITION] += x
    return motion


def _off_the_law(log: Log, scenario: SingleArmScenario, model: ControlModel) -> tuple[Array, Array]:
    """Returns, for instants at which limits act, the error of the law where E is free.

    The slack times the mass matrix is the wrench that the law lacks. Its part along directions in
    which joints that are not held can move E should be zero. The log shows which torques are at
    their limits. Of joints held by position and speed it shows only the number, in `Limited`. They
    are taken to be those that explain the wrench best.

    Returns:
        Whether a torque is at its limit, and that part's size [N, Nm] (as many as instants).
    """
    limited = log[f"{scenario.arm}/limited"]
    instants = np.flatnonzero(limited[1:, : SLACK.start].any(axis=1))[::_EVERY] + 1
    # The limits that act in a step are logged at its end, the state and the torques at its
    # beginning. But where the simulation has paused, every 0.1 s, both are logged at once.
    off = [
        min(_lacking_when_free(log, scenario, model, k, row) for k in (row - 1, row))
        for row in instants
    ]
    return limited[instants, 2] > 0, np.array(off)


def _lacking_when_free(
    log: Log, scenario: SingleArmScenario, model: ControlModel, begin: int, row: int
) -> float:
    """Returns the wrench that the law lacks where E is free [N, Nm], see `_off_the_law`.

    Args:
        log: of a run.
        scenario: of the run.
        model: of its arm.
        begin: row of the log in which the step begins.
        row: the one in which `Limited` describes the step.
    """
    arm = scenario.arm
    now = Limited(log[f"{arm}/limited"][row])
    x = np.concatenate((log[f"{arm}/q"][begin], log[f"{arm}/v"][begin]))[model.state_order]
    state = evaluate_arm(model, model.plant.CreateDefaultContext(), x)
    M_o, M_p = (scenario.impedance.gains(part)[0] for part in ("rotation", "translation"))
    slack = now[SLACK]
    lacking = np.concatenate((turned(M_o, state.R_WE) @ slack[:3], M_p @ slack[3:]))
    shares = np.abs(log[f"{arm}/u"][begin]) / model.effort_limits[model.actuation_order]
    strongest = model.actuation_order[np.argsort(-shares)[: int(now.effort)]]
    free = _free_directions(state, strongest, int(now.position + now.velocity))
    return float(min(np.linalg.norm(lacking @ directions) for directions in free))


def _free_directions(state: ArmState, strongest: Array, held: int) -> Iterator[Array]:
    """Yields, for each choice of `held` joints, an orthonormal basis (6, m) of where E can move.

    A torque at its limit holds a combination of the joints, its row of B. The damping near a
    singularity holds the combinations that hardly move E.
    """
    J, n = state.Jv_V_WE, len(state.B)
    _, s, Vt = np.linalg.svd(J)
    lost = Vt[: len(s)][s < _SINGULAR]
    for joints in combinations(np.eye(n), held):
        holds = np.array([*joints, *state.B[strongest], *lost]).reshape(-1, n)
        _, s, Vt = np.linalg.svd(holds)
        moving = Vt[np.sum(s > 1e-9 * s.max(initial=0.0)) :].T
        U, s, _ = np.linalg.svd(J @ moving, full_matrices=False)
        yield U[:, s > _SINGULAR]
