"""Reading text files that a user names: whatever they are, in bounded time and memory."""

import stat
from pathlib import Path

from geoimp_drake.errors import ConfigurationError

__all__ = ["LARGEST_TEXT", "check_regular", "read_text"]

LARGEST_TEXT = 1_000_000  # [bytes]; a scenario has some thousand


def read_text(path: Path, what: str, largest: int = LARGEST_TEXT) -> str:
    """Returns the text of a file, UTF-8 with or without a byte order mark.

    Args:
        path: of the file.
        what: the kind of file, for errors.
        largest: the largest size that is read [bytes].

    Raises:
        ConfigurationError: as `check_regular`, or the file is not UTF-8.
    """
    check_regular(path, what, largest)
    try:
        return path.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(f"The {what} {path} cannot be read: {error}") from None


def check_regular(path: Path, what: str, largest: int = LARGEST_TEXT) -> None:
    """Raises ConfigurationError unless a path is a regular file of at most some size.

    A pipe or a device may never end, and a folder cannot be read.
    """
    try:
        status = path.stat()
    except (OSError, ValueError) as error:
        raise ConfigurationError(f"The {what} {path} cannot be read: {error}") from None
    if not stat.S_ISREG(status.st_mode):
        raise ConfigurationError(f"The {what} {path} cannot be read: it is not a regular file.")
    if status.st_size > largest:
        raise ConfigurationError(
            f"The {what} {path} has {status.st_size / 1e6:.3g} MB; at most {largest / 1e6:.3g} MB "
            f"are read."
        )
