"""An arm of the cell under control, driven to its limits: exact model, ideal sensor."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import ExternallyAppliedSpatialForce, MultibodyPlant
from pydrake.multibody.tree import JointActuatorIndex
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from signal_sources import Source, fixed_step

from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.impedance_controller import make_impedance_controller
from geoimp_drake.models import model_path, package_map
from geoimp_drake.parts.joint_limits import Limited
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.frame_motion import frame_motion_at_rest

POSTURES = {
    6: np.array([0.1225, -0.3789, 1.0966, 0.0, -0.7177, -1.4483]),
    7: np.array([0.2, 0.1225, -0.3789, 1.0966, 0.3, -0.7177, -1.4483]),
}


@dataclass
class Driven:
    """What a run has left, a row a step."""

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    E: np.ndarray  # motion of E
    C: np.ndarray
    u: np.ndarray
    limited: np.ndarray
    plant: MultibodyPlant

    def distance(self) -> np.ndarray:
        """Returns that of E from C [m]."""
        return np.linalg.norm(self.E[:, 4:7] - self.C[:, 4:7], axis=1)

    def angle(self) -> np.ndarray:
        """Returns that of E from C [deg]."""
        cosine = np.abs(np.sum(self.E[:, :4] * self.C[:, :4], axis=1)).clip(0, 1)
        return np.degrees(2 * np.arccos(cosine))

    def effort(self) -> float:
        """Returns the largest torque as a share of the limits."""
        plant = self.plant
        limits = [
            plant.get_joint_actuator(JointActuatorIndex(k)).effort_limit()
            for k in range(plant.num_actuators())
        ]
        return float((np.abs(self.u) / limits).max())

    def speed(self) -> float:
        """Returns the largest joint speed as a share of the limits."""
        return float((np.abs(self.v) / self.plant.GetVelocityUpperLimits()).max())

    def stays_inside(self) -> bool:
        low, high = self.plant.GetPositionLowerLimits(), self.plant.GetPositionUpperLimits()
        return bool((low <= self.q).all() and (self.q <= high).all())

    def __str__(self) -> str:
        fields = Limited.get_fields()[:4]
        acted = [name for k, name in enumerate(fields) if self.limited[:, k].any()]
        return (
            f"E-C {1e3 * self.distance().max():.2f} mm {self.angle().max():.3f}° end "
            f"{1e3 * self.distance()[-1]:.3f} mm, effort {self.effort():.4g}, speed "
            f"{self.speed():.3f}, inside {self.stays_inside()}, {acted}"
        )


class _Push(LeafSystem):
    """Pushes E with a force and a moment [moment; force] in W."""

    def __init__(self, plant: MultibodyPlant, wrench: Callable[[float], np.ndarray]):
        super().__init__()
        E = plant.GetFrameByName("flange")

        def calc(context, output) -> None:
            push = ExternallyAppliedSpatialForce()
            push.body_index = E.body().index()
            push.p_BoBq_B = E.GetFixedPoseInBodyFrame().translation()
            F = wrench(context.get_time())
            push.F_Bq_W = SpatialForce(F[:3], F[3:])
            output.set_value([push])

        self.DeclareAbstractOutputPort(
            "push", lambda: AbstractValue.Make([ExternallyAppliedSpatialForce()]), calc
        )


def arm_plant(joints: int = 6, effort: float = 1.0) -> MultibodyPlant:
    """Returns a finalized plant of an arm of the cell, its effort limits multiplied."""
    plant = MultibodyPlant(1e-3)
    name = {6: "six_joint_arm", 7: "seven_joint_arm"}[joints]
    parser = Parser(plant)
    parser.package_map().AddMap(package_map())
    (arm,) = parser.AddModels(model_path(name))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName({6: "base", 7: "rail"}[joints], arm))
    for k in range(plant.num_actuators()):
        actuator = plant.get_joint_actuator(JointActuatorIndex(k))
        actuator.set_effort_limit(effort * actuator.effort_limit())
    plant.Finalize()
    return plant


def step(t: float, begin: float, duration: float) -> np.ndarray:
    """Returns a smooth step from zero to one, and its two derivatives."""
    s = np.clip((t - begin) / duration, 0.0, 1.0)
    speed = 30 * (s * (1 - s)) ** 2 / duration
    return np.array(
        [s**3 * (10 - 15 * s + 6 * s * s), speed, 60 * s * (1 - s) * (1 - 2 * s) / duration**2]
    )


def there_and_back(X: RigidTransform, shift, turn, duration: float, back: float):
    """Returns the motion of D that leaves X at 0.1 s and comes back, as a function of time.

    Args:
        X: where D starts.
        shift: how far it goes, in W [m].
        turn: rotation vector of how far it turns, in W [rad].
        duration: of the way there and of the way back [s].
        back: when it comes back, at most after a second way [s].
    """
    still, shift, turn = frame_motion_at_rest(X), np.array(shift), np.array(turn, dtype=float)

    def motion(t: float) -> np.ndarray:
        way = step(t, 0.1, duration) - step(t, back, duration)
        moved = still.copy()
        moved[:4] = quaternion.product(quaternion.exp(way[0] * turn), still[:4])
        moved[4:7] += way[0] * shift
        moved[7:10], moved[10:13] = way[1] * turn, way[1] * shift
        moved[13:16], moved[16:19] = way[2] * turn, way[2] * shift
        return moved

    return motion


def pushed(force, until: float, duration: float = 0.2) -> Callable[[float], np.ndarray]:
    """Returns a push [moment; force] that comes at 0.1 s and goes, as a function of time."""
    push = np.concatenate((np.zeros(3), force))
    return lambda t: push * (step(t, 0.1, duration) - step(t, until, duration))[0]


def outward(X: RigidTransform) -> np.ndarray:
    """Returns the horizontal direction away from the arm's axis."""
    direction = X.translation() * [1, 1, 0]
    return direction / np.linalg.norm(direction)


