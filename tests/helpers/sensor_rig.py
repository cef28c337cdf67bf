"""A wrist sensor by itself: between two bodies held in space, or fed with readings by hand."""

from dataclasses import dataclass, field

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ExternallyAppliedSpatialForce,
    MultibodyPlant,
)
from pydrake.multibody.tree import FixedOffsetFrame, JointIndex, SpatialInertia, WeldJoint
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from geoimp_drake.controllers.wrist_sensor import add_wrist_sensor
from geoimp_drake.parts.wrist_sensor_config import (
    SensorMounting,
    ToolLoad,
    WristSensorConfig,
)
from geoimp_drake.parts.wrist_sensors import PLANT_LISTS
from geoimp_drake.systems.sensing.force_torque_sensor import ForceTorqueSensor

# Frames: M the mount (held in W), S the sensor, T the tool's first body, E the end effector.
X_MT = RigidTransform(RollPitchYaw(0.3, -0.2, 0.5), [0.02, 0.01, 0.06])
X_TE = RigidTransform(RollPitchYaw(-0.4, 0.6, 0.2), [0.03, -0.02, 0.25])


@dataclass
class SensorRig:
    """A simulator of a held sensor with a tool of two welded bodies, 1.9 kg."""

    X_WM: RigidTransform
    config: WristSensorConfig = field(default_factory=WristSensorConfig)
    tool: ToolLoad | None = None
    from_hand: bool = False  # the weld is declared from the tool to the mount

    def __post_init__(self):
        builder = DiagramBuilder()
        self.plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
        joint, self.E = add_held_tool(self.plant, self.X_WM, self.from_hand)
        self.plant.Finalize()
        self.sensor = add_wrist_sensor(builder, self.plant, joint, self.E, self.config, self.tool)
        builder.ExportInput(self.plant.get_applied_spatial_force_input_port(), "external")
        self.simulator = Simulator(builder.Build())

    @property
    def plant_context(self):
        return self.plant.GetMyContextFromRoot(self.simulator.get_context())

    def hang(self, mass: float, p_TQ: np.ndarray) -> np.ndarray:
        """Hangs a weight on a point of the tool; returns the wrench h that it means."""
        force = ExternallyAppliedSpatialForce()
        force.body_index = self.E.body().index()
        force.p_BoBq_B = p_TQ
        weight = mass * self.plant.gravity_field().gravity_vector()
        force.F_Bq_W = SpatialForce(np.zeros(3), weight)
        port = self.simulator.get_system().GetInputPort("external")
        port.FixValue(self.simulator.get_mutable_context(), AbstractValue.Make([force]))
        X_WE = self.E.CalcPoseInWorld(self.plant_context)
        p_WQ = self.plant.EvalBodyPoseInWorld(self.plant_context, self.E.body()) @ p_TQ
        # The end effector exerts on the weight what the weight exerts on it, reversed.
        return -np.concatenate((np.cross(p_WQ - X_WE.translation(), weight), weight))

    def read(self, duration: float = 0.01) -> np.ndarray:
        self.simulator.AdvanceTo(self.simulator.get_context().get_time() + duration)
        context = self.sensor.GetMyContextFromRoot(self.simulator.get_context())
        return self.sensor.GetOutputPort("wrench").Eval(context)


def add_held_tool(plant: MultibodyPlant, X_WM: RigidTransform, from_hand: bool = False):
    """Adds mount and tool; returns the weld between them and E."""
    box = SpatialInertia.SolidBoxWithMass(1.4, 0.05, 0.08, 0.2).Shift([-0.02, 0.03, -0.09])
    mount, tool = plant.AddRigidBody("mount", box), plant.AddRigidBody("tool", box)
    disk = plant.AddRigidBody("disk", SpatialInertia.SolidSphereWithMass(0.5, 0.03))
    plant.WeldFrames(plant.world_frame(), mount.body_frame(), X_WM)
    plant.WeldFrames(tool.body_frame(), disk.body_frame(), RigidTransform([0.01, 0.02, 0.22]))
    ends = mount.body_frame(), tool.body_frame(), X_MT
    if from_hand:
        ends = tool.body_frame(), mount.body_frame(), X_MT.inverse()
    joint = plant.AddJoint(WeldJoint("wrist", *ends))
    return joint, plant.AddFrame(FixedOffsetFrame("E", tool.body_frame(), X_TE))


def random_attitudes(count: int, seed: int = 0) -> list[RigidTransform]:
    rng = np.random.default_rng(seed)
    poses = []
    for _ in range(count):
        Q = rng.standard_normal(4)
        w, x, y, z = Q / np.linalg.norm(Q)
        R = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        X = RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), rng.uniform(-1, 1, 3))
        poses.append(X)
    return poses


@dataclass
class FedSensor:
    """A sensor without a plant: E, S and W coincide, and its reaction force is given by hand."""

    config: WristSensorConfig

    def __post_init__(self):
        identity = RigidTransform()
        mounting = SensorMounting(
            joint=JointIndex(0),
            tool_body=1,
            X_TS=identity,
            X_TE=identity,
            gravity=np.zeros(3),
        )
        self.sensor = ForceTorqueSensor(mounting, ToolLoad(), self.config)
        self.sensor.set_name("sensor")
        self.simulator = Simulator(self.sensor)
        self.feed(np.zeros(6))
        for name, kind in PLANT_LISTS.items():
            if name != "reaction_forces":  # nothing moves
                at_rest = AbstractValue.Make(
                    [identity] * 2 if kind is RigidTransform else [kind.Zero()] * 2
                )
                self.sensor.GetInputPort(name).FixValue(self.context, at_rest)

    @property
    def context(self):
        return self.simulator.get_mutable_context()

    def feed(self, reaction: np.ndarray) -> None:
        value = AbstractValue.Make([SpatialForce(np.asarray(reaction, dtype=float))])
        self.sensor.GetInputPort("reaction_forces").FixValue(self.context, value)

    def read(self, port: str = "wrench") -> np.ndarray:
        return self.sensor.GetOutputPort(port).Eval(self.context).copy()

    def samples(self, count: int) -> np.ndarray:
        """Returns the wrench after each of the next samples, one a row."""
        readings = []
        first = round(self.context.get_time() / self.config.period + 0.5)
        for k in range(first, first + count):
            # Half a period after a sample, away from the next one.
            self.simulator.AdvanceTo((k + 0.5) * self.config.period)
            readings.append(self.read())
        return np.array(readings)
