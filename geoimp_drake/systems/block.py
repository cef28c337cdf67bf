"""What all blocks have in common."""

from pydrake.systems.framework import BasicVector, DependencyTicket, DiscreteStateIndex, LeafSystem

from geoimp_drake.typing import Array

__all__ = ["IS_PYBIND11", "Block"]

# What binds Drake to Python.
IS_PYBIND11 = type(LeafSystem).__name__ == "pybind11_type"


class Block(LeafSystem):
    """A LeafSystem written in Python that costs a simulation less; it has no witness functions.

    After every step of a discrete plant Drake asks each system again for its witness functions. For
    a system in Python that is a search for a method `DoGetWitnessFunctions`, which fails anew each
    time and costs as much as a small law. Where pybind11 binds Drake to Python it is found here: as
    a function of C++ it counts as not overridden, which is remembered. nanobind, which binds later
    Drakes, would call whatever it finds; there nothing is done.
    """

    if IS_PYBIND11:
        DoGetWitnessFunctions = LeafSystem.GetWitnessFunctions

    def declare_state(self, model: Array | BasicVector | int) -> int:
        """Declares a group of discrete state; returns its index.

        The index is a plain integer: one of `DiscreteStateIndex` would be converted, by a call, at
        every use.

        Args:
            model: initial values, or how many zeros.
        """
        return int(self.DeclareDiscreteState(model))

    def ticket_of_state(self, index: int) -> DependencyTicket:
        """Returns the dependency ticket of a group of discrete state.

        Args:
            index: of the group.
        """
        return self.discrete_state_ticket(DiscreteStateIndex(index))

    def declare_state_output(self, name: str, index: int) -> None:
        """Declares an output port for a group of discrete state.

        Args:
            name: of the port.
            index: of the group.
        """
        self.DeclareStateOutputPort(name, DiscreteStateIndex(index))
