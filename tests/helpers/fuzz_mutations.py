"""Texts spoilt by chance: words become values that nobody expects, lines, tags and bytes change."""

import contextlib
import random
import re
from xml.sax.saxutils import quoteattr

__all__ = ["NUMBERS", "VALUES", "instead", "spoilt", "spoilt_word", "spoilt_xml", "value"]


def _listed(text: str) -> tuple[str, ...]:
    return tuple(re.split(r"\s\|\s", text.strip()))


NUMBERS = (
    *_listed("0 | -0.0 | -1 | 1 | 2 | 7 | 0.1 | 360 | 1e-9 | 1e9 | 1e12 | 1e13 | -1e200 | 1e400"),
    *_listed("1e-310 | .nan | .inf | -.inf | nan"),
    *("1" + 400 * "0", str(2**64), str(2**200)),
)
VALUES = (
    *NUMBERS,
    *_listed("010 | 1:30 | 0x10 | 1_0 | ² | null | ~ | true | on | {} | [] | '' | x | six | seven"),
    *_listed("custom | both | none | compiled | quaternion | classical-euler | hydroelastic | é"),
    *_listed(
        "'<script>' | '$\\frac{$' | 2024-01-01 | !x | !!python/object:os.system x | *x | &a [*a]"
    ),
    *_listed("&a {b: *a} | { | ] | ' | % | ? y | - - | {a: 1} | {a: 1, a: 2} | [1, 2] | [1, 2, 3]"),
    *_listed("[[1, 2], [3]] | [.nan, 0, 0] | [1e300, 0, 0] | [[[[]]]] | /dev/zero | ../.. | ~/x"),
    *("x" * 200, "x" * 10**5, "[" * 200, "{a: " * 50),
    *('"a\\nb"', '"\\e[2J"', "\u202e", "\x00", "\t", "a: 1\n  b: 2\n c"),
)
_WORDS = re.compile(r"[^\s:,{}\[\]#]+")


def value(rng: random.Random) -> str:
    return rng.choice(NUMBERS if rng.random() < 0.4 else VALUES)


def instead(rng: random.Random, word: str, values: tuple[str, ...] = VALUES) -> str:
    """What comes into the place of a word: for a number mostly another one, which may do."""
    with contextlib.suppress(ValueError):
        if rng.random() < 0.75:
            return repr(float(word) * rng.choice((0.5, 0.99, 1.01, 1.5, 2.0, -1.0, 10.0)))
    return rng.choice(values)


def spoilt(rng: random.Random, text: str, values: tuple[str, ...]) -> str | bytes:
    """A text with some words replaced by values, lines doubled or dropped, or bytes changed."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        what = rng.random()
        if what < 0.7:
            word = rng.choice(list(_WORDS.finditer(text)) or [re.match("", text)])
            text = text[: word.start()] + instead(rng, word[0], values) + text[word.end() :]
        elif what < 0.85:
            text = _spoilt_lines(rng, text)
        else:
            return _spoilt_bytes(rng, text)
    return text


def _spoilt_lines(rng: random.Random, text: str) -> str:
    lines = text.splitlines(keepends=True) or [""]
    k = rng.randrange(len(lines))
    lines[k : k + 1] = rng.choice(([], [lines[k]] * 2, [lines[k] * 500], [f"  {lines[k]}"]))
    return "".join(lines)


def _spoilt_bytes(rng: random.Random, text: str) -> bytes:
    data = bytearray(text.encode("utf-8", "surrogatepass"))
    k = rng.randrange(len(data) + 1)
    choice = rng.randrange(4)
    if choice == 0:
        return bytes(data[:k])
    if choice == 1:
        return b"\xef\xbb\xbf" + bytes(data)
    if choice == 2:
        return bytes(data[:k]) + rng.randbytes(rng.randint(1, 20)) + bytes(data[k:])
    return bytes(data).decode("utf-8", "ignore").encode("utf-16")


def spoilt_xml(rng: random.Random, text: str) -> str | bytes:
    """A robot's file with attributes, tags or bytes changed."""
    for _ in range(rng.randint(1, 2)):
        what = rng.random()
        if what < 0.6:
            place = rng.choice(list(re.finditer(r'"[^"]*"', text)) or [re.match("", text)])
            other = quoteattr(rng.choice(("", "0 0 0", "1 2", "-1 0 0", "1e30", value(rng))))
            text = text[: place.start()] + other + text[place.end() :]
        elif what < 0.9:
            place = rng.choice(list(re.finditer(r"<[^>]*>", text)) or [re.match("", text)])
            tag = rng.choice(("", place[0] * 2, "<x/>", "<link>", "<inertial/>", "<mimic/>"))
            text = text[: place.start()] + tag + text[place.end() :]
        else:
            return _spoilt_bytes(rng, text)
    return text


def spoilt_word(rng: random.Random, word: str) -> str:
    parts = word.split(".")
    parts[rng.randrange(len(parts))] = rng.choice(("²", "-1", "99", "", "x" * 1000, "a b", "é"))
    return ".".join(parts)
