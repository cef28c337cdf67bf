"""A tick of robosuite's operational-space controller on the same arm, for comparison.

robosuite is no dependency of the library, and needs a MuJoCo before 4; without both there is no
comparison. Its controller has another law, Λ (k_p e − k_d ẋ) with gravity and a posture in the null
space. Only the cost of a tick is compared.
"""

from collections.abc import Sequence
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec

import numpy as np
from pydrake.multibody.tree import Frame

from geoimp_drake.diagrams.scene.mujoco_model import END_EFFECTOR_SITE, arm_spec
from geoimp_drake.rotations import angle_axis
from geoimp_drake.systems.frame_motion import POSITION, QUATERNION
from geoimp_drake.typing import Array

__all__ = ["RobosuiteTick"]

_OSC = "robosuite.controllers.parts.arm.osc"
_INSTALL = "pip install robosuite==1.5.2 mujoco==3.3.7, in an environment of its own"


class RobosuiteTick:
    """robosuite's controller of an arm's pose, unchanged, with MuJoCo's terms of the arm.

    Args:
        file: name of the arm's model.
        E: the end effector, in a finalized plant.
        names: of the joints, from base to hand.
    """

    def __init__(self, file: str, E: Frame, names: Sequence[str]):
        spec = arm_spec(file, E)
        spec.worldbody.add_site(name="arm_center")  # of its base, which the controller expects
        mujoco = spec.compile()
        joints = [mujoco.joint(name) for name in names]
        indices = {
            "joints": [joint.id for joint in joints],
            "qpos": [joint.qposadr[0] for joint in joints],
            "qvel": [joint.dofadr[0] for joint in joints],
        }
        self._q, self._v = indices["qpos"], indices["qvel"]
        self._sim = import_module("robosuite.utils.binding_utils").MjSim(mujoco)
        unlimited = np.full(len(joints), np.inf)
        self._osc = import_module(_OSC).OperationalSpaceController(
            self._sim,
            END_EFFECTOR_SITE,
            indices,
            (-unlimited, unlimited),
            input_type="absolute",
            input_ref_frame="world",
            uncouple_pos_ori=False,
            part_name="arm",
            naming_prefix="",
        )

    @staticmethod
    def missing() -> str:
        """Returns, in one line, why there is no comparison and what to do; or an empty text."""
        if find_spec("robosuite") is None or find_spec("mujoco") is None:
            return f"robosuite's controller is left out, it is not installed: {_INSTALL}."
        if not hasattr(import_module("mujoco").MjData, "qM"):
            return (
                f"robosuite's controller is left out, it does not run with MuJoCo "
                f"{version('mujoco')}: {_INSTALL}."
            )
        return ""

    def reset(self, q: Array, v: Array, D: Array) -> None:
        """Sets the state (n), (n), and the motion of D (19) as the goal."""
        self._set(q, v)
        self._osc.initial_joint = np.array(q)
        turn = angle_axis.displacement(angle_axis.representation("simple"), D[QUATERNION])
        self._goal = np.concatenate((D[POSITION], turn))
        self._osc.set_goal(self._goal)

    def controller(self) -> Array:
        """Returns the torques of `run_controller` alone."""
        torque: Array = self._osc.run_controller()
        return torque

    def step(self, q: Array, v: Array) -> Array:
        """Returns the torques of a whole tick: MuJoCo's terms of a state, goal and controller."""
        self._set(q, v)
        self._osc.set_goal(self._goal)
        return self.controller()

    def _set(self, q: Array, v: Array) -> None:
        self._sim.data.qpos[self._q], self._sim.data.qvel[self._v] = q, v
        self._sim.step1()
