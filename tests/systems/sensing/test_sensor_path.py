"""Along a path of joints a frame is and moves as the plant says, and so do the sensors."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BallRpyJoint,
    FixedOffsetFrame,
    PrismaticJoint,
    QuaternionFloatingJoint,
    RevoluteJoint,
    SpatialInertia,
    WeldJoint,
)
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from geoimp_drake import add_wrist_sensor
from geoimp_drake.arm.kinematic_tree import path_to
from geoimp_drake.controllers import wrist_sensor
from geoimp_drake.laws.dynamics.path_motion import pose_along
from geoimp_drake.parts.wrist_sensor_config import WristSensorConfig
from geoimp_drake.systems.sensing.frame_motion_sensor import FrameMotionSensor


def pose(k: float) -> RigidTransform:
    return RigidTransform(RollPitchYaw(0.3 * k, -0.2 * k, 0.5), [0.1, 0.2 * k, -0.1])


def branching_plant(
    *, reversed_weld: bool = False, ball: bool = False, time_step: float = 1e-3
) -> MultibodyPlant:
    """A track, two hinges and a weld between offset frames, beside another arm."""
    plant = MultibodyPlant(time_step)
    inertia = SpatialInertia.SolidSphereWithMass(1.0, 0.1)
    names = ("other", "track", "upper", "lower", "tool")
    other, track, upper, lower, tool = (plant.AddRigidBody(name, inertia) for name in names)
    world = plant.world_frame()

    def offset(body, k: float):
        return plant.AddFrame(FixedOffsetFrame(f"{body.name()}_{k}", body.body_frame(), pose(k)))

    # The other arm's joint comes first: the path's joints do not begin q.
    plant.AddJoint(RevoluteJoint("beside", world, other.body_frame(), [0.0, 0.0, 1.0]))
    plant.AddJoint(PrismaticJoint("along", world, offset(track, 1.0), [0.6, 0.0, 0.8]))
    hinge = [0.0, 0.6, 0.8]
    plant.AddJoint(RevoluteJoint("shoulder", offset(track, 2.0), offset(upper, 3.0), hinge))
    ends = offset(upper, 4.0), offset(lower, 5.0)
    joint = BallRpyJoint("elbow", *ends) if ball else RevoluteJoint("elbow", *ends, [1.0, 0, 0])
    plant.AddJoint(joint)
    grip = offset(lower, 6.0), offset(tool, 7.0)
    plant.AddJoint(WeldJoint("grip", *(grip[::-1] if reversed_weld else grip), pose(8.0)))
    plant.Finalize()
    return plant


@pytest.mark.parametrize("reversed_weld", [False, True])
def test_pose_is_the_plants(reversed_weld: bool) -> None:
    plant = branching_plant(reversed_weld=reversed_weld)
    context, rng = plant.CreateDefaultContext(), np.random.default_rng(0)
    for name in ("world", "track", "lower", "tool"):
        body = plant.GetBodyByName(name)
        path = path_to(plant, body.body_frame())
        assert path is not None
        for _ in range(5):
            plant.SetPositionsAndVelocities(context, rng.uniform(-2.0, 2.0, 8))
            x = plant.GetPositionsAndVelocities(context)
            X_WB = plant.EvalBodyPoseInWorld(context, body).GetAsMatrix34()
            np.testing.assert_allclose(pose_along(path, x), X_WB, atol=1e-14)


def swinging_slider() -> MultibodyPlant:
    """A free body, and beside it a hinge that turns a slider, which turns another hinge."""
    plant = MultibodyPlant(0.0)
    inertia = SpatialInertia.SolidSphereWithMass(1.0, 0.1)
    free, arm, slider, hand = (plant.AddRigidBody(f"body{k}", inertia) for k in range(4))
    frames = [
        plant.AddFrame(FixedOffsetFrame(f"out{k}", body.body_frame(), pose(k + 1.0)))
        for k, body in enumerate((arm, slider, hand))
    ]
    # It comes first and has a quaternion: the path's places in q and in v differ.
    plant.AddJoint(QuaternionFloatingJoint("free", plant.world_frame(), free.body_frame()))
    axis = [0.6, 0.0, 0.8]
    plant.AddJoint(RevoluteJoint("swing", plant.world_frame(), arm.body_frame(), axis))
    plant.AddJoint(PrismaticJoint("slide", frames[0], slider.body_frame(), [0.0, 0.6, 0.8]))
    plant.AddJoint(RevoluteJoint("twist", frames[1], hand.body_frame(), [1.0, 0.0, 0.0]))
    plant.Finalize()
    assert plant.GetJointByName("swing").position_start() == 7
    return plant


@pytest.mark.parametrize(
    ("make", "frames", "fastest"),
    [
        (lambda: branching_plant(time_step=0.0), ("track_2.0", "lower_6.0", "tool_7.0"), 2.0),
        (swinging_slider, ("out0", "out1", "out2"), 9.0),
    ],
    ids=["branching", "slider"],
)
def test_motion_is_the_plants(make, frames, fastest: float) -> None:
    builder = DiagramBuilder()
    plant = builder.AddSystem(make())
    sensors = []
    for name in frames:
        frame = plant.GetFrameByName(name)
        for path in (path_to(plant, frame), None):
            sensor = builder.AddSystem(FrameMotionSensor(frame, path))
            for k in range(sensor.num_input_ports()):
                port = sensor.get_input_port(k)
                builder.Connect(plant.GetOutputPort(port.get_name()), port)
            sensors.append(sensor)
    diagram = builder.Build()
    root, rng = diagram.CreateDefaultContext(), np.random.default_rng(1)
    for _ in range(5):
        context = plant.GetMyMutableContextFromRoot(root)
        q = rng.uniform(-2.0, 2.0, plant.num_positions())
        v = rng.uniform(-fastest, fastest, plant.num_velocities())
        if len(q) > len(v):
            q[:4] /= np.linalg.norm(q[:4])
        plant.SetPositionsAndVelocities(context, np.append(q, v))
        motions = [
            sensor.get_output_port().Eval(sensor.GetMyContextFromRoot(root)) for sensor in sensors
        ]
        for along, listed in zip(motions[::2], motions[1::2], strict=True):
            listed[:4] *= np.sign(listed[:4] @ along[:4])
            np.testing.assert_allclose(along, listed, rtol=1e-10, atol=1e-10)
            assert np.abs(listed[13:]).max() > 1.0


def wrenches_on_the_way(config: WristSensorConfig) -> list[np.ndarray]:
    """Returns what the sensor of a swinging arm says, and what it would without errors."""
    builder = DiagramBuilder()
    plant = branching_plant()
    builder.AddSystem(plant)
    grip = plant.GetJointByName("grip")
    E = plant.GetBodyByName("tool").body_frame()
    sensor = add_wrist_sensor(builder, plant, grip, E, config)
    simulator = Simulator(builder.Build())
    root = simulator.get_mutable_context()
    plant.SetPositions(plant.GetMyMutableContextFromRoot(root), [0.3, 0.1, -0.7, 0.4])
    simulator.AdvanceTo(0.2)
    own = sensor.GetMyContextFromRoot(root)
    return [sensor.GetOutputPort(port).Eval(own).copy() for port in ("wrench", "wrench_true")]


@pytest.mark.parametrize("inertial_load", ["none", "plant"])
def test_the_sensor_says_the_same_with_a_path_and_without(monkeypatch, inertial_load: str) -> None:
    config = WristSensorConfig(inertial_load=inertial_load)
    along = wrenches_on_the_way(config)
    monkeypatch.setattr(wrist_sensor, "path_to", lambda plant, frame: None)
    for ours, others in zip(along, wrenches_on_the_way(config), strict=True):
        np.testing.assert_allclose(ours, others, atol=1e-11)
    assert (np.abs(along[0]).max() > 0.5) == (inertial_load == "none")


def test_other_joints_have_no_path() -> None:
    plant = branching_plant(ball=True)
    assert path_to(plant, plant.GetFrameByName("tool")) is None
    assert path_to(plant, plant.GetFrameByName("upper")) is not None
