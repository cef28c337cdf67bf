"""Declaring what a system computes from a context alone: cache entries and vector output ports."""

from collections.abc import Callable

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import (
    BasicVector,
    CacheEntry,
    Context,
    DependencyTicket,
    InputPort,
    LeafSystem,
    ValueProducer,
)

from geoimp_drake.systems.frame_motion import FRAME_MOTION_SIZE, frame_motion_vector
from geoimp_drake.typing import Array

__all__ = ["declare_cache", "declare_output", "tickets_of"]


def tickets_of(system: LeafSystem, *ports: InputPort) -> set[DependencyTicket]:
    """Returns the dependency tickets of input ports.

    Args:
        system: which has them.
        ports: the ports.
    """
    return {system.input_port_ticket(port.get_index()) for port in ports}


def declare_cache(
    system: LeafSystem,
    name: str,
    calc: Callable[[Context, AbstractValue], None],
    tickets: set[DependencyTicket],
) -> CacheEntry:
    """Declares a cache entry that holds any Python object.

    Args:
        system: which gets it.
        name: of the entry.
        calc: sets the value.
        tickets: what it depends on.
    """
    producer = ValueProducer(lambda: AbstractValue.Make(object()), calc)
    return system.DeclareCacheEntry(name, producer, tickets)


def declare_output(
    system: LeafSystem,
    name: str,
    size: int,
    law: Callable[[Context], Array],
    tickets: set[DependencyTicket],
) -> None:
    """Declares a vector output port; one of 19 carries a frame motion.

    Args:
        system: which gets it.
        name: of the port.
        size: of the vector.
        law: returns the vector.
        tickets: what it depends on.
    """
    model = frame_motion_vector() if size == FRAME_MOTION_SIZE else BasicVector(size)
    system.DeclareVectorOutputPort(
        name, model, lambda context, output: output.SetFromVector(law(context)), tickets
    )
