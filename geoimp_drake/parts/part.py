"""A part of a controller: named inputs, memory, state and outputs, without a Drake system.

A part holds gains and compiled laws, never signals. Its memory is an array that the caller passes
in, so one part serves any number of contexts. `systems.part_system.PartSystem` makes a LeafSystem
of any part; a part that contains others calls them itself.

The protocols below name what a part may have; only `Part` is required. In a class that needs
no memory, `memory` is an empty `Memory`.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np

from geoimp_drake.typing import Array

__all__ = [
    "NOTHING",
    "Begins",
    "Checks",
    "Finds",
    "Flows",
    "Memory",
    "Now",
    "Output",
    "Part",
    "Samples",
    "Settles",
    "Starts",
    "Stays",
    "Works",
    "held",
    "nested",
]

NOTHING = np.empty(0)


class Memory:
    """Names for places in one vector, and their initial values.

    `Memory(reading=np.zeros(12), count=0.0)` has attributes `reading`, a slice, and `count`, an
    index: `vector[memory.reading]`. A `Memory` as a value is that of an inner part.

    Attributes:
        start: the whole vector at the start (n,).

    Raises:
        TypeError: a place is called `start`.
    """

    def __init__(self, **start: "Array | float | Memory"):
        places: list[Array] = []
        size = 0
        if "start" in start:
            raise TypeError("A place cannot be called 'start': that is the name of the whole.")
        for name, value in start.items():
            values = np.atleast_1d(value.start if isinstance(value, Memory) else value)
            is_number = not isinstance(value, Memory) and np.ndim(value) == 0
            setattr(self, name, size if is_number else slice(size, size + len(values)))
            places.append(values)
            size += len(values)
        self.start: Array = np.concatenate((NOTHING, *places)).astype(float)

    def __len__(self) -> int:
        return len(self.start)

    if TYPE_CHECKING:  # the places are set by name; at run time this would slow every look-up

        def __getattr__(self, name: str) -> Any: ...


class Now(Protocol):
    """What a part sees at one instant: inputs by name, memory, state and what follows from them.

    Attributes:
        time: [s].
        system: the name of the system, for messages.
        memory: the part's memory: a copy in a system, the loop's own in a `PartLoop`.
        state: the part's continuous state, the same.
        elapsed: time since the last sample [s], None for the period of the samples.
        found: what `find` has written.
        workspace: what `new_workspace` has made.
    """

    @property
    def time(self) -> float: ...  # noqa: D102 - above

    @property
    def system(self) -> str: ...  # noqa: D102 - above

    @property
    def memory(self) -> Array: ...  # noqa: D102 - above

    @property
    def state(self) -> Array: ...  # noqa: D102 - above

    @property
    def elapsed(self) -> float | None: ...  # noqa: D102 - above

    @property
    def found(self) -> Any: ...  # noqa: D102 - above

    @property
    def workspace(self) -> Any: ...  # noqa: D102 - above

    def __getitem__(self, name: str) -> Any:
        """The value of an input."""

    def has(self, name: str) -> bool:
        """Whether there is such an input, and it is connected."""

    def has_any(self, names: Collection[str]) -> bool:
        """Whether one of several inputs is connected."""

    def port(self, name: str) -> str:
        """The full name of an input, for errors."""

    def output(self, name: str) -> Array:
        """The value of one of the part's outputs."""


@dataclass(frozen=True)
class Output:
    """One output of a part.

    Attributes:
        name: of the output.
        size: of the vector; one of 19 is a frame motion.
        write: writes the value; takes a `Now` and the array to write to.
        of: what it depends on: inputs, and any of `memory`, `state`, `time` and `found`.
    """

    name: str
    size: int
    write: Callable[[Now, Array], None]
    of: Sequence[str]

    def within(self, view: Callable[[Now], Now], inputs: Mapping[str, Any]) -> "Output":
        """Returns the same output of a part that contains this one.

        Args:
            view: what the inner part sees.
            inputs: of the outer part; the inner part's other inputs are in the memory.
        """
        of = [name for name in self.of if name in inputs or name in ("memory", "time")]
        return replace(self, write=lambda now, value: self.write(view(now), value), of=of)


