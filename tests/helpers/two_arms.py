"""Our two arms facing each other along y with empty hands, under the cooperative controller.

Frames: W world, E the end effectors, 0.25 m beyond the flanges.
"""

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, Frame, ModelInstanceIndex, RigidBody
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, System
from pydrake.systems.primitives import ConstantVectorSource
from signal_sources import Signal, Source, fixed_step

from geoimp_drake.controllers.cooperative_config import CooperativeControllerConfig
from geoimp_drake.controllers.cooperative_controller import make_cooperative_controller
from geoimp_drake.diagrams.scene.cell import FLANGE
from geoimp_drake.models import dh_to_joint, package_map
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.frame_motion import POSITION, QUATERNION

# Denavit-Hartenberg angles that hold a bar in front of the arm, from its table of postures [deg].
POSTURE = dh_to_joint(np.deg2rad([8.82, 54.84, -47.57, 8.89, 82.81, 178.88]))
TRACK = 0.05  # [m]
FORMS = ("compiled", "blocks")  # of the controller
MODELS = {6: ("six_joint_arm.urdf", "base"), 7: ("seven_joint_arm.urdf", "rail")}
# The first faces +y, the second −y.
BASES = (
    RigidTransform(RollPitchYaw(0.0, 0.0, np.pi / 2), [0.0, 0.0, 0.0]),
    RigidTransform(RollPitchYaw(0.0, 0.0, -np.pi / 2), [0.0, 3.2, 0.0]),
)


@dataclass
class ArmPair:
    """Two arms in a finalized plant, and where their hands are at the start."""

    plant: MultibodyPlant
    arms: tuple[ModelInstanceIndex, ModelInstanceIndex]
    frames: tuple[Frame, Frame]
    postures: tuple[np.ndarray, np.ndarray]

    def controller(self, config: CooperativeControllerConfig | None = None, **options) -> System:
        return make_cooperative_controller(self.plant, self.arms, self.frames, config, **options)


def add_arms(
    plant: MultibodyPlant,
    joints: tuple[int, int] = (7, 6),
    parallel: bool = True,
    carried: RigidBody | None = None,
) -> ArmPair:
    """Adds the arms and finalizes the plant.

    Args:
        plant: where.
        joints: of both arms.
        parallel: the end-effector frames are parallel to W at the start. Otherwise their z axes
            point out of the flanges, towards each other, and ϑ_21 is π.
        carried: a body that is welded to the first hand.
    """
    arms, frames, postures = [], [], []
    for k in range(2):
        arm = _add_arm(plant, k, joints[k])
        q = POSTURE if joints[k] == 6 else np.append(TRACK, POSTURE)
        flange = plant.GetFrameByName(FLANGE, arm)
        R_FE = _rotation_in_flange(k, joints[k], q) if parallel else RotationMatrix()
        X_FE = RigidTransform(R_FE, [0.0, 0.0, 0.25])
        frames.append(plant.AddFrame(FixedOffsetFrame(f"E{k + 1}", flange, X_FE, arm)))
        arms.append(arm)
        postures.append(q)
    if carried is not None:
        plant.WeldFrames(frames[0], carried.body_frame())
    plant.Finalize()
    for arm, q in zip(arms, postures, strict=True):
        plant.SetDefaultPositions(arm, q)
    return ArmPair(plant, tuple(arms), tuple(frames), tuple(postures))


def _add_arm(plant: MultibodyPlant, k: int, joints: int) -> ModelInstanceIndex:
    parser = Parser(plant, "first" if k == 0 else "second")
    parser.package_map().AddMap(package_map())
    file, base = MODELS[joints]
    (arm,) = parser.AddModels(url=f"package://geoimp_models/{file}")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(base, arm), BASES[k])
    return arm


def _rotation_in_flange(k: int, joints: int, q: np.ndarray) -> RotationMatrix:
    """Returns the rotation of W seen from the flange at the start."""
    plant = MultibodyPlant(0.0)
    arm = _add_arm(plant, k, joints)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, arm, q)
    return plant.GetFrameByName(FLANGE, arm).CalcPoseInWorld(context).rotation().inverse()


@dataclass
class ControlledPair:
    """A simulator of both arms with empty hands; nothing is felt, so the wrenches are zero."""

    pair: ArmPair
    controller: System
    simulator: Simulator

    def read(self, port: str) -> np.ndarray:
        context = self.controller.GetMyContextFromRoot(self.simulator.get_context())
        return self.controller.GetOutputPort(port).Eval(context).copy()

    def true_pose(self, k: int) -> RigidTransform:
        context = self.pair.plant.GetMyContextFromRoot(self.simulator.get_context())
        return self.pair.frames[k].CalcPoseInWorld(context)

    def tracking_error(self) -> tuple[float, float]:
        """The largest distance [m] and angle [rad] of a hand from its reference."""
        distance, angle = 0.0, 0.0
        for k in range(2):
            X, reference = self.true_pose(k), self.read(f"reference_motion_{k + 1}")
            Q = quaternion.from_rotation(X.rotation().matrix())
            away = np.linalg.norm(X.translation() - reference[POSITION])
            turn = quaternion.log(quaternion.relative(reference[QUATERNION], Q))
            distance, angle = max(distance, away), max(angle, np.linalg.norm(turn))
        return float(distance), float(angle)


def make_controlled_pair(
    desired: Signal,
    config: CooperativeControllerConfig | None = None,
    wrenches: tuple[Signal, Signal] | None = None,
    **options,
) -> ControlledPair:
    """Wires plant and controller as a user would, without sensors.

    Args:
        desired: motion of D over time.
        config: of the controller.
        wrenches: what the hands pretend to feel; nothing by default.
        options: of `add_arms`.
    """
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    pair = add_arms(plant, **options)
    controller = builder.AddSystem(pair.controller(config))
    nothing = ConstantVectorSource(np.zeros(6))
    for k, arm in enumerate(pair.arms):
        wrench = builder.AddSystem(nothing.Clone() if wrenches is None else Source(wrenches[k]))
        state = plant.get_state_output_port(arm)
        builder.Connect(state, controller.GetInputPort(f"estimated_state_{k + 1}"))
        builder.Connect(wrench.get_output_port(), controller.GetInputPort(f"wrench_{k + 1}"))
        builder.Connect(
            controller.GetOutputPort(f"actuation_{k + 1}"), plant.get_actuation_input_port(arm)
        )
    source = builder.AddSystem(Source(desired))
    builder.Connect(source.get_output_port(), controller.GetInputPort("desired_motion"))
    return ControlledPair(pair, controller, fixed_step(builder.Build()))
