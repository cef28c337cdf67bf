"""Packages that some uses need and an extra of this project brings."""

import contextlib
from collections.abc import Iterator

from geoimp_drake.errors import MissingPackageError, one_line

__all__ = ["how_to_install", "needs_extra"]


@contextlib.contextmanager
def needs_extra(extra: str, what: str, instead: str = "") -> Iterator[None]:
    """Turns an import that fails into one line that says what to install.

    Args:
        extra: the one of this project that brings what is imported.
        what: the use that needs it, as the beginning of a sentence.
        instead: a sentence about what can be done without it.
    """
    try:
        yield
    except ImportError as error:
        is_missing = isinstance(error, ModuleNotFoundError)
        needed = f"the package {error.name}" if is_missing else f"what fails ({one_line(error)})"
        raise MissingPackageError(
            f"{what} needs {needed}: {how_to_install(extra)} {instead}".rstrip()
        ) from None


def how_to_install(extra: str) -> str:
    """Returns the command that installs an extra, with a full stop."""
    return f"pip install 'geoimp-drake[{extra}]'."
