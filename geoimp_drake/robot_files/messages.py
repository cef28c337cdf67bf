"""Drake's messages about a description in memory, in terms of the user's file, each kind once."""

import contextlib
import itertools
import logging
import re
from collections.abc import Iterator
from pathlib import Path

from geoimp_drake.errors import ModelError
from geoimp_drake.robot_files.description import Description
from geoimp_drake.robot_files.source import place_of

__all__ = ["in_users_words", "of_file", "silent"]

_log = logging.getLogger("drake")

# Drake's and SDFormat's name for a text in memory, usually with a line.
_TEXT = re.compile(r"<(?:literal|data)-string>(?:\.\w+)?(?::(?P<line>\d+))?")
_QUOTED = re.compile(r"(?<=['\"\[])[^'\"\[\]]+(?=['\"\]])")
_NUMBER = re.compile(r"-?\d[\d.e+-]*")


@contextlib.contextmanager
def in_users_words(description: Description) -> Iterator[None]:
    """Lets Drake's errors and warnings name the user's file and line while it parses.

    Warnings that differ only in names and numbers of the description become one line with their
    count.
    """
    said: list[logging.LogRecord] = []

    def gather(record: logging.LogRecord) -> bool:
        said.append(record)
        return False

    _log.addFilter(gather)
    try:
        yield
    except (RuntimeError, ValueError) as error:
        told = _translated(str(error), description)
        raise RuntimeError(f"{_place_of_a_name(str(error), description)}{told}") from error
    finally:
        _log.removeFilter(gather)
        _say(said, description)


@contextlib.contextmanager
def of_file(file: Path) -> Iterator[None]:
    """Puts the file before messages about its robot that do not name it."""
    try:
        yield
    except ModelError as error:
        if file.name in str(error):
            raise
        raise ModelError(f"{file}: {error}") from error


@contextlib.contextmanager
def silent() -> Iterator[None]:
    """Mutes Drake's log during a trial, since the real load repeats it."""
    level = _log.level
    _log.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        _log.setLevel(level)


def _translated(said: str, description: Description) -> str:
    def place(text: re.Match[str]) -> str:
        line = text["line"]
        return str(description.place(int(line)) if line else description.file)

    return " ".join(_TEXT.sub(place, said).split())


def _place_of_a_name(said: str, description: Description) -> str:
    """Returns the place in the file of the first name in a message that has no line."""
    if not any(text["line"] for text in _TEXT.finditer(said)):
        for name in _QUOTED.findall(said):
            for element in itertools.islice(description.root.iter(), 1, None):
                if name in element.attrib.values() or name == element.text:
                    return f"{place_of(element)}: "
    return ""


def _say(said: list[logging.LogRecord], description: Description) -> None:
    names = {element.get("name") for element in description.root.iter()}
    kinds: dict[tuple[int, str], list[str]] = {}
    for record in said:
        text = record.getMessage()
        kind = _QUOTED.sub(lambda quoted: "" if quoted[0] in names else quoted[0], text)
        kind = _NUMBER.sub("", _TEXT.sub("", kind))
        kinds.setdefault((record.levelno, kind), []).append(text)
    for (level, _), texts in kinds.items():
        more = f" (the first of {len(texts)} of this kind)" if len(texts) > 1 else ""
        _log.log(level, "%s%s", _translated(texts[0], description), more)
