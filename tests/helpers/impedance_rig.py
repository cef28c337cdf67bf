"""An impedance by itself: D, wrench and E from sources in continuous time."""

from collections.abc import Callable

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import BasicVector, Context, Diagram, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import Sine

from geoimp_drake.laws.impedance.families import make_family
from geoimp_drake.systems.frame_motion import FRAME_MOTION_SIZE, frame_motion_at_rest
from geoimp_drake.systems.impedance_integrator import ImpedanceIntegrator

X_WD = RigidTransform(RollPitchYaw(2.0, 0.4, -1.0), [0.9, 0.1, 0.7])
M_P = np.diag([9.0, 12.0, 7.0])
D_P = np.array([[200.0, 30.0, 0.0], [30.0, 150.0, 10.0], [0.0, 10.0, 180.0]])
K_P = np.array([[700.0, 100.0, 50.0], [100.0, 900.0, 0.0], [50.0, 0.0, 500.0]])
M_O = np.diag([0.4, 0.3, 0.5])
D_O = np.array([[5.0, 0.5, 0.0], [0.5, 4.0, 0.2], [0.0, 0.2, 6.0]])
K_O = np.array([[20.0, 3.0, 1.0], [3.0, 15.0, 2.0], [1.0, 2.0, 25.0]])


def make_impedance(family: str = "quaternion", axes: str = "both") -> ImpedanceIntegrator:
    impedance = ImpedanceIntegrator(M_P, D_P, K_P, make_family(family, M_O, D_O, K_O), axes)
    impedance.set_name("impedance")
    return impedance


def turning_motion(rate: float) -> Sine:
    """Returns a source of a D at W's origin that turns about z at a constant rate [rad/s]."""
    amplitudes, rates, phases = np.zeros((3, FRAME_MOTION_SIZE))
    amplitudes[[0, 3]], rates[[0, 3]], phases[0] = 1.0, rate / 2, np.pi / 2
    amplitudes[9], phases[9] = rate, np.pi / 2  # angular velocity, constant
    return Sine(amplitudes, rates, phases)


def swinging_wrench(amplitudes: np.ndarray, rates: np.ndarray) -> Sine:
    return Sine(np.asarray(amplitudes), np.asarray(rates), np.linspace(0.3, 2.0, 6))


class Function(LeafSystem):
    """A source of any function of time."""

    def __init__(self, function: Callable[[float], np.ndarray]):
        super().__init__()
        size = len(function(0.0))

        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(function(context.get_time()))

        self.DeclareVectorOutputPort("value", size, calc, {self.time_ticket()})


def impedance_diagram(impedance, desired, wrench, X_WE: RigidTransform = X_WD) -> Diagram:
    """Returns a diagram of the impedance between sources; a function of time is a source, too."""
    builder = DiagramBuilder()
    builder.AddSystem(impedance)
    measured = frame_motion_at_rest(X_WE)
    sources = {
        "desired_motion": desired,
        "wrench": wrench,
        "measured_motion": lambda t: measured,
    }
    for port, source in sources.items():
        system = builder.AddSystem(Function(source) if callable(source) else source)
        builder.Connect(system.get_output_port(0), impedance.GetInputPort(port))
    return builder.Build()


def fixed_step(diagram: Diagram, step: float = 1e-3, scheme: str = "runge_kutta2") -> Simulator:
    """Returns a simulator without error control; it is not initialized."""
    simulator = Simulator(diagram)
    config = SimulatorConfig(integration_scheme=scheme, max_step_size=step, use_error_control=False)
    ApplySimulatorConfig(config, simulator)
    return simulator


def at_rest(X_WF: RigidTransform) -> Callable[[float], np.ndarray]:
    motion = frame_motion_at_rest(X_WF)
    return lambda t: motion


def constant(wrench) -> Callable[[float], np.ndarray]:
    value = np.asarray(wrench, dtype=float)
    return lambda t: value
