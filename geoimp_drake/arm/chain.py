"""The control model of an arm as arrays, for the compiled dynamics of laws/serial_chain.py."""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint, RevoluteJoint

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.laws.dynamics.serial_chain import ChainArrays

__all__ = ["chain_arrays"]


def chain_arrays(model: ControlModel) -> ChainArrays:
    """Returns the arm of a control model, which is a serial chain of one link a joint."""
    plant = model.plant
    joints = [plant.GetJointByName(name) for name in model.joint_names]
    inertias = [_inertia_in_joint_frame(joint) for joint in joints]
    instance = model.end_effector.model_instance()
    before = [RigidTransform(), *(_pose_of_link(joint) for joint in joints)]
    X_MF = [
        X_ML @ joint.frame_on_parent().GetFixedPoseInBodyFrame()
        for X_ML, joint in zip(before, joints, strict=False)
    ]
    X_ME = before[-1] @ model.end_effector.GetFixedPoseInBodyFrame()
    return ChainArrays(
        X_MF=np.array([X.GetAsMatrix34() for X in X_MF]),
        axes=np.array([_axis(joint) for joint in joints]),
        turns=model.turns,
        masses=np.array([mass for mass, _, _ in inertias]),
        centres=np.array([centre for _, centre, _ in inertias]),
        inertias=np.array([inertia for _, _, inertia in inertias]),
        X_ME=np.ascontiguousarray(X_ME.GetAsMatrix34()),
        rotors=_reflected_inertia(plant, joints),
        friction=model.viscous_friction,
        gravity=plant.gravity_field().gravity_vector() * plant.is_gravity_enabled(instance),
    )


def _pose_of_link(joint: Joint) -> RigidTransform:
    """Returns X_ML, the pose of the link that a joint moves in the frame M that moves with it."""
    return joint.frame_on_child().GetFixedPoseInBodyFrame().inverse()


def _axis(joint: Joint) -> np.ndarray:
    axis: np.ndarray = (
        joint.revolute_axis() if isinstance(joint, RevoluteJoint) else joint.translation_axis()
    )
    return axis


def _inertia_in_joint_frame(joint: Joint) -> tuple[float, np.ndarray, np.ndarray]:
    """Returns mass, centre of mass and inertia about it of a joint's link, in M."""
    X_ML = _pose_of_link(joint)
    M_LLo = joint.child_body().default_spatial_inertia()
    p_LC = M_LLo.get_com()
    I_LC = M_LLo.Shift(p_LC).CalcRotationalInertia().ReExpress(X_ML.rotation())
    return M_LLo.get_mass(), X_ML @ p_LC, I_LC.CopyToFullMatrix3()


def _reflected_inertia(plant: MultibodyPlant, joints: list[Joint]) -> np.ndarray:
    """Returns rotor inertia times the square of the gear ratio (n)."""
    reflected = {
        actuator.joint().index(): actuator.default_reflected_inertia()
        for actuator in map(plant.get_joint_actuator, plant.GetJointActuatorIndices())
    }
    return np.array([reflected[joint.index()] for joint in joints])
