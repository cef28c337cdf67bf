"""Where caches are kept for a user whose home cannot be written to."""

import contextlib
import logging
import os
import stat
import tempfile
from pathlib import Path

__all__ = ["keep_caches"]

_log = logging.getLogger("drake")


def keep_caches() -> None:
    """Puts caches into a temporary folder of the user's own, if the home takes none.

    These are the compiled laws and the converted meshes, and what matplotlib and Drake keep.
    """
    if not _is_writable():
        with contextlib.suppress(OSError):  # nothing is kept then
            folder = _own_folder()
            os.environ["XDG_CACHE_HOME"] = str(folder)
            os.environ.setdefault("MPLCONFIGDIR", str(folder / "matplotlib"))
            _log.warning(f"Caches are kept in {folder}: the home cannot be written to.")


def _is_writable() -> bool:
    """Whether the user's folder for caches is there, or can be made, and written to."""
    try:
        folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # the second: there is no home
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def _own_folder() -> Path:
    """Returns the folder; raises OSError if it is another's, since machine code is run from it."""
    folder = Path(tempfile.gettempdir()) / f"geoimp_drake-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if found.st_uid != os.getuid() or stat.S_IMODE(found.st_mode) & 0o022 or folder.is_symlink():
        raise PermissionError(f"{folder} belongs to somebody else")
    return folder
