"""Keeps caches elsewhere for a user whose home cannot be written to."""

import contextlib
import logging
import os
import stat
import tempfile
from pathlib import Path

__all__ = ["keep_caches"]

_log = logging.getLogger("drake")


def keep_caches() -> None:
    """Puts caches into a temporary folder of the user's own, if the home is read-only.

    These are the compiled laws, the converted meshes, and the caches of matplotlib and Drake.
    """
    if not _is_writable():
        with contextlib.suppress(OSError):  # nothing is kept then
            folder = _own_folder()
            os.environ["XDG_CACHE_HOME"] = str(folder)
            os.environ.setdefault("MPLCONFIGDIR", str(folder / "matplotlib"))
            _log.warning(f"Caches are kept in {folder}: the home cannot be written to.")


def _is_writable() -> bool:
    """Returns whether the user's folder for caches exists or can be made, and is writable."""
    try:
        folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # RuntimeError: there is no home
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def _own_folder() -> Path:
    """Returns the folder; raises OSError if another user owns it: machine code runs from it."""
    folder = Path(tempfile.gettempdir()) / f"geoimp_drake-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if found.st_uid != os.getuid() or stat.S_IMODE(found.st_mode) & 0o022 or folder.is_symlink():
        raise PermissionError(f"{folder} belongs to another user")
    return folder
