"""The finished tasks of many runs, kept beyond the life of the process: one JSON line a task."""

import errno
import fcntl
import io
import json
import logging
import os
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from geoimp_drake.errors import ConfigurationError, OutputError
from geoimp_drake.output_folder import check_entries
from geoimp_drake.validation import quoted

__all__ = ["Fields", "Finished", "Journal"]

Fields = Mapping[str, Any]

_LONGEST = 100  # of a key in an error

_log = logging.getLogger("drake")


@dataclass(frozen=True)
class Finished:
    """How one task ended.

    Attributes:
        result: what the task returned, None if it failed.
        error: why it failed, in one line; None if it did not.
        wall_time: duration of the task [s].
    """

    result: Any
    error: str | None
    wall_time: float


class Journal:
    """A file whose first line is the plan and each other line a finished task.

    A line that was cut off, for instance by a killed process, does not count; it is removed before
    the next is added. A damaged line, for instance by a faulty disk, is skipped with a warning.
    While the journal is open (as a context), no other process can open it.

    Args:
        path: of the file; it and its folder are made when the journal is opened.
        plan: the plan of the runs, as JSON data. A file of another plan is refused.
        fields: types of a task's results by key; None for any JSON data.
    """

    def __init__(self, path: Path, plan: Mapping[str, Any], fields: Fields | None = None):
        self._path = path
        self._plan = json.loads(json.dumps(plan))
        self._fields = fields
        self._file: io.FileIO | None = None

    def read(self) -> dict[str, Finished]:
        """Returns the finished tasks by key; none if there is no file.

        Raises:
            ConfigurationError: the file cannot be read, is no journal, or belongs to another plan.
        """
        check_entries(self._path.parent, [self._path.name])
        try:
            lines = _whole_lines(self._path.read_bytes())
        except FileNotFoundError:
            return {}
        except OSError as error:
            raise ConfigurationError(f"{self._path} cannot be read: {error.strerror}.") from None
        if lines:
            self._check(_plan_in(lines[0], self._path))
        finished: dict[str, Finished] = {}
        damaged = []
        for number, line in enumerate(lines[1:], 2):
            if entry := self._entry(line):
                finished |= [entry]
            else:
                damaged.append(number)
        if damaged:
            _log.warning(
                f"{self._path}: {len(damaged)} damaged lines are skipped, the first of them line "
                f"{damaged[0]}. What they held is run again."
            )
        return finished

    def __enter__(self) -> Self:
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            # Without a buffer: data that found no room must not be written again at the end.
            self._file = io.FileIO(self._path, "ab", opener=_open_no_link)
        except OSError as error:
            raise ConfigurationError(
                f"The output folder {self._path.parent} cannot be written: {error.strerror}. Give "
                f"another with --out."
            ) from None
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._file.close()
            raise ConfigurationError(
                f"Another process is running in {self._path.parent}; wait for it, or give another "
                f"folder with --out."
            ) from None
        self._file.truncate(sum(map(len, _whole_lines(self._path.read_bytes()))))
        if self._path.stat().st_size == 0:
            self._write({"plan": self._plan})
        return self

    def add(self, key: str, finished: Finished) -> None:
        """Writes a finished task to the disk at once.

        Raises:
            OutputError: the disk is full, for instance; lines written before are kept.
        """
        self._write({"key": key, **asdict(finished)})

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._file is not None:
            self._file.close()

    def _write(self, record: dict[str, Any]) -> None:
        if self._file is None:
            raise RuntimeError("The journal is not open.")
        line = json.dumps(record, ensure_ascii=False).encode() + b"\n"
        try:
            if self._file.write(line) != len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            raise OutputError(f"{self._path} cannot be written: {error.strerror}.") from error

    def _entry(self, line: bytes) -> tuple[str, Finished] | None:
        """Returns key and result of a task from a line; None if the line is damaged."""
        try:
            record = json.loads(line)
            key = record.pop("key")
            finished = Finished(**record)
            json.dumps([key, record], ensure_ascii=False).encode()  # refuses half a character
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
            return None
        fits = isinstance(key, str) and isinstance(finished.wall_time, int | float)
        if finished.error is None:
            fits = fits and self._is_result(finished.result)
        return (key, finished) if fits and isinstance(finished.error, str | None) else None

    def _is_result(self, result: Any) -> bool:
        if self._fields is None:
            return True
        return isinstance(result, dict) and all(
            isinstance(result.get(name, self), kind) for name, kind in self._fields.items()
        )

    def _check(self, plan: Any) -> None:
        """Raises ConfigurationError, with the differences, unless the file's plan is this one."""
        differing = list(_differences(plan, self._plan))
        if differing:
            more = f" (and {len(differing) - 3} more)" if len(differing) > 3 else ""
            raise ConfigurationError(
                f"{self._path.parent} holds runs of another plan: {'; '.join(differing[:3])}{more}."
                f" Give another folder with --out."
            )


def _open_no_link(path: str, flags: int) -> int:
    return os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK, 0o666)


def _whole_lines(content: bytes) -> list[bytes]:
    """Returns all lines except one that was cut off."""
    return [line + b"\n" for line in content.split(b"\n")[:-1]]


def _plan_in(line: bytes, path: Path) -> Any:
    """Returns the plan in a journal's first line."""
    try:
        return json.loads(line)["plan"]
    except (ValueError, TypeError, KeyError, RecursionError):
        raise ConfigurationError(
            f"{path} is not a journal of runs; give another folder with --out."
        ) from None


def _differences(there: Any, now: Any, path: str = "") -> Iterator[str]:
    """Yields each entry in which two plans differ, with both values."""
    if isinstance(there, dict) and isinstance(now, dict):
        for key in sorted({*there, *now}):
            inner = f"{path}.{key}" if path else key
            yield from _differences(there.get(key), now.get(key), inner)
    elif json.dumps(there) != json.dumps(now):  # NaN equals itself here
        name = path if len(path) <= _LONGEST and path.isprintable() else quoted(path)
        yield f"{name} is {_shown(there)} there and {_shown(now)} here"


def _shown(value: Any) -> str:
    if isinstance(value, dict):
        return f"a mapping of {len(value)} keys"
    return "not given" if value is None else quoted(value)
