"""A block costs a simulation no search for witness functions; one that has some is still asked."""

import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from geoimp_drake.systems.part_system import IS_PYBIND11, Block

STEPS = 20


def searches(base: type[LeafSystem]) -> int:
    """Returns how often Drake looks for witness functions of a system in a simulation."""
    seen = []

    class Sampled(base):  # type: ignore[misc, valid-type] # the base is what is compared
        def __init__(self) -> None:
            super().__init__()
            self.DeclarePeriodicUnrestrictedUpdateEvent(1e-3, 0.0, lambda context, state: None)

        def __getattribute__(self, name: str) -> object:
            if name == "DoGetWitnessFunctions":
                seen.append(name)
            return super().__getattribute__(name)

    builder = DiagramBuilder()
    builder.AddSystem(Sampled())
    Simulator(builder.Build()).AdvanceTo(STEPS * 1e-3)
    return len(seen)


@pytest.mark.skipif(not IS_PYBIND11, reason="Drake is bound by nanobind, which looks every time")
def test_witness_functions_are_looked_for_once() -> None:
    assert searches(Block) <= 1
    # Of the test: without it they are looked for in every step.
    assert searches(LeafSystem) >= STEPS


def test_a_block_of_ones_own_may_have_witness_functions() -> None:
    asked = []

    class Watched(Block):
        def DoGetWitnessFunctions(self, context: object) -> list:
            asked.append(True)
            return []

    builder = DiagramBuilder()
    builder.AddSystem(Watched())
    Simulator(builder.Build()).AdvanceTo(1e-3)
    assert asked


@pytest.mark.parametrize("count", [2, 3])
def test_groups_of_state_are_plain_integers(count: int) -> None:
    block = Block()
    groups = [block.declare_state(k + 1) for k in range(count)]
    assert groups == list(range(count))
    assert all(type(group) is int for group in groups)
    assert len({block.ticket_of_state(group) for group in groups}) == count
