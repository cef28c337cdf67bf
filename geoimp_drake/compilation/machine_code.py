"""Machine code of laws on disk, beside their source or in numba's folder for the user.

Files that cannot be read are discarded and made again; where none can be written, laws are compiled
in every process. Machine code made from other sources of the library is not used. Numba itself
compares only the file of the compiled law, not the files of the laws that it calls.
"""

import contextlib
import glob
import hashlib
import logging
import secrets
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.bytecode import FunctionIdentity
from numba.core.caching import FunctionCache

__all__ = ["keep"]

_PACKAGE = Path(__file__).resolve().parents[1]

_log = logging.getLogger("drake")

# Numba tells functions of one name apart, such as the laws that a factory returns, by a number that
# counts from one in every process. If files of different processes hold functions of the same name
# and number, the linker takes one for both. So the numbers are random.
FunctionIdentity._unique_ids = iter(lambda: secrets.randbits(64), None)

# Why machine code was not kept; only the first reason is logged.
_failures: list[Exception] = []


def keep(dispatcher: Any, law: Callable[..., Any], kinds: str = "") -> None:
    """Keeps the machine code of a law's dispatcher on disk, where that is possible.

    Args:
        dispatcher: of the law.
        law: as written.
        kinds: types of the fixed arguments, see `compiled.bound`.
    """
    try:
        law_cache = _LawCache(law)
        law_cache.kinds = kinds
        _discard_outdated(Path(law_cache.cache_path))
    except (OSError, RuntimeError) as error:  # of a folder; numba: there is none to write to
        _warn(error)
    else:
        dispatcher._cache = law_cache


class _LawCache(FunctionCache):
    """Numba's files of one law; a fault of a file raises no error."""

    kinds = ""

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        return *super()._index_key(sig, codegen), self.kinds

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # a torn file can raise anything
            self._discard()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except Exception as error:
            self._discard()  # what stands in the way, or was written in part
            _warn(error)

    def _discard(self) -> None:
        name = glob.escape(self._impl.filename_base)
        for path in Path(self.cache_path).glob(f"{name}.*"):
            with contextlib.suppress(OSError):
                path.rmdir() if path.is_dir() else path.unlink()


def _warn(error: Exception) -> None:
    if not _failures:
        _log.warning("Compiled laws cannot be kept on disk: every process compiles them. %r", error)
    _failures.append(error)


@cache
def _discard_outdated(folder: Path) -> None:
    """Discards what was compiled from other sources of the library.

    Raises:
        OSError: that is not possible.
    """
    stamp = folder / "geoimp_drake.sources"
    with contextlib.suppress(OSError):
        if stamp.read_bytes() == _fingerprint():
            return
    for index in folder.glob("*.nbi"):
        index.unlink(missing_ok=True)
    stamp.write_bytes(_fingerprint())


@cache
def _fingerprint() -> bytes:
    """Returns a hash of every source from which machine code is made."""
    digest = hashlib.sha256()
    for path in _sources():
        digest.update(path.read_bytes())
    return digest.hexdigest().encode()


def _sources() -> list[Path]:
    """Returns the sources that may be compiled, and those that control how."""
    parts = ("compilation", "rotations", "laws")
    return sorted(path for part in parts for path in (_PACKAGE / part).rglob("*.py"))
