"""Folders that a user has named for results: checked before anything is computed, written whole.

Nothing is written through a link that stands in such a folder. The folder itself may be a link.
"""

import secrets
import stat
from collections.abc import Iterable
from pathlib import Path

from geoimp_drake.errors import ConfigurationError

__all__ = ["FileWriter", "check_entries"]


def check_entries(folder: Path, files: Iterable[str]) -> None:
    """Raises ConfigurationError if something stands where a file is to be, or a folder above it.

    Args:
        folder: for results.
        files: their paths in it.
    """
    for file in files:
        parts = Path(file).parts
        for depth in range(1, len(parts) + 1):
            _check_entry(folder.joinpath(*parts[:depth]), is_file=depth == len(parts))


def _check_entry(path: Path, *, is_file: bool) -> None:
    """Raises ConfigurationError unless an entry is missing, or of the kind that is wanted."""
    try:
        mode = path.lstat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be written: {error.strerror}.") from None
    if not (stat.S_ISREG(mode) if is_file else stat.S_ISDIR(mode)):
        wanted = "file" if is_file else "folder"
        raise ConfigurationError(
            f"{path} cannot be written: there is {_kind(mode)} in the place of the {wanted}. Move "
            f"it away, or name another place."
        )


def _kind(mode: int) -> str:
    """Returns what an entry of a folder is, in words."""
    kinds = {stat.S_IFREG: "a file", stat.S_IFDIR: "a folder", stat.S_IFLNK: "a link"}
    return kinds.get(stat.S_IFMT(mode), "no regular file")


class FileWriter:
    """Writes each file under a name of its own first: a file that is there is whole.

    Args:
        folder: is made if need be.

    Attributes:
        files: that were written.
    """

    def __init__(self, folder: Path):
        self._folder = folder
        self.files: list[Path] = []

    def write(self, name: str, content: bytes | str) -> None:
        """Writes a file with its whole content, a text in UTF-8.

        Raises:
            ConfigurationError: a link or another thing that is no file stands in its place.
        """
        data = content.encode() if isinstance(content, str) else content
        check_entries(self._folder, [name])
        self._folder.mkdir(parents=True, exist_ok=True)
        # Nobody can have put a link under a name that nobody knows, and `x` follows none.
        part = self._folder / f".{secrets.token_hex(8)}.part"
        try:
            with part.open("xb") as file:
                file.write(data)
            part.replace(self._folder / name)
        finally:
            part.unlink(missing_ok=True)
        self.files.append(self._folder / name)
