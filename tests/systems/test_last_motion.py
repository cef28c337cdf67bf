"""A held motion is that of the last step's beginning, and an initialization forgets it."""

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import BasicVector, DiagramBuilder, LeafSystem

from geoimp_drake.systems.last_motion import LastMotion

AT_REST = np.eye(1, 19)[0]


class Clock(LeafSystem):
    """A motion whose every entry is the time."""

    def __init__(self) -> None:
        super().__init__()
        self.DeclareVectorOutputPort(
            "motion", 19, lambda c, out: out.SetFromVector(np.full(19, c.get_time()))
        )


def held(diagram, block, context) -> np.ndarray:
    return block.get_output_port().Eval(block.GetMyContextFromRoot(context)).copy()


def test_it_holds_the_motion_at_the_beginning_of_the_step() -> None:
    builder = DiagramBuilder()
    clock, block = builder.AddSystem(Clock()), builder.AddSystem(LastMotion())
    builder.Connect(clock.get_output_port(), block.get_input_port())
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_context()
    np.testing.assert_array_equal(held(diagram, block, context), AT_REST)
    simulator.get_integrator().set_maximum_step_size(0.25)
    for step in range(3):
        simulator.AdvanceTo(0.25 * (step + 1))
        np.testing.assert_array_equal(held(diagram, block, context), np.full(19, 0.25 * step))
    simulator.get_mutable_context().SetTime(0.0)
    simulator.Initialize()
    np.testing.assert_array_equal(held(diagram, block, context), AT_REST)


def test_it_breaks_an_algebraic_loop() -> None:
    block = LastMotion()
    assert not block.HasDirectFeedthrough(0)
    context = block.CreateDefaultContext()
    block.get_input_port().FixValue(context, BasicVector(np.ones(19)))
    np.testing.assert_array_equal(block.get_output_port().Eval(context), AT_REST)
