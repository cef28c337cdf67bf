"""Machine code on disk is used as long as it can be read and is of these sources."""

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from geoimp_drake.compilation.compiled import _compiled, is_available
from geoimp_drake.rotations.so3 import cross

if not is_available():
    pytest.skip("numba is not installed", allow_module_level=True)

import numba

from geoimp_drake.compilation import machine_code as module

X, Y, Z = np.eye(3)


@pytest.fixture(autouse=True)
def folder(monkeypatch, tmp_path) -> Path:
    """An empty folder for machine code."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(module, "_failures", [])
    return tmp_path


def reads() -> int:
    """Uses a law as a new process would; returns how often machine code was read from disk."""
    module._discard_outdated.cache_clear()
    law = _compiled.__wrapped__(cross)
    np.testing.assert_array_equal(law(X, Y), Z)
    return sum(law.stats.cache_hits.values())


def only(folder: Path, pattern: str) -> Path:
    (path,) = folder.rglob(pattern)
    return path


def emptied(path: Path) -> None:
    path.write_bytes(b"")


def torn(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def garbage(path: Path) -> None:
    path.write_bytes(bytes(range(256)))


def of_another_kind(path: Path) -> None:
    path.write_bytes(pickle.dumps(numba.__version__) + pickle.dumps(None))


def unreadable(path: Path) -> None:
    """For root as well: it leads to itself."""
    path.unlink()
    path.symlink_to(path.name)


def folder_instead(path: Path) -> None:
    path.unlink()
    path.mkdir()


def test_machine_code_is_read_by_the_next_process() -> None:
    assert [reads(), reads()] == [0, 1]


@pytest.mark.parametrize(
    "damaged", [emptied, torn, garbage, of_another_kind, unreadable, folder_instead]
)
@pytest.mark.parametrize("kind", ["index", "data"])
def test_what_cannot_be_read_is_made_anew(folder, kind, damaged) -> None:
    reads()
    damaged(only(folder, {"index": "*.nbi", "data": "*.nbc"}[kind]))
    assert reads() == 0
    if damaged is folder_instead and kind == "data":  # found when it is to be written
        reads()
    assert reads() == 1


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read and write everything")
def test_permission_denied_is_no_error(folder) -> None:
    reads()
    only(folder, "*.nbi").chmod(0)
    assert [reads(), reads()] == [0, 1]
    stamp = only(folder, "*.sources")
    stamp.chmod(0)
    stamp.parent.chmod(0o500)
    assert reads() == 0
    stamp.parent.chmod(0o700)


def test_without_a_folder_laws_are_compiled_in_memory(monkeypatch, folder, caplog) -> None:
    (folder / "file").touch()
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(folder / "file" / "inside"))
    monkeypatch.setattr(numba.config, "CACHE_LOCATOR_CLASSES", "UserProvidedCacheLocator")
    assert [reads(), reads()] == [0, 0]
    assert len(caplog.records) == 1


def test_outdated_machine_code_is_not_used(folder) -> None:
    reads()
    only(folder, "*.sources").write_bytes(b"\xff of others")
    assert [reads(), reads()] == [0, 1]


@pytest.mark.parametrize("damaged", [unreadable, folder_instead])
def test_machine_code_of_unknown_sources_is_not_used(folder, damaged) -> None:
    reads()
    stamp = only(folder, "*.sources")
    damaged(stamp)
    assert [reads(), reads()] == [0, 0]
    stamp.unlink() if stamp.is_symlink() else stamp.rmdir()
    assert [reads(), reads()] == [0, 1]


def test_machine_code_that_cannot_be_discarded_is_not_used(monkeypatch, folder, caplog) -> None:
    def denied(*_, **__) -> None:
        raise PermissionError("the folder may only be read")

    reads()
    only(folder, "*.sources").write_text("others")
    monkeypatch.setattr(Path, "unlink", denied)
    assert [reads(), reads()] == [0, 0]
    assert len(caplog.records) == 1
    assert only(folder, "*.nbi").exists()


OF_ONE_NAME = """
import sys
import numpy as np
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.motion_control.orientation_control import orientation_law
from geoimp_drake.laws.motion_control.tracking_acceleration import tracking_acceleration

reference, gains, V = np.zeros(19), np.array([np.eye(3), np.eye(3)]), np.ones(6)
reference[:4], Q = [0.8, 0.6, 0.0, 0.0], np.array([0.8, 0.0, 0.6, 0.0])
for name in sys.argv[1:]:
    law = tracking_acceleration(orientation_law(name))
    found = np.zeros((2, 6))
    for form, a in zip((law, compiled(law)), found):
        assert form(reference, Q, np.zeros(3), V, gains, gains, a)
    np.testing.assert_allclose(*found, atol=1e-12, err_msg=name)
"""


def test_laws_of_one_name_compiled_in_different_processes_are_not_taken_for_each_other(
    folder,
) -> None:
    names = "angle-axis-sin", "angle-axis-simple", "angle-axis-tan-half"
    for given in (*((name,) for name in names), names):
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder)}
        subprocess.run([sys.executable, "-c", OF_ONE_NAME, *given], check=True, env=environment)


def test_sources_are_all_that_machine_code_is_made_from() -> None:
    names = {path.relative_to(module._PACKAGE).as_posix() for path in module._sources()}
    assert {
        "compilation/compiled.py",
        "compilation/small_array_type.py",
        "compilation/small_arrays.py",
        "laws/compositions/arm_torque.py",
        "rotations/so3.py",
    } <= names
