"""Checks of an arm before it runs: links that touch each other, a start that cannot be held."""

import logging

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.state import evaluate_arm
from geoimp_drake.robot_files.self_contact import POSTURES, Contacts, SelfContact
from geoimp_drake.typing import Array

__all__ = ["find_self_contact", "find_unheld_joints", "preflight", "warn_before_run"]

_log = logging.getLogger("drake")


def preflight(
    plant: MultibodyPlant,
    arm: ModelInstanceIndex,
    end_effector_frame: Frame,
    scene_graph: SceneGraph | None = None,
) -> list[str]:
    """Returns what is wrong with an arm at its start: one sentence per problem, with its remedy.

    The start is the plant's default positions. Call it before `builder.Build()` or after.

    Args:
        plant: finalized.
        arm: the arm's model instance.
        end_effector_frame: E.
        scene_graph: of the plant; without one, contact is not checked.

    Raises:
        ModelError: there is no such arm, as `ControlModel.of_arm`.
    """
    model = ControlModel.of_arm(plant, arm, end_effector_frame)
    n = model.num_joints
    q = plant.GetDefaultPositions(arm)[model.state_order[:n]]
    unheld = find_unheld_joints(model, q)
    if scene_graph is None:
        return unheld
    contact = SelfContact(plant, scene_graph, [arm])
    return find_self_contact(contact, plant.GetDefaultPositions()) + unheld


def warn_before_run(
    plant: MultibodyPlant,
    arm: ModelInstanceIndex,
    end_effector_frame: Frame,
    scene_graph: SceneGraph | None = None,
) -> None:
    """Writes the findings of `preflight` into Drake's log, as warnings."""
    for finding in preflight(plant, arm, end_effector_frame, scene_graph):
        _log.warning(finding)


def find_unheld_joints(model: ControlModel, q: Array) -> list[str]:
    """Returns a sentence on joints whose actuators cannot bear gravity at rest, g(q) of (2.2).

    Args:
        model: the arm.
        q: joint positions (n) in the control model's order [rad or m].
    """
    state = np.concatenate((q, np.zeros_like(q)))
    g = evaluate_arm(model, model.plant.CreateDefaultContext(), state).g
    found = []
    for k in np.flatnonzero(np.abs(g) > model.effort_limits):
        joint = model.plant.GetJointByName(model.joint_names[k])
        unit = "N" if joint.type_name() == "prismatic" else "Nm"
        found.append(
            f"The start cannot be held: gravity asks {abs(g[k]):.4g} {unit} of joint "
            f"'{joint.name()}', whose effort limit is {model.effort_limits[k]:.4g} {unit}. Start "
            f"in another posture, or correct the limit in the robot's file."
        )
    return found


def find_self_contact(contact: SelfContact, q: Array) -> list[str]:
    """Returns a sentence on links that touch in every posture, and one on those at the start.

    Args:
        contact: of the arms.
        q: positions of the whole plant at the start.
    """
    here = {pair: depth for pair, depth in contact.at(q).items() if pair not in contact.always}
    found = []
    if contact.always:
        found.append(
            f"Links touch in every one of {POSTURES} random postures: {_listed(contact.always)} "
            f"at the least. Contact drives them apart all the time. Filter the pairs "
            f"(<drake:collision_filter_group> in the robot's file), or load it with geometry "
            f"'visual' or 'leave-out'."
        )
    if here:
        found.append(
            f"Links touch at the start: {_listed(here)}. Start in another posture, or load the "
            f"robot with geometry 'visual' or 'leave-out'."
        )
    if contact.problem:
        found.append(f"Whether links touch cannot be said: {contact.problem}")
    return found


def _listed(contacts: Contacts) -> str:
    deepest = sorted(contacts.items(), key=lambda item: -item[1])
    return ", ".join(f"{a} and {b} by {1e3 * depth:.3g} mm" for (a, b), depth in deepest)
