"""Finds the links of arms that touch each other, by the shapes that the simulation uses."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, ModelInstanceIndex
from pydrake.systems.framework import Context

from geoimp_drake.errors import one_line
from geoimp_drake.typing import Array

__all__ = ["POSTURES", "Contacts", "SelfContact"]

# Contact in all of so many random postures does not depend on the posture.
POSTURES = 50
# Joints without limits, and those of many turns, are moved within ± this [rad or m].
_WIDEST = np.pi
# Shapes that meet to within rounding do not push [m].
_LEAST_DEPTH = 1e-6

# The penetration depth of two links' shapes by the links' names [m].
Contacts = dict[tuple[str, str], float]


class SelfContact:
    """Asks a scene graph which links touch, without the diagram of which it may be part.

    It checks contact among the arms and what they carry, with nothing else.

    Args:
        plant: finalized.
        scene_graph: of the plant.
        arms: model instances.

    Attributes:
        problem: why Drake cannot tell, empty if it can.
    """

    def __init__(
        self, plant: MultibodyPlant, scene_graph: SceneGraph, arms: Sequence[ModelInstanceIndex]
    ):
        self._plant, self._arms, self._links = plant, arms, _links(plant, arms)
        self._plant_context: Context = plant.CreateDefaultContext()
        self._context: Context = scene_graph.CreateDefaultContext()
        self._poses = scene_graph.get_source_pose_port(plant.get_source_id())
        self._output = scene_graph.get_query_output_port()
        self.problem = ""

    def at(self, q: Array) -> Contacts:
        """Returns the links that touch at positions q of the plant."""
        self._plant.SetPositions(self._plant_context, q)
        poses = self._plant.get_geometry_pose_output_port().Eval(self._plant_context)
        self._poses.FixValue(self._context, AbstractValue.Make(poses))
        query = self._output.Eval(self._context)
        try:
            contacts = query.ComputePointPairPenetration()
        except RuntimeError as error:  # Drake cannot compute contact between some kinds of shapes.
            self.problem = one_line(error)
            return {}
        deepest: Contacts = {}
        for contact in contacts:
            bodies = [
                self._plant.GetBodyFromFrameId(query.inspector().GetFrameId(geometry))
                for geometry in (contact.id_A, contact.id_B)
            ]
            touch = contact.depth > _LEAST_DEPTH
            if touch and all(body.index() in self._links for body in bodies):
                a, b = sorted(body.name() for body in bodies)
                deepest[a, b] = max(contact.depth, deepest.get((a, b), 0.0))
        return deepest

    @cached_property
    def always(self) -> Contacts:
        """Links that touch in every one of `POSTURES` random postures, and their least depth."""
        low = np.maximum(self._plant.GetPositionLowerLimits(), -_WIDEST)
        high = np.maximum(low, np.minimum(self._plant.GetPositionUpperLimits(), _WIDEST))
        random, q = np.random.default_rng(0), self._plant.GetDefaultPositions()
        least: Contacts = {}
        for k in range(POSTURES):
            drawn = random.uniform(low, high)
            for arm in self._arms:
                self._plant.SetPositionsInArray(
                    arm, self._plant.GetPositionsFromArray(arm, drawn), q
                )
            touching = self.at(q)
            pairs = touching.keys() & least.keys() if k else touching.keys()
            least = {pair: min(touching[pair], least.get(pair, np.inf)) for pair in pairs}
            if not least:
                break
        return least


def _links(plant: MultibodyPlant, arms: Sequence[ModelInstanceIndex]) -> set[BodyIndex]:
    """Returns the bodies of arms and those that they carry, such as a tool of another instance."""
    links: set[BodyIndex] = set()
    for arm in arms:
        joints = [j for j in plant.GetJointIndices(arm) if plant.get_joint(j).num_velocities()]
        links |= {*plant.GetBodyIndices(arm), *plant.GetBodiesKinematicallyAffectedBy(joints)}
    return links
