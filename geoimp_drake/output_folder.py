"""Folders that a user has named for results: checked before anything is computed, written whole.

Nothing is written through a link that stands in such a folder. The folder itself may be a link.
"""

import os
import secrets
import stat
import tempfile
from collections.abc import Iterable
from pathlib import Path

from geoimp_drake.errors import ConfigurationError, OutputError

__all__ = ["check_entries", "check_file", "check_folder", "write_file", "write_files"]


_PROBE = bytes(4096)  # what must at least find room


def check_folder(folder: Path, files: Iterable[str] = ()) -> None:
    """Raises ConfigurationError unless files can be written into a folder; leaves it as it was.

    Args:
        folder: for results; need not exist.
        files: their paths in it, see `check_entries`.
    """
    existing = next(path for path in (folder, *folder.absolute().parents) if os.path.lexists(path))
    missing = folder.absolute().parts[len(existing.absolute().parts) :]
    try:
        with tempfile.TemporaryDirectory(prefix=".", dir=existing) as probe:
            inner = Path(probe, *(part for part in missing if part != ".."))
            inner.mkdir(parents=True, exist_ok=True)
            (inner / "probe").write_bytes(_PROBE)
    except (OSError, ValueError) as error:
        where = "" if existing == folder else f"{existing}: "
        what = _reason(error) if os.path.isdir(existing) else f"{_found(existing)} and no folder"
        raise ConfigurationError(
            f"{folder} cannot be written: {where}{what}. Give another folder."
        ) from None
    check_entries(folder, files)


def check_file(path: Path) -> None:
    """Raises ConfigurationError unless a file can be written into a folder that exists."""
    if not os.path.isdir(path.parent):
        raise ConfigurationError(f"{path} cannot be written: there is no folder {path.parent}.")
    check_folder(path.parent, [path.name])


def check_entries(folder: Path, files: Iterable[str]) -> None:
    """Raises ConfigurationError if something else stands in place of a file or a folder above it.

    Args:
        folder: for results.
        files: their paths in it.
    """
    for file in files:
        parts = Path(file).parts
        for depth in range(1, len(parts) + 1):
            _check_entry(folder.joinpath(*parts[:depth]), is_file=depth == len(parts))


def _check_entry(path: Path, *, is_file: bool) -> None:
    """Raises ConfigurationError unless an entry is missing or of the wanted kind."""
    try:
        mode = path.lstat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be written: {error.strerror}.") from None
    if not (stat.S_ISREG(mode) if is_file else stat.S_ISDIR(mode)):
        wanted = "file" if is_file else "folder"
        raise ConfigurationError(
            f"{path} cannot be written: it is {_found(path)} in the place of a {wanted}. Move it "
            f"away, or name another place."
        )


def _found(path: Path) -> str:
    """Returns what there is at a path, in words."""
    kinds = {stat.S_IFREG: "a file", stat.S_IFDIR: "a folder", stat.S_IFLNK: "a link"}
    return kinds.get(stat.S_IFMT(path.lstat().st_mode), "a pipe or device")


def write_files(folder: Path, contents: Iterable[tuple[str, bytes | str]]) -> list[Path]:
    """Writes files, each under a temporary name first, so that every file found there is whole.

    Args:
        folder: created if need be.
        contents: name and content of each file, a text as UTF-8; taken one by one.

    Returns:
        The files.

    Raises:
        OutputError: some could not be written, as on a full disk; the message names them. All
            others are there.
    """
    written: list[str] = []
    failed: dict[str, Exception] = {}
    for name, content in contents:
        try:
            _write(folder, name, content.encode() if isinstance(content, str) else content)
        except (OSError, ConfigurationError) as error:
            failed[name] = error
        else:
            written.append(name)
    if failed:
        first = next(iter(failed.values()))
        raise OutputError(
            f"Not written in {folder}: {', '.join(failed)} ({_reason(first)}). "
            f"Written: {', '.join(written) or 'nothing'}."
        ) from first
    return [folder / name for name in written]


def write_file(path: Path, content: bytes | str) -> None:
    """Writes one file as `write_files` does."""
    write_files(path.parent, [(path.name, content)])


def _write(folder: Path, name: str, data: bytes) -> None:
    check_entries(folder, [name])
    folder.mkdir(parents=True, exist_ok=True)
    # Nobody can have put a link under a random name, and the mode `x` follows none.
    part = folder / f".{secrets.token_hex(8)}.part"
    try:
        with part.open("xb") as file:
            file.write(data)
        part.replace(folder / name)
    finally:
        part.unlink(missing_ok=True)


def _reason(error: Exception) -> str:
    """Returns why something cannot be written, in one line without a full stop."""
    return str(getattr(error, "strerror", None) or error).rstrip(".")
