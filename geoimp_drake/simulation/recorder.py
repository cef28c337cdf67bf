"""Logging: one of Drake's vector log sinks under the log's own names."""

from itertools import accumulate

from pydrake.systems.framework import Context, Diagram, DiagramBuilder, OutputPort
from pydrake.systems.primitives import Multiplexer, VectorLogSink

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.systems.naming import unused_name
from geoimp_drake.typing import Array

__all__ = ["Recorder"]

_ALL = slice(None)


class Recorder:
    """Records ports of a diagram under construction at one period.

    All of them go into one sink: every system of a diagram costs time in every step, even one that
    only listens. So there is no sink if nothing is recorded.

    Args:
        builder: of the diagram.
        period: between two samples [s].
    """

    def __init__(self, builder: DiagramBuilder, period: float):
        self._builder = builder
        self._period = period
        self._ports: list[OutputPort] = []
        self._keys: dict[str, tuple[OutputPort, slice]] = {}
        self._constants: dict[str, Array] = {}

    def record(self, key: str, port: OutputPort, part: slice = _ALL) -> None:
        """Records a port, or a part of its vector, under a key; a port is sampled once."""
        if port not in self._ports:
            self._ports.append(port)
        self._keys[key] = (port, part)

    def constant(self, key: str, value: Array) -> None:
        """Puts a value that does not change with time into the log."""
        self._constants[key] = value

    def port(self, key: str) -> OutputPort:
        """Returns the port that is recorded under a key."""
        return self._keys[key][0]

    def build(self) -> Diagram:
        """Adds the sink, if anything is recorded, and returns the diagram."""
        if not self._ports:
            return self._builder.Build()
        sizes = [port.size() for port in self._ports]
        everything = self._builder.AddNamedSystem(
            unused_name(self._builder, "logged_signals"), Multiplexer(sizes)
        )
        for k, port in enumerate(self._ports):
            self._builder.Connect(port, everything.get_input_port(k))
        self._sink = self._builder.AddNamedSystem(
            unused_name(self._builder, "log"), VectorLogSink(sum(sizes), self._period)
        )
        self._builder.Connect(everything.get_output_port(), self._sink.get_input_port())
        return self._builder.Build()

    def collect(self, context: Context) -> dict[str, Array]:
        """Returns the recorded arrays, with time as their first axis.

        Args:
            context: of the whole diagram.

        Raises:
            ConfigurationError: nothing is recorded.
        """
        if not self._ports:
            raise ConfigurationError("Nothing is logged; build the diagram with logged=True.")
        record = self._sink.FindLog(context)
        log = {"t": record.sample_times().copy()}
        ends = list(accumulate(port.size() for port in self._ports))
        for key, (port, part) in self._keys.items():
            k = self._ports.index(port)
            rows = record.data()[ends[k] - port.size() : ends[k]]
            log[key] = rows[part].T.copy()
        return {**log, **self._constants}
