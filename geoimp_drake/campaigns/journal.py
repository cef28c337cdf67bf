"""What many runs have finished, kept so that it outlives the process: one JSON line a task."""

import fcntl
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.output_folder import check_entries

__all__ = ["Finished", "Journal"]


@dataclass(frozen=True)
class Finished:
    """How one task ended.

    Attributes:
        result: what the task returned, None if it failed.
        error: why it failed, in one line; None if it did not.
        wall_time: that it took [s].
    """

    result: Any
    error: str | None
    wall_time: float


class Journal:
    """A file whose first line is the plan and each other line a finished task.

    A line that was cut off, as by a killed process, does not count and is removed before the next
    is added. While the journal is open (as a context), no other process can open it.

    Args:
        path: of the file; it and its folder are made when the journal is opened.
        plan: what is run, as JSON data. A file of another plan is refused.
    """

    def __init__(self, path: Path, plan: Mapping[str, Any]):
        self._path = path
        self._plan = json.loads(json.dumps(plan))
        self._file: BinaryIO | None = None

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
        try:
            records = [json.loads(line) for line in lines]
            plans = [record["plan"] for record in records[:1]]
            tasks = {record.pop("key"): record for record in records[1:]}
            finished = {key: Finished(**record) for key, record in tasks.items()}
        except (ValueError, TypeError, KeyError, AttributeError):
            raise ConfigurationError(
                f"{self._path} is not a journal of runs; give another folder with --out."
            ) from None
        for plan in plans:
            self._check(plan)
        return finished

    def __enter__(self) -> Self:
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._file = open(self._path, "ab", opener=_open_no_link)
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
        """Writes a finished task to the disk at once."""
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
        self._file.write(json.dumps(record, ensure_ascii=False).encode() + b"\n")
        self._file.flush()

    def _check(self, plan: Any) -> None:
        """Raises ConfigurationError, naming what differs, unless the file's plan is this one."""
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
    return [line for line in content.splitlines(keepends=True) if line.endswith(b"\n")]


def _differences(there: Any, now: Any, path: str = "") -> Iterator[str]:
    """Yields each entry in which two plans differ, with both values."""
    if isinstance(there, dict) and isinstance(now, dict):
        for key in sorted({*there, *now}):
            inner = f"{path}.{key}" if path else key
            yield from _differences(there.get(key), now.get(key), inner)
    elif json.dumps(there) != json.dumps(now):  # NaN equals itself here
        yield f"{path} is {_shown(there)} there and {_shown(now)} here"


def _shown(value: Any) -> str:
    return "not given" if value is None else json.dumps(value, ensure_ascii=False)
