"""Arms that are not the project's own, as URDF text, and plants that hold them with other models.

Frames: W world, B an arm's base, T the tool beyond the wrist weld, E the end effector in the tool.
"""

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    ModelInstanceIndex,
    PrismaticJoint,
    RevoluteJoint,
    SpatialInertia,
    WeldJoint,
)
from pydrake.systems.framework import Context

# For each joint: its place in the link before, the rotation of its frame there, its axis, and the
# mass of its link. Offsets everywhere, no two axes meet.
SIX = [
    ([0.02, 0.01, 0.35], [0.0, 0.0, 0.3], [0, 0, 1], 9.0),
    ([0.10, 0.03, 0.12], [0.1, 0.0, 0.0], [0, 1, 0], 7.0),
    ([0.02, -0.04, 0.45], [0.0, 0.2, 0.0], [0, 1, 0], 5.0),
    ([0.10, 0.02, 0.08], [0.0, 0.0, 0.1], [1, 0, 0], 2.5),
    ([0.32, 0.01, 0.01], [0.2, 0.0, 0.0], [0, 1, 0], 1.5),
    ([0.09, -0.02, 0.02], [0.0, 0.1, 0.0], [1, 0, 0], 0.6),
]
SEVEN = [
    ([0.0, 0.0, 0.30], [0.0, 0.0, 0.0], [0, 0, 1], 6.0),
    ([0.03, 0.02, 0.14], [0.0, 0.1, 0.0], [0, 1, 0], 5.0),
    ([0.0, 0.02, 0.21], [0.0, 0.0, 0.2], [0, 0, 1], 4.0),
    ([0.02, 0.0, 0.21], [0.1, 0.0, 0.0], [0, -1, 0], 3.0),
    ([0.0, -0.03, 0.20], [0.0, 0.0, 0.0], [0, 0, 1], 2.0),
    ([0.01, 0.0, 0.20], [0.0, 0.0, 0.3], [0, 1, 0], 1.2),
    ([0.08, 0.01, 0.06], [0.0, 0.0, 0.0], [1, 0, 0], 0.5),
]
POSTURES = {
    6: np.array([0.4, 0.3, 0.9, 0.5, -0.9, 0.3]),
    7: np.array([0.3, 0.6, -0.2, 1.3, 0.4, -0.8, 0.2]),
}
X_WB = RigidTransform(RollPitchYaw(0.4, -0.3, 1.2), [0.3, -0.5, 0.2])
X_TE = RigidTransform(RollPitchYaw(0.2, 0.5, -0.3), [0.02, -0.01, 0.13])


def arm_urdf(
    joints: int = 6,
    *,
    name: str = "arm",
    actuator_order: list[int] | None = None,
    from_hand: bool = False,
    effort: float = 400.0,
) -> str:
    """Returns an arm with links `base`, `link1` … and joints `joint1` …; the last link carries.

    Args:
        joints: how many, up to seven.
        name: of the model.
        actuator_order: numbers of the joints in the order of their actuators; none by default
            leaves the joints' own order.
        from_hand: declare every joint from the hand's side to the base's.
        effort: limit of every actuator [Nm].
    """
    table = (SIX if joints <= 6 else SEVEN)[:joints]
    links = ["base", *(f"link{k + 1}" for k in range(joints))]
    masses = [10.0, *(row[3] for row in table)]
    text = "".join(_link(*pair) for pair in zip(links, masses, strict=True))
    for k, (xyz, rpy, axis, _) in enumerate(table):
        ends = links[k], links[k + 1]
        text += _joint(
            f"joint{k + 1}", *(ends[::-1] if from_hand else ends), xyz, rpy, axis, effort
        )
    for k in range(1, joints + 1) if actuator_order is None else actuator_order:
        text += _transmission(k)
    return f'<?xml version="1.0"?><robot name="{name}">{text}</robot>'


def _link(name: str, mass: float) -> str:
    xx, yy, zz = mass * np.array([0.004, 0.005, 0.003])
    return f"""<link name="{name}"><inertial><origin xyz="0.03 0.01 0.06"/><mass value="{mass}"/>
        <inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="{0.1 * xx}" ixz="0" iyz="{0.05 * xx}"/>
        </inertial></link>"""


def _joint(name, parent, child, xyz, rpy, axis, effort) -> str:
    return f"""<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>
        <origin xyz="{" ".join(map(str, xyz))}" rpy="{" ".join(map(str, rpy))}"/>
        <axis xyz="{" ".join(map(str, axis))}"/><dynamics damping="{0.3 * int(name[5:])}"/>
        <limit effort="{effort}" lower="-3" upper="3" velocity="5"/></joint>"""


