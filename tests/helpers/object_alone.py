"""The object's part of tight cooperation between hands that move as told, as a part and as blocks.

The ports of both are the same.
"""

from typing import Any

from pydrake.systems.framework import Diagram, DiagramBuilder

from geoimp_drake.controllers.object_loop import ObjectParts, add_object_loop
from geoimp_drake.parts.found_object import FoundObject
from geoimp_drake.parts.held_object import HeldObject
from geoimp_drake.parts.part import Now
from geoimp_drake.typing import Array

HANDS = {"measured_motion_1": 19, "measured_motion_2": 19, "wrench_1": 6, "wrench_2": 6}


class ObjectAlone:
    """A part that is a `HeldObject` and nothing else."""

    def __init__(self, held_object: HeldObject, period: float):
        self._object = held_object
        self.inputs = {**held_object.inputs, **HANDS}
        self.memory, self.state = held_object.memory, held_object.state
        self.found_of = "state", "memory", "time", *self.inputs
        self.samplings = ((period, self._sample),)
        self.outputs = held_object.outputs(slice(0, len(self.memory)))

    def new_found(self) -> FoundObject:
        return self._object.new_found()

    def new_workspace(self) -> Any:
        return self._object.new_workspace()

    def check_start(self, now: Now) -> None:
        _ = now.found

    def find(self, now: Now, found: FoundObject) -> None:
        motions = now["measured_motion_1"], now["measured_motion_2"]
        self._object.find(now, now.memory, motions, _wrenches(now), found)

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        self._object.begin(memory, state, now)

    def rate(self, now: Now, rate: Array) -> None:
        found = self.new_found()
        self.find(now, found)
        rate[:] = found.rates

    def _sample(self, memory: Array, now: Now) -> None:
        self._object.sample(memory, now, _wrenches(now), now.workspace)


def _wrenches(now: Now) -> tuple[Any, Any]:
    return now["wrench_1"], now["wrench_2"]


def object_of_blocks(parts: ObjectParts) -> Diagram:
    builder = DiagramBuilder()
    ports = add_object_loop(builder, parts)
    for name, (first, *others) in ports.inputs.items():
        builder.ExportInput(first, name)
        for target in others:
            builder.ConnectInput(name, target)
    for name, output in ports.outputs.items():
        builder.ExportOutput(output, name)
    return builder.Build()