def nested(*places: slice) -> slice:
    """Returns the place in a vector of a place within a place, and so on."""
    start = sum(place.start for place in places)
    return slice(start, start + places[-1].stop - places[-1].start)


def held(name: str, place: slice) -> Output:
    """Returns an output whose value is a place of the memory.

    Args:
        name: of the output.
        place: in the part's memory.
    """

    def write(now: Now, value: Array) -> None:
        value[:] = now.memory[place]

    return Output(name, place.stop - place.start, write, ("memory",))


class Part(Protocol):
    """What every part has.

    Attributes:
        inputs: sizes of vectors by name, 19 for a frame motion, or an example of anything else.
        memory: what is remembered from sample to sample and from step to step.
        outputs: in the order of their ports.

    A part without derivatives by `AutoDiffXd` says why in an attribute `float_only`; one that takes
    samples has none anyway.
    """

    @property
    def inputs(self) -> Mapping[str, Any]: ...  # noqa: D102 - above

    @property
    def memory(self) -> Memory: ...  # noqa: D102 - above

    @property
    def outputs(self) -> Sequence[Output]: ...  # noqa: D102 - above


@runtime_checkable
class Starts(Protocol):
    """A part that does something at initialization, when its memory is as at the start."""

    def start(self, memory: Array, now: Now) -> None:
        """Writes the memory."""


@runtime_checkable
class Settles(Protocol):
    """A part that does something at initialization, after all parts have started."""

    def settle(self, memory: Array, now: Now) -> None:
        """Writes the memory."""


@runtime_checkable
class Samples(Protocol):
    """A part that does something every period.

    Attributes:
        samplings: periods [s], each with the function that then writes the memory.
    """

    samplings: Sequence[tuple[float, Callable[[Array, Now], None]]]


@runtime_checkable
class Begins(Protocol):
    """A part that does something as a simulator's step begins."""

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Writes memory and state."""


@runtime_checkable
class Checks(Protocol):
    """A part that refuses at initialization what it cannot use."""

    def check_start(self, now: Now) -> None:
        """Evaluates what raises the errors."""


@runtime_checkable
class Finds(Protocol):
    """A part that computes once what several of its outputs use.

    Attributes:
        found_of: what it depends on, as in `Output`.
    """

    found_of: Sequence[str]

    def new_found(self) -> Any:
        """Returns what `find` writes to, new for each context."""

    def find(self, now: Now, found: Any) -> None:
        """Writes to `found` what several outputs use."""


@runtime_checkable
class Flows(Protocol):
    """A part with a continuous state.

    Attributes:
        state: named like the memory.
    """

    state: Memory

    def rate(self, now: Now, rate: Array) -> None:
        """Writes the state's derivative."""


@runtime_checkable
class Stays(Protocol):
    """A part whose laws read and write memory and inputs in place, where these persist."""

    def stay(
        self, memory: Array, inputs: Mapping[str, Array], state: Array, rate: Array
    ) -> tuple[Any, Any, Callable[[Now, Mapping[str, Array], float], bool] | None]:
        """Returns a workspace, a new `found`, and a function that does a tick in one call.

        The function may be None. It takes a `Now`, the targets of the tick and the time since the
        last one. It samples, integrates, begins and finds as the part does; or it returns False and
        has changed nothing.

        Args:
            memory: of the part, like all that follows.
            inputs: by name.
            state: continuous state.
            rate: where its derivative is written.
        """


@runtime_checkable
class Works(Protocol):
    """A part that needs a workspace that is no state, such as a context of a plant."""

    def new_workspace(self) -> Any:
        """Returns a workspace, new for each context."""
