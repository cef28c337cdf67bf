"""A system between sources that are functions of time, and what its ports give."""

from collections.abc import Callable, Mapping

import numpy as np
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem, System

Signal = Callable[[float], np.ndarray]


class Source(LeafSystem):
    """A source of any function of time."""

    def __init__(self, function: Signal):
        super().__init__()

        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(function(context.get_time()))

        self.DeclareVectorOutputPort("value", len(function(0.0)), calc, {self.time_ticket()})


class Rig:
    """A simulator of one system; signals by the names of its input ports, arrays for constants."""

    def __init__(self, system: System, signals: Mapping[str, Signal | np.ndarray]):
        builder = DiagramBuilder()
        self.system = builder.AddNamedSystem("system", system)
        for name, signal in signals.items():
            source = builder.AddSystem(Source(signal if callable(signal) else constant(signal)))
            builder.Connect(source.get_output_port(), system.GetInputPort(name))
        self.simulator = fixed_step(builder.Build())

    def read(self, port: str, context: Context | None = None) -> np.ndarray:
        root = context or self.simulator.get_context()
        own = self.system.GetMyContextFromRoot(root)
        return self.system.GetOutputPort(port).Eval(own).copy()

    def advance(self, time: float) -> "Rig":
        self.simulator.AdvanceTo(time)
        return self


def constant(value: np.ndarray) -> Signal:
    held = np.asarray(value, dtype=float)
    return lambda t: held


def fixed_step(diagram: System) -> Simulator:
    simulator = Simulator(diagram)
    config = SimulatorConfig(
        integration_scheme="runge_kutta2", max_step_size=1e-3, use_error_control=False
    )
    ApplySimulatorConfig(config, simulator)
    return simulator
