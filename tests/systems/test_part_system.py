"""A part as a LeafSystem: what it remembers is in the context, what it does is done in time."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from geoimp_drake.parts.part import Memory, Output, held
from geoimp_drake.systems.part_system import FlowingPartSystem, PartSystem, system_of


class Counter:
    """Counts samples, slowly and quickly, and steps; remembers its input at the start."""

    def __init__(self):
        self.inputs = {"signal": 2}
        self.memory = Memory(
            slow=np.zeros(1), quick=np.zeros(1), steps=np.zeros(1), first=np.zeros(2)
        )
        self.samplings = ((0.02, self._slow), (0.01, self._quick), (0.02, self._slow))
        self.outputs = (
            *(
                held(name, getattr(self.memory, name))
                for name in ("slow", "quick", "steps", "first")
            ),
            Output("twice", 2, self._write_twice, ("signal",)),
            Output("clock", 1, self._write_clock, ("time",)),
        )

    def start(self, memory, now):
        memory[self.memory.first] = now["signal"]

    def begin(self, memory, state, now):
        memory[self.memory.steps] += 1.0

    def _slow(self, memory, now):
        memory[self.memory.slow] += 1.0

    def _quick(self, memory, now):
        memory[self.memory.quick] += 1.0

    def _write_twice(self, now, value):
        value[:] = 2.0 * now["signal"]

    def _write_clock(self, now, value):
        value[:] = now.time


class Decay:
    """ẋ = −x, from one; its integral is what it finds."""

    def __init__(self):
        self.inputs = {}
        self.memory = Memory()
        self.state = Memory(x=np.ones(1))
        self.found_of = ("state",)
        self.evaluations = 0
        self.outputs = (
            Output("x", 1, self._write, ("found",)),
            Output("same", 1, self._write, ("found",)),
        )

    def new_found(self):
        return np.zeros(1)

    def find(self, now, found):
        self.evaluations += 1
        found[:] = now.state

    def rate(self, now, rate):
        rate[:] = -now.state

    def _write(self, now, value):
        value[:] = now.found


def counting():
    builder = DiagramBuilder()
    counter = builder.AddNamedSystem("counter", system_of(Counter()))
    source = builder.AddSystem(ConstantVectorSource([3.0, 4.0]))
    builder.Connect(source.get_output_port(), counter.GetInputPort("signal"))
    simulator = Simulator(builder.Build())
    simulator.get_mutable_integrator().set_maximum_step_size(0.005)
    return counter, simulator


def read(system, simulator, name):
    return system.GetOutputPort(name).Eval(system.GetMyContextFromRoot(simulator.get_context()))


def test_what_is_due_at_one_instant_is_done_in_one_event_and_each_at_its_own_period():
    counter, simulator = counting()
    simulator.AdvanceTo(0.0999)
    assert read(counter, simulator, "slow") == 10.0  # five instants, twice each
    assert read(counter, simulator, "quick") == 10.0
    assert read(counter, simulator, "steps") >= 10.0
    assert read(counter, simulator, "clock") == pytest.approx(0.0999)


def test_initialization_begins_anew():
    counter, simulator = counting()
    simulator.AdvanceTo(0.05)
    simulator.get_mutable_context().SetTime(0.0)
    simulator.Initialize()
    for name in ("slow", "quick", "steps"):
        assert read(counter, simulator, name) == 0.0
    np.testing.assert_array_equal(read(counter, simulator, "first"), [3.0, 4.0])


def test_outputs_are_those_of_the_part():
    counter, simulator = counting()
    np.testing.assert_array_equal(read(counter, simulator, "twice"), [6.0, 8.0])
    assert isinstance(counter, PartSystem)
    assert isinstance(counter.part, Counter)
    # An output depends on what it says, and on nothing else.
    fed_through = [
        port.get_name()
        for port in map(counter.get_output_port, range(counter.num_output_ports()))
        if counter.HasDirectFeedthrough(port.get_index())
    ]
    assert fed_through == ["twice"]


def test_a_continuous_state_is_integrated_and_what_is_found_is_found_once():
    decay = system_of(Decay())
    assert isinstance(decay, FlowingPartSystem)
    simulator = Simulator(decay)
    simulator.AdvanceTo(1.0)
    context = simulator.get_context()
    assert decay.GetOutputPort("x").Eval(context) == pytest.approx(np.exp(-1.0), abs=1e-3)
    before = decay.part.evaluations
    decay.GetOutputPort("x").Eval(context)
    decay.GetOutputPort("same").Eval(context)
    assert decay.part.evaluations == before
    simulator.Initialize()
    assert decay.GetOutputPort("x").Eval(simulator.get_context()) == 1.0


def test_two_contexts_of_one_system_do_not_know_of_each_other():
    decay = system_of(Decay())
    first, second = decay.CreateDefaultContext(), decay.CreateDefaultContext()
    Simulator(decay, first).AdvanceTo(0.5)
    other = Simulator(decay, second)
    other.AdvanceTo(0.1)
    assert decay.GetOutputPort("x").Eval(first) < 0.7
    assert decay.GetOutputPort("x").Eval(other.get_context()) > 0.8
