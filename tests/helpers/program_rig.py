"""The seven-joint arm on its track, facing along it, and a tool frame to plan for.

Frames: W world, T the tool: the disk's, its z axis along W's y in the start posture.
"""

import functools
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable

import geoimp_drake.diagrams.experiments as experiments
from geoimp_drake.diagrams.scene.cell import END_EFFECTOR, SEVEN, add_cell
from geoimp_drake.models.robot_data import dh_to_joint
from geoimp_drake.motion_program.plan import MotionPlan, PlanConfig, plan
from geoimp_drake.motion_program.program import MotionProgram

START = np.append(-0.2, dh_to_joint(np.radians([8.83, 75.05, -47.63, 9.93, 62.93, 175.45])))
INSERTION = Path(experiments.__file__).with_name("insertion.pdl")


class TrackArm:
    """The arm's plant, with its kinematics at any posture."""

    def __init__(self):
        self.plant = MultibodyPlant(1e-3)
        add_cell(self.plant, "track_arm")
        self.plant.Finalize()
        self.arm = self.plant.GetModelInstanceByName(SEVEN)
        tool = self.plant.GetModelInstanceByName(f"{SEVEN}_tool")
        self.T = self.plant.GetFrameByName(END_EFFECTOR, tool)
        self._context = self.plant.CreateDefaultContext()

    def pose(self, q: np.ndarray) -> RigidTransform:
        self.plant.SetPositions(self._context, self.arm, q)
        return self.T.CalcPoseInWorld(self._context)

    def jacobian(self, q: np.ndarray) -> np.ndarray:
        self.plant.SetPositions(self._context, self.arm, q)
        W = self.plant.world_frame()
        return self.plant.CalcJacobianSpatialVelocity(
            self._context, JacobianWrtVariable.kV, self.T, np.zeros(3), W, W
        )

    def plan(self, *steps, start=START, config: PlanConfig | None = None, **options) -> MotionPlan:
        program = MotionProgram(list(steps))
        return plan(self.plant, self.arm, self.T, program, start, config, **options)


@functools.cache
def track_arm() -> TrackArm:
    return TrackArm()


def positions(motion: MotionPlan, times: np.ndarray) -> np.ndarray:
    return np.array([motion.trajectory.value(t)[:, 0] for t in times])


def velocities(motion: MotionPlan, times: np.ndarray) -> np.ndarray:
    return np.array([motion.trajectory.EvalDerivative(t)[:, 0] for t in times])
