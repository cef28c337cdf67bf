"""Laws compiled by numba where it is installed: the same functions, the same numbers, sooner.

A law is written once, in Python. `@compilable` marks it as one that numba can compile and leaves it
as it is, so that it still takes arrays of Drake's `AutoDiffXd`. `compiled(law)` returns a compiled
form for arrays of `float`; laws called by a compiled law are compiled into it. Machine code is kept
on disk, beside the source or in numba's folder for the user.

Without numba (the extra `fast`), or with the environment variable `GEOIMP_COMPILED=0`,
`compiled(law)` is the law itself. numba is imported by the first call, not before.
"""

import hashlib
import importlib.util
import logging
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

__all__ = ["compilable", "compilable_as", "compiled", "is_available"]

Law = TypeVar("Law", bound=Callable[..., Any])

SWITCH = "GEOIMP_COMPILED"

_log = logging.getLogger("drake")

# Laws that numba does not know yet, with what it shall compile for each.
_unknown: list[tuple[Callable[..., Any], Callable[..., Any]]] = []

# Nothing calls a law from C; a tenth of the compilation is saved.
_OPTIONS = {"no_cfunc_wrapper": True}

_PACKAGE = Path(__file__).resolve().parents[1]


def compilable(law: Law) -> Law:
    """Marks a pure function on arrays as one that may be compiled; returns it unchanged."""
    _unknown.append((law, law))
    return law


def compilable_as(body: Callable[..., Any]) -> Callable[[Law], Law]:
    """Marks a function for which `body` is compiled, since numba does not know its own way."""

    def mark(law: Law) -> Law:
        _unknown.append((law, body))
        return law

    return mark


def compiled(law: Law) -> Law:
    """Returns a law compiled for arrays of `float`, or the law itself where that is not possible.

    The compiled law is as fast as a call from Python allows: give it few and whole arrays.
    """
    return _compiled(law) if is_available() else law


def is_available() -> bool:
    """Whether laws are compiled."""
    # numba takes linear algebra from SciPy.
    wanted = os.environ.get(SWITCH, "1") != "0"
    return wanted and all(importlib.util.find_spec(name) for name in ("numba", "scipy"))


@cache
def _compiled(law: Any) -> Any:
    import numba
    import scipy.linalg  # noqa: F401 - numba's linear algebra calls it

    from geoimp_drake.compilation.small_array_type import SmallArray  # noqa: F401 - numba learns of them

    _announce()
    _introduce_laws()
    try:
        dispatcher = numba.njit(cache=True, **_OPTIONS)(law)
    except RuntimeError:  # no folder that can be written: compile in every process
        return numba.njit(**_OPTIONS)(law)
    if _PACKAGE in Path(law.__code__.co_filename).resolve().parents:
        _discard_outdated(Path(dispatcher.stats.cache_path))
    return dispatcher


def _introduce_laws() -> None:
    """Lets numba compile the marked laws where a compiled one calls them."""
    from numba.extending import overload

    def given(body: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *_: body

    while _unknown:
        law, body = _unknown.pop()
        overload(law, strict=False, jit_options=_OPTIONS)(given(body))


@cache
def _announce() -> None:
    """Has the first compilation of a law, which takes a while, announced in the log."""
    from numba.core import event

    class Announcement(event.Listener):
        said = False

        def on_start(self, start: Any) -> None:
            function = getattr(start.data["dispatcher"], "py_func", None)
            if not self.said and str(_PACKAGE) in str(getattr(function, "__code__", "")):
                self.said = True
                _log.info("Compiling the control laws, once on this machine; this takes a while.")

        def on_end(self, end: Any) -> None:
            pass

    event.register("numba:compile", Announcement())


@cache
def _discard_outdated(folder: Path) -> None:
    """Forgets what was compiled from other sources.

    Numba itself compares the file of the compiled law alone, not those of the laws that it calls.
    """
    stamp = folder / "geoimp_drake.sources"
    if not stamp.exists() or stamp.read_text(encoding="utf-8") != _fingerprint():
        for index in folder.glob("*.nbi"):
            index.unlink(missing_ok=True)
        stamp.write_text(_fingerprint(), encoding="utf-8")


@cache
def _fingerprint() -> str:
    """Returns a hash of every source from which machine code is made."""
    digest = hashlib.sha256()
    for path in _sources():
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _sources() -> list[Path]:
    """Returns what may be compiled, and what says how."""
    parts = ("compilation", "rotations", "laws")
    return sorted(path for part in parts for path in (_PACKAGE / part).rglob("*.py"))
