"""The controller of two arms that hold one object without a simulator, tick by tick."""

from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex

from geoimp_drake.controllers.cooperative_config import CooperativeControllerConfig
from geoimp_drake.controllers.cooperative_controller import cooperative_parts, two_arms
from geoimp_drake.controllers.robot_joints import RobotJoints
from geoimp_drake.laws.cooperation.held_object import held_object_motion
from geoimp_drake.laws.cooperation.mutual_pose import mutual_orientation_at_start
from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE, QUATERNION
from geoimp_drake.parts.part_loop import PartLoop
from geoimp_drake.systems.frame_motion import frame_motion_at_rest, pose_of
from geoimp_drake.task_functions.task_function import TaskFunction
from geoimp_drake.typing import Array

__all__ = ["CooperativeControlLoop"]

Pair = Sequence[Array]

_AT_REST = np.zeros(6), np.zeros(6)


class CooperativeControlLoop:
    """The controller of `make_cooperative_controller`, called by hand at each tick of two robots.

    It is like `ControlLoop` for one arm; what belongs to an arm is given and returned in pairs, in
    the order of the arms. The robots tick together.

    Args:
        plant: finalized, contains the arms as `make_cooperative_controller` wants them.
        model_instances: the two arms.
        end_effector_frames: E of each arm, in the same order.
        config: gains, grasp, object and sampling, by default those of its class. `form` has no
            effect.
        loads: model instances that hang on a hand but are not part of its arm's model.
        gravity: who holds the arms' weight: `controller`, or `robot`.
        joints: the joints' names of each arm in its robot's order; by default from base to hand.
        task_functions: of redundant arms, in place of the configured ones.

    Attributes:
        models: the arms; they have no weight if the robots hold it.
        joints: the orders of q, v and torques.
        period: of a tick, unless `step` is told another [s].
        gravity: who holds the arms' weight.

    Raises:
        ModelError: the plant does not contain such arms.
        ConfigurationError: the configuration cannot be used, or `joints` are not those of the arms.
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        model_instances: Sequence[ModelInstanceIndex],
        end_effector_frames: Sequence[Frame],
        config: CooperativeControllerConfig | None = None,
        *,
        loads: Sequence[ModelInstanceIndex] = (),
        gravity: str = "controller",
        joints: tuple[Sequence[str] | None, Sequence[str] | None] = (None, None),
        task_functions: Sequence[TaskFunction | None] = (None, None),
    ):
        config = config or CooperativeControllerConfig()
        held, arms = cooperative_parts(
            plant,
            model_instances,
            end_effector_frames,
            config,
            loads=loads,
            task_functions=task_functions,
            gravity=gravity,
        )
        self.period, self.gravity = config.sampling.period, gravity
        first, second = (
            RobotJoints(arm.model, names) for arm, names in zip(arms, joints, strict=True)
        )
        self.models, self.joints = [arm.model for arm in arms], (first, second)
        names = "_".join(map(plant.GetModelInstanceName, model_instances))
        self._loop = PartLoop(two_arms(held, arms), f"{names}_control_loop")
        self._written = [self._loop.input(f"estimated_state_{k}") for k in (1, 2)]

    @property
    def state(self) -> Array:
        """All that the loop remembers, one array; copy it to save it, write to it to restore it."""
        return self._loop.state

    def reset(
        self, q: Pair, v: Pair, wrenches: Pair | None = None, desired: Array | None = None
    ) -> tuple[Array, Array]:
        """Starts C at rest on the measured pose of the object; returns the torques as `step` does.

        Args:
            q: joint positions of both arms [rad, m].
            v: their velocities [rad/s, m/s].
            wrenches: h by each hand on its environment, about Eo, in W (6); zero by default.
            desired: the object's motion in W (19); by default at rest where the hands hold it.

        Raises:
            SignalError: a signal cannot be used.
        """
        desired = frame_motion_at_rest(self.pose(q)) if desired is None else desired
        first, second = self.joints
        wrench_1, wrench_2 = _AT_REST if wrenches is None else wrenches
        self._loop.reset(
            {
                "estimated_state_1": first.reading(q[0], v[0]),
                "estimated_state_2": second.reading(q[1], v[1]),
                "wrench_1": wrench_1,
                "wrench_2": wrench_2,
                "desired_motion": desired,
            }
        )
        return self._torques()

    def step(
        self, q: Pair, v: Pair, wrenches: Pair, desired: Array, dt: float | None = None
    ) -> tuple[Array, Array]:
        """Returns the torques of both arms for the next tick [Nm, N].

        Args:
            q: joint positions of both arms [rad, m].
            v: their velocities [rad/s, m/s].
            wrenches: h by each hand on its environment, about Eo, in W (6) [Nm, N].
            desired: the object's motion in W, see `frame_motion` (19).
            dt: time since the last tick [s]; the period of sampling by default.

        Raises:
            SignalError: a signal is not finite or of another size, or no time has passed.
            OutOfDomainError: the hands have turned by more than 355° against each other.
            SingularityError: six joints exactly singular without limits, or an attitude leaves
                the domain of its law.
        """
        elapsed = self.period if dt is None else dt
        for k, joints in enumerate(self.joints):
            joints.reading(q[k], v[k], self._written[k])
        readings = {"wrench_1": wrenches[0], "wrench_2": wrenches[1]}
        self._loop.step(readings, {"desired_motion": desired}, elapsed)
        return self._torques()

    def output(self, name: str) -> Array:
        """Returns an output of `make_cooperative_controller` without sensors at the last tick.

        Args:
            name: such as `object_motion`.

        Raises:
            ConfigurationError: there is no such output.
        """
        return self._loop.output(name)

    def pose(self, q: Pair) -> RigidTransform:
        """Returns X_WO, the pose of the object between the hands, as at a start.

        Args:
            q: joint positions of both arms, each in its robot's order [rad, m].
        """
        first, second = [
            frame_motion_at_rest(joints.pose(positions))
            for joints, positions in zip(self.joints, q, strict=True)
        ]
        motions = np.zeros((2, FRAME_MOTION_SIZE))
        Q_12 = mutual_orientation_at_start(first[QUATERNION], second[QUATERNION])
        held_object_motion(first, second, Q_12, motions)
        return pose_of(motions[0])

    def _torques(self) -> tuple[Array, Array]:
        first, second = self.joints
        output = self._loop.output
        return first.torques(output("actuation_1")), second.torques(output("actuation_2"))