def _transmission(k: int) -> str:
    return f"""<transmission><type>transmission_interface/SimpleTransmission</type>
        <joint name="joint{k}"/><actuator name="motor{k}"><drake:rotor_inertia value="0.0001"/>
        <drake:gear_ratio value="{40 + 10 * k}"/></actuator></transmission>"""


@dataclass
class ArmPlant:
    """A finalized plant with one of these arms, its wrist weld and E in the tool."""

    plant: MultibodyPlant
    arm: ModelInstanceIndex
    wrist: WeldJoint
    E: Frame
    posture: np.ndarray

    @property
    def num_joints(self) -> int:
        return len(self.posture)


def add_arm(plant: MultibodyPlant, joints: int = 6, name: str = "arm", X_WB=X_WB, **options):
    """Adds an arm with its base welded to the world; returns its instance and its last link."""
    urdf = arm_urdf(joints, name=name, **options)
    (arm,) = Parser(plant).AddModelsFromString(urdf, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base", arm), X_WB)
    return arm, plant.GetBodyByName(f"link{joints}", arm)


def make_arm_plant(
    plant: MultibodyPlant | None = None,
    joints: int = 6,
    *,
    company: bool = False,
    gravity: bool = True,
    **options,
) -> ArmPlant:
    """Puts an arm with a tool of another instance on its wrist into a plant, and finalizes it.

    Args:
        plant: where; a discrete one at 1 ms by default.
        joints: six or seven.
        company: also a free body, another arm, and fingers with joints on the tool.
        gravity: whether the arm and what it carries have weight.
        options: of `add_arm`.
    """
    plant = plant or MultibodyPlant(1e-3)
    if company:
        _add_free_body(plant)
        add_arm(plant, 6, "other", RigidTransform([3.0, 0.0, 0.0]))
    arm, hand = add_arm(plant, joints, **options)
    wrist, E = add_tool(plant, hand)
    if company:
        _add_fingers(plant, E)
    for name in () if gravity else ("arm", "tool", *(["gripper"] if company else [])):
        plant.set_gravity_enabled(plant.GetModelInstanceByName(name), False)
    plant.Finalize()
    plant.SetDefaultPositions(arm, POSTURES[joints])
    return ArmPlant(plant, arm, wrist, E, POSTURES[joints])


def add_tool(plant: MultibodyPlant, hand) -> tuple[WeldJoint, Frame]:
    """Welds a lopsided tool to the hand; returns the weld and E."""
    instance = plant.AddModelInstance("tool")
    inertia = SpatialInertia.SolidBoxWithMass(1.4, 0.06, 0.1, 0.2).Shift([-0.01, 0.02, -0.07])
    tool = plant.AddRigidBody("tool", instance, inertia)
    X_HT = RigidTransform(RollPitchYaw(0.3, 0.1, -0.6), [0.05, 0.01, 0.02])
    wrist = plant.AddJoint(WeldJoint("wrist", hand.body_frame(), tool.body_frame(), X_HT))
    return wrist, plant.AddFrame(FixedOffsetFrame("E", tool.body_frame(), X_TE, instance))


def _add_free_body(plant: MultibodyPlant) -> None:
    instance = plant.AddModelInstance("ball")
    plant.AddRigidBody("ball", instance, SpatialInertia.SolidSphereWithMass(3.0, 0.1))
    plant.set_gravity_enabled(instance, False)


def _add_fingers(plant: MultibodyPlant, E: Frame) -> None:
    instance = plant.AddModelInstance("gripper")
    for k, side in enumerate((-1.0, 1.0)):
        finger = plant.AddRigidBody(
            f"finger{k}", instance, SpatialInertia.SolidBoxWithMass(0.3, 0.02, 0.02, 0.08)
        )
        place = plant.AddFrame(
            FixedOffsetFrame(f"place{k}", E, RigidTransform([0.0, side * 0.05, 0.02]), instance)
        )
        kind = PrismaticJoint if k else RevoluteJoint
        plant.AddJoint(kind(f"slide{k}", place, finger.body_frame(), [0.0, 1.0, 0.0]))


def lock_fingers(rig: ArmPlant, context: Context) -> None:
    """Locks the joints of the gripper, which the controller takes for locked."""
    for index in rig.plant.GetJointIndices(rig.plant.GetModelInstanceByName("gripper")):
        if (joint := rig.plant.get_joint(index)).num_velocities():
            joint.Lock(context)


def relative_error(value: np.ndarray, expected: np.ndarray) -> float:
    return float(np.linalg.norm(value - expected) / np.linalg.norm(expected))
