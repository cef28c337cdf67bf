"""The supervisor before and behind a controller in a diagram brakes the arm, and tells why."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from driven_arm import gains, make_plant
from pydrake.systems.framework import DiagramBuilder
from signal_sources import Source, constant, fixed_step

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.impedance_controller import make_impedance_controller
from geoimp_drake.laws.frame_motion import LINEAR_VELOCITY, POSITION
from geoimp_drake.systems.sources.desired_motion import DesiredMotion, MotionSegment
from geoimp_drake.systems.supervisor import Mode, Supervisor, SupervisorConfig, SupervisorLimits

BEGIN = 0.3  # when something happens [s]
CONFIG = SupervisorConfig(limits=SupervisorLimits(torque_rate=1000.0), soft_start=0.1)
MOVE = MotionSegment(0.8, [0.0, 0.0, -0.08])

Change = Callable[[float, np.ndarray], np.ndarray]


@dataclass
class Run:
    """What was sampled at each tick."""

    mode: np.ndarray
    E: np.ndarray
    D: np.ndarray
    torque: np.ndarray


def supervised(change_D: Change, wrench: Callable[[float], np.ndarray]) -> Run:
    """Runs a moving arm for 0.6 s; the wrench is what a sensor says, nobody pushes."""
    builder = DiagramBuilder()
    plant, arm, E = make_plant(builder, "light7")
    context = plant.CreateDefaultContext()
    motion = DesiredMotion(E.CalcPoseInWorld(context), [MOVE])
    weight = plant.MakeActuationMatrix().T @ -plant.CalcGravityGeneralizedForces(context)
    controller = builder.AddSystem(make_impedance_controller(plant, arm, E, gains()))
    model = ControlModel.of_arm(plant, arm, E)
    limits = model.effort_limits[model.actuation_order]
    supervisor = builder.AddNamedSystem("supervisor", Supervisor(limits, CONFIG))
    sources = {
        "desired_motion": lambda t: change_D(t, motion.evaluate(t)),
        "wrench": wrench,
        "measured_torque": constant(weight),
        "valid": constant(np.ones(1)),
        "stop": constant(np.zeros(1)),
    }
    ports = {}
    for name, signal in sources.items():
        ports[name] = builder.AddSystem(Source(signal)).get_output_port()
    ports |= {
        name: controller.GetOutputPort(name) for name in ("measured_motion", "compliant_motion")
    }
    ports["torque"] = controller.GetOutputPort("actuation")
    for name, port in ports.items():
        builder.Connect(port, supervisor.GetInputPort(name))
    for source, target in (
        (plant.get_state_output_port(arm), controller.GetInputPort("estimated_state")),
        (ports["wrench"], controller.GetInputPort("wrench")),
        (supervisor.GetOutputPort("supervised_motion"), controller.GetInputPort("desired_motion")),
        (supervisor.GetOutputPort("supervised_torque"), plant.get_actuation_input_port(arm)),
    ):
        builder.Connect(source, target)
    simulator = fixed_step(builder.Build())  # which refuses an algebraic loop
    rows = []

    def monitor(root):
        own, its = supervisor.GetMyContextFromRoot(root), controller.GetMyContextFromRoot(root)
        rows.append(
            (
                supervisor.GetOutputPort("mode").Eval(own)[0],
                controller.GetOutputPort("measured_motion").Eval(its).copy(),
                supervisor.GetOutputPort("supervised_motion").Eval(own).copy(),
                supervisor.GetOutputPort("supervised_torque").Eval(own).copy(),
            )
        )

    simulator.set_monitor(monitor)
    simulator.AdvanceTo(0.6)
    return Run(*(np.array(column) for column in zip(*rows, strict=True)))


def jumped(t: float, D: np.ndarray) -> np.ndarray:
    if t >= BEGIN - 1e-9:
        D[POSITION] += [0.1, 0.0, 0.0]
    return D


def faster(t: float, D: np.ndarray) -> np.ndarray:
    if t >= BEGIN - 1e-9:
        D[LINEAR_VELOCITY] += [0.0, 0.5, 0.0]
    return D


def unchanged(t: float, D: np.ndarray) -> np.ndarray:
    return D


def hit(t: float) -> np.ndarray:
    struck = BEGIN - 1e-9 <= t < BEGIN + 4e-3
    return np.array([0.0, 0.0, 0.0, 0.0, 150.0 if struck else 0.0, 0.0])


@pytest.mark.parametrize(
    ("change_D", "wrench", "reason"),
    [
        (jumped, constant(np.zeros(6)), "desired step 0.1 m exceeds 0.01"),
        (faster, constant(np.zeros(6)), "desired speed step 0.5 m/s exceeds 0.02"),
        (unchanged, hit, "force 150 N exceeds 100"),
    ],
    ids=["D jumps", "D's velocity jumps", "hit"],
)
def test_an_arm_is_braked_for_what_exceeds_its_limit(change_D, wrench, reason, caplog):
    run = supervised(change_D, wrench)
    assert reason in caplog.text
    first = np.flatnonzero(run.mode == Mode.BRAKE)[0]
    assert first == pytest.approx(round(BEGIN * 1e3), abs=2)
    assert [Mode(int(m)) for m in run.mode[[50, 200, -1]]] == [
        Mode.SOFT_START,
        Mode.RUN,
        Mode.STOPPED,
    ]
    # The controller never sees the jump; D comes to rest where its motion leads it.
    speed = np.linalg.norm(run.D[first - 5, LINEAR_VELOCITY])
    assert speed > 0.1
    assert np.abs(np.diff(run.D[:, POSITION], axis=0)).max() < 1.1e-3 * speed * 1.5
    assert np.linalg.norm(run.D[-1, POSITION] - run.D[first, POSITION]) < 0.15 * speed
    assert np.linalg.norm(run.E[-1, LINEAR_VELOCITY]) < 2e-3
    assert np.linalg.norm(run.E[-1, POSITION] - run.D[-1, POSITION]) < 2e-3
    assert np.abs(np.diff(run.torque, axis=0)).max() <= 1.0 + 1e-9
    np.testing.assert_array_equal(run.D[-1, LINEAR_VELOCITY], 0.0)


def test_nothing_happens_to_an_arm_within_its_limits():
    run = supervised(unchanged, constant(np.zeros(6)))
    assert run.mode[-1] == Mode.RUN
    assert np.linalg.norm(run.E[-1, POSITION] - run.D[-1, POSITION]) < 1e-4
