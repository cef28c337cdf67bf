"""What parts are made of: memory with names, and what a part within another one is given."""

import importlib
import inspect
from types import MappingProxyType

import numpy as np
import pytest
from library_tree import MODULES

from geoimp_drake.parts.part import Memory, held, nested
from geoimp_drake.parts.within import Within


class Given:
    """A `Now` whose inputs are in a dictionary."""

    time, system, found = 2.0, "outer", "what is found"
    memory, state = np.arange(10.0), np.zeros(0)
    workspace = ("first", "second")

    def __init__(self, **inputs):
        self.inputs = inputs

    def __getitem__(self, name):
        return self.inputs[name]

    def has(self, name):
        return name in self.inputs

    def port(self, name):
        return f"{self.system}:{name}"

    def output(self, name):
        return f"output {name}"


def test_memory_has_a_place_for_each_name_and_what_stands_there_at_the_start():
    memory = Memory(reading=np.array([1.0, 2.0]), count=3.0, peak=np.zeros(3))
    vector = memory.start
    np.testing.assert_array_equal(vector[memory.reading], [1.0, 2.0])
    assert vector[memory.count] == 3.0
    vector[memory.peak] = 7.0
    np.testing.assert_array_equal(vector, [1.0, 2.0, 3.0, 7.0, 7.0, 7.0])
    assert len(memory) == 6
    assert not Memory()
    with pytest.raises(AttributeError, match="'peek'"):
        _ = memory.peek


def test_a_memory_within_another_keeps_its_names():
    inner = Memory(first=np.zeros(2), second=np.array([5.0, 6.0]))
    outer = Memory(own=np.zeros(3), inner=inner)
    np.testing.assert_array_equal(outer.start[outer.inner][inner.second], [5.0, 6.0])
    np.testing.assert_array_equal(outer.start[nested(outer.inner, inner.second)], [5.0, 6.0])


def test_an_output_that_is_held_is_a_place_of_the_memory():
    output, value = held("peak", slice(4, 7)), np.empty(3)
    output.write(Given(), value)
    assert (output.name, output.size, output.of) == ("peak", 3, ("memory",))
    np.testing.assert_array_equal(value, [4.0, 5.0, 6.0])


def test_a_part_within_another_finds_its_inputs_under_its_own_names():
    outer = Given(estimated_state_2="state", wrench_2="wrench")
    names = MappingProxyType({"state": "estimated_state_2", "wrench": "wrench_2"})
    inner = Within(outer, names, {"wrench": "measured"}, np.ones(2), place=1, label=", arm 2")
    assert (inner["state"], inner["wrench"]) == ("state", "measured")
    assert inner.has("wrench")
    assert inner.has("state")
    assert not inner.has("desired_motion")
    assert inner.port("state") == "outer:estimated_state_2"
    assert (inner.system, inner.time, inner.workspace) == ("outer, arm 2", 2.0, "second")
    assert inner.found == "what is found"
    assert inner.output("actuation") == "output actuation"
    np.testing.assert_array_equal(inner.memory, np.ones(2))


def overridden(kind: type) -> list[str]:
    """Returns the methods of a class of the library that a base class there has already."""
    ours = [base for base in kind.__mro__[1:] if base.__module__.startswith("geoimp_drake")]
    return [
        f"{kind.__qualname__}.{name}"
        for name, member in vars(kind).items()
        if inspect.isfunction(member) and not name.startswith("__")
        for base in ours
        if name in vars(base) and not getattr(vars(base)[name], "__isabstractmethod__", False)
    ]


FOLDERS = ("laws", "arm", "parts", "systems", "controllers")


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_concrete_method_is_overridden(folder):
    modules = [name for name in MODULES if name.startswith(f"geoimp_drake.{folder}.")]
    kinds = [
        kind
        for name in modules
        for _, kind in inspect.getmembers(importlib.import_module(name), inspect.isclass)
        if kind.__module__ == name
    ]
    assert kinds
    assert [name for kind in kinds for name in overridden(kind)] == []


def test_a_method_that_is_overridden_is_found():
    class Changed(Memory):
        def places(self):
            return super().start

    class Twice(Changed):
        def places(self):
            return self.start

    Changed.__module__ = "geoimp_drake.parts.part"
    assert overridden(Changed) == []
    assert [name.rpartition(".")[2] for name in overridden(Twice)] == ["places"]
