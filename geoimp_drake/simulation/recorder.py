"""Logging: Drake's vector log sinks under the log's own names."""

from pydrake.systems.framework import Context, DiagramBuilder, OutputPort
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink

from geoimp_drake.typing import Array

__all__ = ["Recorder"]

_ALL = slice(None)


class Recorder:
    """Records ports of a diagram under construction at one period.

    Args:
        builder: of the diagram.
        period: between two samples [s].
    """

    def __init__(self, builder: DiagramBuilder, period: float):
        self._builder = builder
        self._period = period
        self._sinks: dict[OutputPort, VectorLogSink] = {}
        self._keys: dict[str, tuple[OutputPort, slice]] = {}
        self._constants: dict[str, Array] = {}

    def record(self, key: str, port: OutputPort, part: slice = _ALL) -> None:
        """Records a port, or a part of its vector, under a key; a port is sampled once."""
        if port not in self._sinks:
            self._sinks[port] = LogVectorOutput(port, self._builder, self._period)
        self._keys[key] = (port, part)

    def constant(self, key: str, value: Array) -> None:
        """Puts a value that does not change with time into the log."""
        self._constants[key] = value

    def port(self, key: str) -> OutputPort:
        """Returns the port that is recorded under a key."""
        return self._keys[key][0]

    def collect(self, context: Context) -> dict[str, Array]:
        """Returns what has been recorded, the first axis being time.

        A system that fails ends a simulation between two sinks; samples that some of them lack are
        left out.

        Args:
            context: of the whole diagram.
        """
        logs = {port: sink.FindLog(context) for port, sink in self._sinks.items()}
        whole = min(record.num_samples() for record in logs.values())
        log = {"t": next(iter(logs.values())).sample_times()[:whole].copy()}
        for key, (port, part) in self._keys.items():
            log[key] = logs[port].data()[part, :whole].T.copy()
        return {**log, **self._constants}