def pose_at(plant: MultibodyPlant, q: np.ndarray) -> RigidTransform:
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, q)
    return plant.GetFrameByName("flange").CalcPoseInWorld(context)


def drive(
    plant: MultibodyPlant,
    config: ImpedanceControllerConfig,
    q: np.ndarray,
    duration: float,
    desired: Callable[[float], np.ndarray] | None = None,
    push: Callable[[float], np.ndarray] = lambda t: np.zeros(6),
) -> Driven:
    """Drives an arm from rest; D rests on E by default, `push` is by the world on E."""
    builder, still = DiagramBuilder(), frame_motion_at_rest(pose_at(plant, q))
    own = builder.AddSystem(plant)
    E = own.GetFrameByName("flange")
    arm = E.model_instance()
    controller = builder.AddSystem(make_impedance_controller(own, arm, E, config))
    pushing = builder.AddSystem(_Push(own, push))
    felt = builder.AddSystem(Source(lambda t: -push(t)))
    wanted = builder.AddSystem(Source(desired or (lambda t: still)))
    for output, target in (
        (own.get_state_output_port(arm), controller.GetInputPort("estimated_state")),
        (felt.get_output_port(), controller.GetInputPort("wrench")),
        (wanted.get_output_port(), controller.GetInputPort("desired_motion")),
        (controller.GetOutputPort("actuation"), own.get_actuation_input_port(arm)),
        (pushing.get_output_port(), own.get_applied_spatial_force_input_port()),
    ):
        builder.Connect(output, target)
    simulator = fixed_step(builder.Build())
    root = simulator.get_mutable_context()
    own.SetPositions(own.GetMyMutableContextFromRoot(root), q)
    ports = ["measured_motion", "compliant_motion", "actuation"]
    if config.limits is not None:
        ports.append("limited")
    rows = []

    def look(root) -> None:
        x = own.GetPositionsAndVelocities(own.GetMyContextFromRoot(root))
        context = controller.GetMyContextFromRoot(root)
        values = [controller.GetOutputPort(port).Eval(context).copy() for port in ports]
        rows.append((root.get_time(), x[: own.num_positions()], x[own.num_positions() :], *values))

    simulator.set_monitor(look)
    simulator.AdvanceTo(duration)
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    if config.limits is None:
        columns.append(np.zeros((len(rows), len(Limited.get_fields()))))
    return Driven(*columns, own)
