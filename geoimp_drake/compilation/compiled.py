"""Laws compiled by numba where it is installed: the same functions, the same numbers, faster.

A law is written once, in Python. `@compilable` marks it as one that numba can compile and leaves it
as it is, so that it still takes arrays of Drake's `AutoDiffXd`. `compiled(law)` returns a compiled
form for arrays of `float`; laws called by a compiled law are compiled into it. Machine code is kept
on disk, see `machine_code.py`.

Without numba (the extra `fast`), or with the environment variable `GEOIMP_COMPILED=0`,
`compiled(law)` is the law itself. The same holds, with a warning, if numba is installed and does
not work. The first call imports numba.
"""

import importlib.util
import logging
import os
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from geoimp_drake.compilation.small_arrays import sized
from geoimp_drake.extras import how_to_install
from geoimp_drake.typing import Array

__all__ = ["bound", "compilable", "compilable_as", "compiled", "is_available"]

Law = TypeVar("Law", bound=Callable[..., Any])

SWITCH = "GEOIMP_COMPILED"

_log = logging.getLogger("drake")

# Laws not yet registered with numba, with what it compiles for each.
_unknown: list[tuple[Callable[..., Any], Callable[..., Any]]] = []

_marked: set[Callable[..., Any]] = set()

# Nothing calls a law from C; a tenth of the compilation is saved.
_OPTIONS = {"no_cfunc_wrapper": True}

_PACKAGE = Path(__file__).resolve().parents[1]


def compilable(law: Law) -> Law:
    """Marks a pure function on arrays as one that may be compiled; returns it unchanged."""
    return compilable_as(law)(law)


def compilable_as(body: Callable[..., Any]) -> Callable[[Law], Law]:
    """Marks a function for which `body` is compiled: numba has no such function, or a slow one."""

    def mark(law: Law) -> Law:
        if law not in _marked:
            _marked.add(law)
            _unknown.append((law, body))
        return law

    return mark


def compiled(law: Law) -> Law:
    """Returns a law compiled for arrays of `float`, or the law itself where that is not possible.

    A call from Python costs time for each argument: pass few, whole arrays.
    """
    return _compiled(law) if is_available() else law


def bound(law: Callable[..., Any], *arguments: Any) -> Callable[..., Any]:
    """Returns a compiled law with fixed first arguments: arrays, numbers, and tuples of them.

    A call from Python takes 50 ns and a piece of memory for each array that is passed. The fixed
    arguments are passed once; what the arrays hold may change later.

    Args:
        law: takes the fixed arguments, then those of a call.
        arguments: the fixed ones; arrays are contiguous.
    """
    if not is_available():
        return partial(law, *arguments)
    from geoimp_drake.compilation.kept_arguments import KeptArguments, kinds_of

    return KeptArguments(_bound(law, kinds_of(arguments)), arguments)


def is_available() -> bool:
    """Returns False if laws run as written."""
    wanted = os.environ.get(SWITCH, "1") != "0"
    return wanted and _is_installed() and _numba_works()


@cache
def _is_installed() -> bool:
    """Returns False, and says what to install, if numba is missing."""
    if importlib.util.find_spec("numba"):
        return True
    _log.info(f"Laws run as written; compiled ones are faster: {how_to_install('fast')}")
    return False


@cache
def _numba_works() -> bool:
    """Returns False, and warns, if numba fails or cannot be taught small arrays."""
    try:
        import numba

        if numba.config.DISABLE_JIT:
            raise RuntimeError("the environment variable NUMBA_DISABLE_JIT is set")
        import scipy.linalg  # noqa: F401 - numba takes linear algebra from it

        from geoimp_drake.compilation import small_array_operations  # noqa: F401 - teaches

        _announce()
        _compiled(_trial)(np.zeros(3))
    except Exception as error:  # of another release of numba, anything
        _log.warning("numba does not work here, so laws run uncompiled and slower: %r", error)
        return False
    return True


def _trial(a: Array) -> Array:
    return 2.0 * sized(a, 3)


@cache
def _compiled(law: Any) -> Any:
    return _made(law, law)


@cache
def _bound(law: Any, kinds: Any) -> Any:
    from geoimp_drake.compilation.kept_arguments import unpacked

    def call(address: int, *signals: Any) -> Any:
        return law(*(unpacked(kinds, address) + signals))

    compilable(law)
    return _made(law, call, str(kinds))


def _made(law: Any, body: Any, kinds: str = "") -> Any:
    """Returns `body` compiled by numba: the law, or the law with fixed arguments of some types."""
    import numba

    from geoimp_drake.compilation.machine_code import keep

    _introduce_laws()
    dispatcher = numba.njit(**_OPTIONS)(body)
    keep(dispatcher, law, kinds)
    compile_for = dispatcher._compile_for_args

    def chosen(*arguments: Any, **named: Any) -> Any:
        # Numba calls this for types that are new to it; floats do not come here again.
        as_written = any(getattr(a, "dtype", float) == "O" for a in arguments)
        return law if as_written else compile_for(*arguments, **named)

    dispatcher._compile_for_args = chosen
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
    """Logs the first compilation of a law, which takes a while."""
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
