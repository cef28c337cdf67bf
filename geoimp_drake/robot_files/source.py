"""XML as the user wrote it: elements that know the file and the line where they begin."""

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import cast
from xml.parsers import expat

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.reading import check_regular

__all__ = ["Place", "lines_of", "place_of", "read_xml"]

# Some files contain the numbers of their meshes, and are this large [bytes].
_LARGEST = 50_000_000
_DECLARATION = re.compile(rb"<\?xml\s[^>]*\?>")
# An unclosed one extends to the end of the file, so that the search ends there.
_COMMENT = re.compile(rb"<!\[CDATA\[.*?(?:\]\]>|\Z)|<!--.*?(?:-->|\Z)", re.DOTALL)
# The deepest nesting of elements, since functions walk through them by recursion.
_DEEPEST = 200


@dataclass(frozen=True)
class Place:
    """A line of a file, as editors name it."""

    file: Path
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


class _Element(ET.Element):
    """An element that was read from a file."""

    place: Place | None = None


def read_xml(file: Path) -> ET.Element:
    """Reads a file; names keep their prefix, even if undeclared, since Drake knows its own by it.

    Raises:
        ConfigurationError: the file cannot be read, is too large, or is no XML (with the line).
    """
    open_elements: list[_Element] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = cast(_Element, builder.start(tag, attributes))
        element.place = Place(file, parser.CurrentLineNumber)
        open_elements.append(element)
        if len(open_elements) > _DEEPEST:
            raise ConfigurationError(
                f"{element.place}: <{tag}> is {_DEEPEST} elements deep; no robot needs that."
            )

    def end(tag: str) -> None:
        open_elements.pop()
        builder.end(tag)

    check_regular(file, "robot file", _LARGEST)
    builder = ET.TreeBuilder(element_factory=_Element)
    parser = _parser(start, end, builder.data)
    try:
        text = _COMMENT.sub(_without_hyphens, _DECLARATION.sub(_blank, file.read_bytes()))
        parser.Parse(text, True)
    except OSError as error:
        raise ConfigurationError(
            f"The robot file {file.absolute()} cannot be read: {error.strerror}."
        ) from error
    except expat.ExpatError as error:
        raise ConfigurationError(f"{file} is not XML: {error}.") from error
    return builder.close()


def _blank(declaration: re.Match[bytes]) -> bytes:
    """Returns spaces for a declaration that does not begin the file, which Drake tolerates."""
    return declaration[0] if declaration.start() == 0 else b" " * len(declaration[0])


def _without_hyphens(comment: re.Match[bytes]) -> bytes:
    """Returns a comment without hyphens; two in a row are an error that Drake tolerates."""
    begin, text, end = comment[0][:4], comment[0][4:-3], comment[0][-3:]
    if begin != b"<!--" or end != b"-->":
        return comment[0]
    return begin + text.replace(b"-", b" ") + end


def place_of(element: ET.Element) -> Place | None:
    """Returns where an element was read; None if it was added."""
    return element.place if isinstance(element, _Element) else None


def lines_of(text: str) -> list[int]:
    """Returns the line where each element of an XML text begins, in the order of the text."""
    lines: list[int] = []
    parser = _parser(lambda *_: lines.append(parser.CurrentLineNumber))
    parser.Parse(text, True)
    return lines


def _parser(
    start: Callable[..., object],
    end: Callable[..., object] | None = None,
    data: Callable[..., object] | None = None,
) -> expat.XMLParserType:
    parser = expat.ParserCreate()
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = data
    return parser
