"""The six-joint cell for MuJoCo: the same URDF files, joined at the same places as in the plant.

MuJoCo reads links, inertias, joints and damping. A URDF cannot describe welds between files, frames
and rotors; these come from the plant. Visual shapes are left out.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex, WeldJoint

from geoimp_drake.extras import needs_extra
from geoimp_drake.models import model_path

__all__ = ["END_EFFECTOR_SITE", "arm_spec", "cell_spec", "load_mujoco", "scoped"]

# The file of each of the cell's model instances.
_FILES = {"": "six_joint_arm", "_sensor": "wrist_sensor", "_tool": "stick_and_disk"}

_SENSOR_SITE, END_EFFECTOR_SITE = "sensor", "end_effector"


def load_mujoco() -> Any:
    """Returns the module; raises ConfigurationError if the package, an extra, is missing."""
    with needs_extra("mujoco", "engine 'mujoco'"):
        import mujoco as module
    return module


def cell_spec(plant: MultibodyPlant, arm: str, E: Frame, sensor_joint: WeldJoint) -> Any:
    """Returns the arm, its wrist sensor and its tool as an MjSpec, to be extended and compiled.

    Its sensor data are torque and force at the wrist sensor, on the tool, in S. It has the site
    `END_EFFECTOR_SITE`.

    Args:
        plant: finalized; contains the same models.
        arm: name of the arm's model instance.
        E: the end effector, on the tool.
        sensor_joint: the weld that the wrist sensor reads.

    Raises:
        ConfigurationError: MuJoCo is not installed.
    """
    mj = load_mujoco()
    spec = mj.MjSpec()
    spec.compiler.fusestatic = False
    spec.option.integrator = mj.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.timestep = plant.time_step()
    # A divergence must show, not restart the simulation.
    spec.option.disableflags = mj.mjtDisableBit.mjDSBL_AUTORESET
    spec.option.gravity = plant.gravity_field().gravity_vector()
    instances = [plant.GetModelInstanceByName(f"{arm}{suffix}") for suffix in _FILES]
    for instance, file in zip(instances, _FILES.values(), strict=True):
        _attach(spec, plant, instance, mj.MjSpec.from_string(_without_looks(file)))
    _add_rotors(spec, plant, instances[0])
    hand, frame = sensor_joint.child_body(), sensor_joint.frame_on_child()
    _add_site(spec, _SENSOR_SITE, hand, frame.GetFixedPoseInBodyFrame())
    _add_site(spec, END_EFFECTOR_SITE, E.body(), E.GetFixedPoseInBodyFrame())
    for kind in (mj.mjtSensor.mjSENS_TORQUE, mj.mjtSensor.mjSENS_FORCE):
        spec.add_sensor(type=kind, objtype=mj.mjtObj.mjOBJ_SITE, objname=_SENSOR_SITE)
    return spec


def arm_spec(file: str, E: Frame) -> Any:
    """Returns an arm alone, fixed to the world, as an MjSpec with the site `END_EFFECTOR_SITE`.

    Names are those of its file.

    Args:
        file: name of its model.
        E: the end effector, on one of its links in a finalized plant.
    """
    spec = load_mujoco().MjSpec.from_string(_without_looks(file))
    plant, arm = E.GetParentPlant(), E.body().model_instance()
    _add_rotors(spec, plant, arm, lambda joint: joint.name())
    spec.body(E.body().name()).add_site(
        name=END_EFFECTOR_SITE, **_pose(E.GetFixedPoseInBodyFrame())
    )
    return spec


def scoped(body: Any) -> str:
    """Returns the name in MuJoCo of one of the plant's bodies, joints or actuators."""
    plant = body.GetParentPlant()
    return f"{plant.GetModelInstanceName(body.model_instance())}/{body.name()}"


def _without_looks(file: str) -> str:
    """Returns a model's URDF without its visuals, whose meshes MuJoCo would search for."""
    robot = ElementTree.parse(Path(model_path(file))).getroot()
    for link in robot.iter("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    return ElementTree.tostring(robot, encoding="unicode")


def _attach(spec: Any, plant: MultibodyPlant, instance: ModelInstanceIndex, model: Any) -> None:
    """Attaches a model at the place where a weld of the plant holds its first link."""
    weld = _weld_of(plant, instance)
    root = weld.child_body()
    X_PB = (
        weld.frame_on_parent().GetFixedPoseInBodyFrame()
        @ weld.X_FM()
        @ weld.frame_on_child().GetFixedPoseInBodyFrame().inverse()
    )
    parent = weld.parent_body()
    is_world = parent.index() == plant.world_body().index()
    holder = spec.worldbody if is_world else spec.body(scoped(parent))
    frame = holder.add_frame(**_pose(X_PB))
    frame.attach_body(model.body(root.name()), f"{plant.GetModelInstanceName(instance)}/", "")


def _weld_of(plant: MultibodyPlant, instance: ModelInstanceIndex) -> WeldJoint:
    """Returns the weld between a model instance and the body that carries it."""
    joints = map(plant.get_joint, plant.GetJointIndices())
    return next(
        joint
        for joint in joints
        if joint.child_body().model_instance() == instance
        and joint.parent_body().model_instance() != instance
    )


def _add_rotors(
    spec: Any,
    plant: MultibodyPlant,
    arm: ModelInstanceIndex,
    name_of: Callable[[Any], str] = scoped,
) -> None:
    for actuator in map(plant.get_joint_actuator, plant.GetJointActuatorIndices(arm)):
        joint = spec.joint(name_of(actuator.joint()))
        joint.armature = actuator.default_reflected_inertia()


def _add_site(spec: Any, name: str, body: Any, X_BS: RigidTransform) -> None:
    spec.body(scoped(body)).add_site(name=name, **_pose(X_BS))


def _pose(X: RigidTransform) -> dict[str, Any]:
    return {"pos": np.array(X.translation()), "quat": X.rotation().ToQuaternion().wxyz()}
