"""The contents of a robot's file: its frames, its arms, and where their hands begin."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint, ModelInstanceIndex, RigidBody, WeldJoint

from geoimp_drake.arm.control_model import TASK_DIMENSION
from geoimp_drake.errors import ModelError, drake_errors
from geoimp_drake.robot_files.messages import silent
from geoimp_drake.robot_files.parsing import named_frames, parse, trial_plant
from geoimp_drake.robot_files.preparation import prepare

__all__ = ["ArmInFile", "RobotSurvey", "survey_robot"]

# Last words of an end effector's name, the most usual first.
_END_EFFECTORS = ("tool0", "tcp", "ee", "eef", "end_effector", "tool", "attachment", "flange")
_SUFFIXES = ("_link", "_frame", "_site", "_point")
# Words in the name of a hand's joint, or of the link beyond it; a wrist may move a "gripper".
_OF_A_HAND = ("finger", "fngr", "jaw", "knuckle", "thumb")
_GRIPPER = "gripper"
# Two of these names mean fingers; one alone may belong to an arm.
_FINGERS = frozenset(("index", "middle", "ring", "little", "pinky"))
_OF_A_SENSOR = ("camera", "optical", "imu", "sensor")


@dataclass(frozen=True)
class ArmInFile:
    """An arm: a chain of six or more moving joints.

    Attributes:
        end_effector: the proposed frame.
        others: further frames that six or more joints move, the nearest to the end first.
        joints: names, from the base to the end effector.
    """

    end_effector: str
    others: tuple[str, ...]
    joints: tuple[str, ...]


@dataclass(frozen=True)
class RobotSurvey:
    """The contents of a robot's file.

    Attributes:
        file: the one that was read.
        arms: of six or more joints, the longest first.
        frames: names of all links, frames and sites.
    """

    file: Path
    arms: tuple[ArmInFile, ...]
    frames: tuple[str, ...]


def survey_robot(file: str | Path, packages: Mapping[str, Path] | None = None) -> RobotSurvey:
    """Returns the arms that a URDF, SDF or MJCF file describes.

    An arm ends before its hand. A hand begins at joints that are named after fingers or grippers,
    or that follow others (mimic). It also begins where joints part into several chains of fewer
    than six.

    Args:
        file: the description; its meshes are not read.
        packages: folders of `package://` names.

    Raises:
        ConfigurationError: the file cannot be read.
        ModelError: it has no chain of six joints.
    """
    with silent(), drake_errors(ModelError, f"Drake cannot use {file}"):
        prepared = prepare(Path(file), packages or {}, "leave-out", None)
        plant, _ = trial_plant()
        instance = parse(prepared.description, plant, packages or {})
    frames = named_frames(prepared.description, plant, instance)
    tree = _Tree(plant, instance, frames, prepared.followers)
    arms = sorted(tree.arms(), key=lambda arm: -len(arm.joints))
    if not arms:
        raise ModelError(
            f"{file} has no arm: its longest chain has {tree.longest()} moving joints (hands and "
            f"mimic joints do not count); six-DOF impedance needs {TASK_DIMENSION}."
        )
    return RobotSurvey(Path(file), tuple(arms), tuple(frames))


class _Tree:
    """Links and joints of a parsed robot; a group is a link with all that is welded to it."""

    def __init__(
        self,
        plant: MultibodyPlant,
        instance: ModelInstanceIndex,
        frames: list[str],
        followers: set[str],
    ):
        self._plant, self._instance, self._named = plant, instance, frames
        joints = [plant.get_joint(k) for k in plant.GetJointIndices(instance)]
        self._outward: dict[int, list[Joint]] = {}
        for joint in joints:
            self._outward.setdefault(int(joint.parent_body().index()), []).append(joint)
        inner = {int(joint.child_body().index()) for joint in joints}
        self._roots = [
            plant.get_body(b)
            for b in (plant.world_body().index(), *plant.GetBodyIndices(instance))
            if int(b) not in inner
        ]
        self._hand = {joint.name() for joint in joints if _is_of_a_hand(joint, followers)}
        fingers = [(joint.name(), _fingers(joint)) for joint in joints]
        if len(set().union(*(words for _, words in fingers))) > 1:
            self._hand |= {name for name, words in fingers if words}

    def arms(self) -> Iterator[ArmInFile]:
        """Yields the arms."""
        for root in self._roots:
            yield from map(self._arm, self._paths(root, ()))

    def longest(self) -> int:
        """Returns the number of joints in the longest chain of an arm."""
        return max(map(self._reach, self._roots), default=0)

    def _paths(self, body: RigidBody, before: tuple[Joint, ...]) -> Iterator[tuple[Joint, ...]]:
        """Yields the moving joints of each arm that leads through a body."""
        enough, leaving = len(before) >= TASK_DIMENSION, self._leaving(body)
        # A single chain continues the arm; where several begin, only those of an arm count, no
        # fingers.
        least = 1 if len(leaving) == 1 else TASK_DIMENSION
        least = least if enough else TASK_DIMENSION - len(before)
        onward = [joint for joint in leaving if self._reach_by(joint) >= least]
        for joint in onward:
            yield from self._paths(joint.child_body(), (*before, joint))
        if enough and not onward:
            yield before

    def _reach(self, body: RigidBody) -> int:
        """Returns the number of joints in the longest chain beyond a body."""
        return max(map(self._reach_by, self._leaving(body)), default=0)

    def _reach_by(self, joint: Joint) -> int:
        """Returns the same with a given joint as the first; zero if it is a hand's."""
        return 0 if joint.name() in self._hand else 1 + self._reach(joint.child_body())

    def _group(self, body: RigidBody) -> list[RigidBody]:
        """Returns a body and those welded to it outward, the outermost last."""
        group = [body]
        for member in group:
            group += [
                joint.child_body()
                for joint in self._outward.get(int(member.index()), [])
                if isinstance(joint, WeldJoint)
            ]
        return group

    def _leaving(self, body: RigidBody) -> list[Joint]:
        """Returns the moving joints from a body's group outward."""
        return [
            joint
            for member in self._group(body)
            for joint in self._outward.get(int(member.index()), [])
            if not isinstance(joint, WeldJoint)
        ]

    def _arm(self, path: tuple[Joint, ...]) -> ArmInFile:
        groups = [self._group(joint.child_body()) for joint in path[TASK_DIMENSION - 1 :]]
        last, *before = [
            [name for body in reversed(group) for name in self._frames_on(body)]
            for group in reversed(groups)
        ]
        best = min(last, key=_unlikeliness)  # the first of equals
        others = [name for name in sum(before, last) if name != best]
        return ArmInFile(best, tuple(others), tuple(joint.name() for joint in path))

    def _frames_on(self, body: RigidBody) -> list[str]:
        """Returns the names in the file of a body's frames, its own first."""
        frames = [
            frame.name()
            for frame in map(self._plant.get_frame, self._plant.GetFrameIndices(self._instance))
            if frame.body().index() == body.index() and frame.name() in self._named
        ]
        return sorted(frames, key=lambda name: name != body.name())


def _is_of_a_hand(joint: Joint, followers: set[str]) -> bool:
    names = f"{joint.name()} {joint.child_body().name()}".lower()
    of_a_hand = any(word in names for word in _OF_A_HAND) or _GRIPPER in joint.name().lower()
    return of_a_hand or joint.name() in followers


def _fingers(joint: Joint) -> frozenset[str]:
    """Returns which fingers a joint is named after."""
    names = f"{joint.name()} {joint.child_body().name()}".lower()
    return _FINGERS.intersection(re.split("[^a-z]+", names))


def _unlikeliness(name: str) -> int:
    """Returns the rank of a frame's name among those of end effectors; the first is likeliest."""
    plain = name.lower()
    for suffix in _SUFFIXES:
        plain = plain.removesuffix(suffix)
    if any(word in plain for word in _OF_A_SENSOR):
        return len(_END_EFFECTORS) + 1
    ends = [plain == word or plain.endswith(f"_{word}") for word in _END_EFFECTORS]
    return ends.index(True) if any(ends) else len(_END_EFFECTORS)
