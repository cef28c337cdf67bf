"""What can be said of an arm before it runs: links that touch by themselves, a start that falls."""

import logging
from collections.abc import Iterator, Sequence

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, Frame, ModelInstanceIndex
from pydrake.systems.framework import Context

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.state import evaluate_arm
from geoimp_drake.typing import Array

__all__ = ["find_self_contact", "find_unheld_joints", "preflight", "warn_before_run"]

_log = logging.getLogger("drake")

# Joints without limits, and those of many turns, are moved within this [rad or m].
_WIDEST = np.pi
# Contact that is there in so many random postures is no matter of the posture.
_POSTURES = 50
# Shapes that meet to rounding do not push [m].
_LEAST_DEPTH = 1e-6

# Names of two links, and how deep their shapes are in each other [m].
_Contacts = dict[tuple[str, str], float]


def preflight(
    plant: MultibodyPlant,
    arm: ModelInstanceIndex,
    end_effector_frame: Frame,
    scene_graph: SceneGraph | None = None,
) -> list[str]:
    """Returns what is wrong with an arm at its start, one sentence each with what to do about it.

    The start is the plant's default positions. Call it before `builder.Build()` or after.

    Args:
        plant: finalized.
        arm: the arm's model instance.
        end_effector_frame: E.
        scene_graph: of the plant; without one, contact is not looked for.

    Raises:
        ModelError: there is no such arm, as `ControlModel.of_arm`.
    """
    model = ControlModel.of_arm(plant, arm, end_effector_frame)
    n = model.num_joints
    q = plant.GetDefaultPositions(arm)[model.state_order[:n]]
    contact = [] if scene_graph is None else find_self_contact(plant, scene_graph, [arm])
    return contact + find_unheld_joints(model, q)


def warn_before_run(
    plant: MultibodyPlant,
    arm: ModelInstanceIndex,
    end_effector_frame: Frame,
    scene_graph: SceneGraph | None = None,
) -> None:
    """Writes what `preflight` finds into Drake's log, as warnings."""
    for finding in preflight(plant, arm, end_effector_frame, scene_graph):
        _log.warning(finding)


def find_unheld_joints(model: ControlModel, q: Array) -> list[str]:
    """Returns the joints whose actuators cannot bear gravity at rest, g(q) of (2.2), a sentence.

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


def find_self_contact(
    plant: MultibodyPlant,
    scene_graph: SceneGraph,
    arms: Sequence[ModelInstanceIndex],
    postures: int = _POSTURES,
) -> list[str]:
    """Returns the links of arms that touch each other: in every posture, and at the start.

    Shapes are those that the simulation has: of a mesh the convex hull.

    Args:
        plant: finalized; its default positions are the start.
        scene_graph: of the plant.
        arms: model instances; contact with anything else is not looked for.
        postures: how many random ones are tried, within the joint limits.
    """
    query, start = _Query(plant, scene_graph, arms), plant.GetDefaultPositions()
    try:
        at_start = always = query.contacts(start)
        for q in _random_positions(plant, arms, start, postures):
            if not always:
                break
            touching = query.contacts(q)
            always = {pair: depth for pair, depth in always.items() if pair in touching}
    except RuntimeError as error:  # Drake knows no contact between some kinds of shape.
        return [f"Whether links touch cannot be said: {' '.join(str(error).split())}"]
    return _sentences(at_start, always, postures)


def _sentences(at_start: _Contacts, always: _Contacts, postures: int) -> list[str]:
    found = []
    if always:
        found.append(
            f"Links touch in every one of {postures} random postures: {_listed(always)}. Contact "
            f"drives them apart all the time. Filter the pairs (<drake:collision_filter_group> in "
            f"the robot's file), or load it with geometry 'visual' or 'leave-out'."
        )
    if here := {pair: depth for pair, depth in at_start.items() if pair not in always}:
        found.append(
            f"Links touch at the start: {_listed(here)}. Start in another posture, or load the "
            f"robot with geometry 'visual' or 'leave-out'."
        )
    return found


def _listed(contacts: _Contacts) -> str:
    deepest = sorted(contacts.items(), key=lambda item: -item[1])
    return ", ".join(f"{a} and {b} by {1e3 * depth:.3g} mm" for (a, b), depth in deepest)


def _random_positions(
    plant: MultibodyPlant, arms: Sequence[ModelInstanceIndex], start: Array, postures: int
) -> Iterator[Array]:
    """Yields positions of the plant in which the arms' joints are drawn from within limits."""
    low = np.maximum(plant.GetPositionLowerLimits(), -_WIDEST)
    high = np.maximum(low, np.minimum(plant.GetPositionUpperLimits(), _WIDEST))
    random = np.random.default_rng(0)
    for _ in range(postures):
        drawn, q = random.uniform(low, high), start.copy()
        for arm in arms:
            plant.SetPositionsInArray(arm, plant.GetPositionsFromArray(arm, drawn), q)
        yield q


class _Query:
    """Asks a scene graph which links touch, without the diagram that it may be part of."""

    def __init__(
        self, plant: MultibodyPlant, scene_graph: SceneGraph, arms: Sequence[ModelInstanceIndex]
    ):
        self._plant, self._links = plant, _links(plant, arms)
        self._plant_context: Context = plant.CreateDefaultContext()
        self._context: Context = scene_graph.CreateDefaultContext()
        self._poses = scene_graph.get_source_pose_port(plant.get_source_id())
        self._output = scene_graph.get_query_output_port()

    def contacts(self, q: Array) -> _Contacts:
        """Returns the links that touch at positions q of the plant."""
        self._plant.SetPositions(self._plant_context, q)
        poses = self._plant.get_geometry_pose_output_port().Eval(self._plant_context)
        self._poses.FixValue(self._context, AbstractValue.Make(poses))
        query = self._output.Eval(self._context)
        deepest: _Contacts = {}
        for contact in query.ComputePointPairPenetration():
            bodies = [
                self._plant.GetBodyFromFrameId(query.inspector().GetFrameId(geometry))
                for geometry in (contact.id_A, contact.id_B)
            ]
            touch = contact.depth > _LEAST_DEPTH
            if touch and all(body.index() in self._links for body in bodies):
                a, b = sorted(body.name() for body in bodies)
                deepest[a, b] = max(contact.depth, deepest.get((a, b), 0.0))
        return deepest


def _links(plant: MultibodyPlant, arms: Sequence[ModelInstanceIndex]) -> set[BodyIndex]:
    """Returns the bodies of arms, and those that the arms carry, a tool of its own instance."""
    links: set[BodyIndex] = set()
    for arm in arms:
        joints = [j for j in plant.GetJointIndices(arm) if plant.get_joint(j).num_velocities()]
        links |= {*plant.GetBodyIndices(arm), *plant.GetBodiesKinematicallyAffectedBy(joints)}
    return links
