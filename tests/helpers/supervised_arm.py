"""A moving arm in a diagram, with or without a supervisor, whose signals may go wrong."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from driven_arm import gains, make_plant
from pydrake.common.value import AbstractValue
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce, MultibodyPlant
from pydrake.multibody.tree import Frame
from pydrake.systems.framework import DiagramBuilder, LeafSystem, OutputPort
from signal_sources import Source, constant, fixed_step

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.impedance_controller import make_impedance_controller
from geoimp_drake.systems.sources.desired_motion import DesiredMotion, MotionSegment
from geoimp_drake.systems.supervisor import Supervisor, SupervisorConfig, SupervisorLimits

CONFIG = SupervisorConfig(limits=SupervisorLimits(torque_rate=1000.0), soft_start=0.1)
MOVE = MotionSegment(0.8, [0.0, 0.0, -0.08])

# What becomes of a signal at a time.
Change = Callable[[float, np.ndarray], np.ndarray]


def unchanged(t: float, value: np.ndarray) -> np.ndarray:
    return value


@dataclass
class Changes:
    """What becomes of the signals on their way."""

    D: Change = unchanged
    wrench: Change = unchanged
    state: Change = unchanged
    valid: Callable[[float], np.ndarray] = field(default_factory=lambda: constant(np.ones(1)))


@dataclass
class Run:
    """What was sampled at each tick; `force` is that on the wall."""

    mode: np.ndarray
    E: np.ndarray
    D: np.ndarray
    torque: np.ndarray
    force: np.ndarray
    effort_limits: np.ndarray


class Wall(LeafSystem):
    """A spring under the hand: pushes E up, and says what a wrist sensor would."""

    def __init__(self, plant: MultibodyPlant, E: Frame, height: float, stiffness: float = 5e3):
        super().__init__()
        self._plant, self._E, self._height, self._stiffness = plant, E, height, stiffness
        self._context = plant.CreateDefaultContext()
        self.DeclareVectorInputPort("state", plant.num_multibody_states())
        push = AbstractValue.Make([ExternallyAppliedSpatialForce()])
        self.DeclareAbstractOutputPort("push", push.Clone, self._push)
        self.DeclareVectorOutputPort("wrench", 6, self._sense)

    def _force(self, context) -> float:
        self._plant.SetPositionsAndVelocities(self._context, self.get_input_port().Eval(context))
        z = self._E.CalcPoseInWorld(self._context).translation()[2]
        return self._stiffness * max(self._height - z, 0.0)

    def _push(self, context, value) -> None:
        push = ExternallyAppliedSpatialForce()
        push.body_index = self._E.body().index()
        push.p_BoBq_B = self._E.GetFixedPoseInBodyFrame().translation()
        push.F_Bq_W = SpatialForce(np.zeros(3), np.array([0.0, 0.0, self._force(context)]))
        value.set_value([push])

    def _sense(self, context, value) -> None:
        value.SetFromVector([0.0, 0.0, 0.0, 0.0, 0.0, -self._force(context)])


class Changed(LeafSystem):
    """A signal on its way."""

    def __init__(self, size: int, change: Change):
        super().__init__()
        port = self.DeclareVectorInputPort("in", size)

        def calc(context, value) -> None:
            value.SetFromVector(change(context.get_time(), port.Eval(context).copy()))

        self.DeclareVectorOutputPort("out", size, calc)


def run_arm(
    changes: Changes,
    *,
    move: MotionSegment = MOVE,
    wall: float = np.inf,
    duration: float = 0.6,
    config: SupervisorConfig = CONFIG,
    is_supervised: bool = True,
) -> Run:
    """Runs a moving arm.

    Args:
        changes: to its signals.
        move: of D.
        wall: below E at the start [m].
        duration: of the run [s].
        config: of the supervisor.
        is_supervised: whether there is one.
    """
    builder = DiagramBuilder()
    plant, arm, E = make_plant(builder, "light7")
    context = plant.CreateDefaultContext()
    motion = DesiredMotion(E.CalcPoseInWorld(context), [move])
    weight = plant.MakeActuationMatrix().T @ -plant.CalcGravityGeneralizedForces(context)
    model = ControlModel.of_arm(plant, arm, E)
    limits = model.effort_limits[model.actuation_order]
    ground = builder.AddSystem(
        Wall(plant, E, E.CalcPoseInWorld(context).translation()[2] - wall if wall < 1 else -10.0)
    )
    builder.Connect(plant.get_state_output_port(), ground.get_input_port())
    builder.Connect(ground.GetOutputPort("push"), plant.get_applied_spatial_force_input_port())

    def on_its_way(port: OutputPort, change: Change) -> OutputPort:
        system = builder.AddSystem(Changed(port.size(), change))
        builder.Connect(port, system.get_input_port())
        return system.get_output_port()

    def source(signal) -> OutputPort:
        return builder.AddSystem(Source(signal)).get_output_port()

    controller = builder.AddNamedSystem(
        "controller", make_impedance_controller(plant, arm, E, gains())
    )
    signals = {
        "desired_motion": source(lambda t: changes.D(t, motion.evaluate(t))),
        "wrench": on_its_way(ground.GetOutputPort("wrench"), changes.wrench),
        "estimated_state": on_its_way(plant.get_state_output_port(arm), changes.state),
    }
    torque = controller.GetOutputPort("actuation")
    modes = None
    if is_supervised:
        supervisor = builder.AddNamedSystem("supervisor", Supervisor(limits, config))
        others = {
            "measured_torque": source(constant(weight)),
            "valid": source(changes.valid),
            "stop": source(constant(np.zeros(1))),
            "torque": torque,
            "measured_motion": controller.GetOutputPort("measured_motion"),
            "compliant_motion": controller.GetOutputPort("compliant_motion"),
        }
        for name, port in (signals | others).items():
            builder.Connect(port, supervisor.GetInputPort(name))
        signals = {
            "desired_motion": supervisor.GetOutputPort("supervised_motion"),
            "wrench": supervisor.GetOutputPort("supervised_wrench"),
            "estimated_state": supervisor.GetOutputPort("supervised_state"),
        }
        torque, modes = supervisor.GetOutputPort("supervised_torque"), supervisor
    for name, port in signals.items():
        builder.Connect(port, controller.GetInputPort(name))
    builder.Connect(torque, plant.get_actuation_input_port(arm))
    simulator = fixed_step(builder.Build())  # which refuses an algebraic loop
    rows = []

    def evaluated(port: OutputPort, root) -> np.ndarray:
        return port.Eval(port.get_system().GetMyContextFromRoot(root)).copy()

    def sent(root) -> np.ndarray:
        """What the plant got in its last step, where a supervisor keeps it."""
        if not modes or root.get_time() == 0.0:
            return evaluated(torque, root)
        memory = modes.GetMyContextFromRoot(root).get_discrete_state(0).CopyToVector()
        return memory[modes.part.memory.sent]

    def monitor(root):
        true = plant.GetMyContextFromRoot(root)
        V = E.CalcSpatialVelocityInWorld(true)
        pose = E.CalcPoseInWorld(true)
        Q = pose.rotation().ToQuaternion().wxyz()
        E_motion = np.concatenate(
            (Q, pose.translation(), V.rotational(), V.translational(), np.zeros(6))
        )
        rows.append(
            (
                evaluated(modes.GetOutputPort("mode"), root)[0] if modes else np.nan,
                E_motion,
                evaluated(signals["desired_motion"], root),
                sent(root),
                -evaluated(ground.GetOutputPort("wrench"), root)[5],
            )
        )

    simulator.set_monitor(monitor)
    simulator.AdvanceTo(duration)
    return Run(*(np.array(column) for column in zip(*rows, strict=True)), limits)
