"""The arm that robosuite gets is the library's; where it cannot run, a line says why."""

import sys
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant

from geoimp_drake.diagrams.scene.mujoco_model import END_EFFECTOR_SITE, arm_spec
from geoimp_drake.diagrams.setups import robosuite_tick
from geoimp_drake.diagrams.setups.robosuite_tick import RobosuiteTick
from geoimp_drake.models import model_path
from geoimp_drake.robot_files.loading import load_robot


@pytest.mark.parametrize("file", ["six_joint_arm", "seven_joint_arm"])
def test_mujocos_arm_is_drakes(file):
    plant = MultibodyPlant(1e-3)
    robot = load_robot(model_path(file), plant, end_effector="flange", geometry="leave-out")
    plant.Finalize()
    E, context = robot.end_effector_frame, plant.CreateDefaultContext()
    model = arm_spec(file, E).compile()
    data = mujoco.MjData(model)
    q = np.linspace(-0.4, 0.7, model.nq)
    data.qpos[:] = q
    mujoco.mj_forward(model, data)
    plant.SetPositions(context, q)
    X_WE = E.CalcPoseInWorld(context)
    site = data.site(END_EFFECTOR_SITE)
    np.testing.assert_allclose(site.xpos, X_WE.translation(), atol=1e-9)
    np.testing.assert_allclose(site.xmat.reshape(3, 3), X_WE.rotation().matrix(), atol=1e-9)
    bias = -plant.CalcGravityGeneralizedForces(context)
    np.testing.assert_allclose(data.qfrc_bias, bias, atol=1e-6 * np.abs(bias).max())
    rotors = [
        actuator.default_reflected_inertia()
        for actuator in map(plant.get_joint_actuator, plant.GetJointActuatorIndices())
    ]
    np.testing.assert_allclose(model.dof_armature, rotors)


def test_what_is_missing_is_said_in_one_line_with_what_to_do(monkeypatch):
    monkeypatch.setattr(robosuite_tick, "find_spec", lambda name: None)
    missing = RobosuiteTick.missing()
    assert missing.startswith(
        "robosuite's controller is left out, it is not installed: pip install"
    )
    assert "\n" not in missing
    monkeypatch.setattr(robosuite_tick, "find_spec", lambda name: "found")
    monkeypatch.setitem(sys.modules, "mujoco", SimpleNamespace(MjData=SimpleNamespace()))
    assert f"does not run with MuJoCo {robosuite_tick.version('mujoco')}" in RobosuiteTick.missing()
    monkeypatch.setitem(sys.modules, "mujoco", SimpleNamespace(MjData=SimpleNamespace(qM=None)))
    assert RobosuiteTick.missing() == ""
