"""What an inner part sees within an outer one."""

from collections.abc import Collection, Mapping
from typing import Any

from geoimp_drake.parts.part import NOTHING, Now
from geoimp_drake.typing import Array

__all__ = ["Within"]


class Within(dict[str, Any]):
    """A `Now` for a part within an outer one, with names and places of its own.

    Args:
        now: what the outer part sees.
        names: of the outer part's inputs, by those of the inner one; others are the same.
        given: values that replace inputs.
        memory: of the inner part.
        state: of the inner part.
        place: of the inner part's workspace in the outer one's.
        label: put behind the system's name in messages.
    """

    __slots__ = ("_label", "_names", "_now", "_place", "memory", "state")

    def __init__(
        self,
        now: Now,
        names: Mapping[str, str],
        given: Mapping[str, Any],
        memory: Array = NOTHING,
        state: Array = NOTHING,
        place: int = 0,
        label: str = "",
    ):
        super().__init__(given)
        self._now, self._names, self._place, self._label = now, names, place, label
        self.memory, self.state = memory, state

    def __missing__(self, name: str) -> Any:
        return self._now[self._names.get(name, name)]

    @property
    def time(self) -> float:
        """The time [s]."""
        return self._now.time

    @property
    def system(self) -> str:
        """The name of the system, for messages."""
        return self._now.system + self._label

    @property
    def elapsed(self) -> float | None:
        """The time since the last sample [s], None for the period of the samples."""
        return self._now.elapsed

    @property
    def found(self) -> Any:
        """What the outer part has found."""
        return self._now.found

    @property
    def workspace(self) -> Any:
        """The inner part's workspace."""
        return self._now.workspace[self._place]

    def has(self, name: str) -> bool:
        """Whether an input is connected."""
        return name in self or self._now.has(self._names.get(name, name))

    def has_any(self, names: Collection[str]) -> bool:
        """Whether one of several inputs is connected."""
        return any(map(self.has, names))

    def port(self, name: str) -> str:
        """The full name of an input, for errors."""
        return self._now.port(self._names.get(name, name))

    def output(self, name: str) -> Array:
        """The value of one of the outer part's outputs."""
        return self._now.output(self._names.get(name, name))
