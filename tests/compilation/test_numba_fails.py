"""Where numba is installed and does not work, laws run as written, with one warning of the cause.

Each cause is brought about in a process of its own.
"""

import os
import subprocess
import sys

import pytest

from geoimp_drake.compilation.compiled import is_available

pytestmark = pytest.mark.skipif(not is_available(), reason="numba is not installed")

USE = """
import numpy as np
from geoimp_drake.compilation.compiled import compiled, is_available
from geoimp_drake.rotations.so3 import cross, skew
laws = [compiled(cross), compiled(skew)]
print(is_available(), laws == [cross, skew], laws[0](np.eye(3)[0], np.eye(3)[1]))
"""


def use(before: str = "", **environment: str) -> tuple[str, str]:
    """Returns what the use of two laws prints, and what it says to the user.

    Coverage is not measured there: on a full disk it could not write what it found.
    """
    kept = {name: value for name, value in os.environ.items() if not name.startswith("COVERAGE_")}
    done = subprocess.run(
        [sys.executable, "-c", before + USE],
        env=kept | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip(), done.stderr


COMPILED, AS_WRITTEN = "True False [0. 0. 1.]", "False True [0. 0. 1.]"

# What is done to numba, and what the warning names.
CAUSES = {
    "a name that has moved": (
        "from numba.core import imputils; del imputils.impl_ret_borrowed",
        "impl_ret_borrowed",
    ),
    "a type that is refused": (
        "from numba import extending; extending.register_model = None",
        "not callable",
    ),
    "a name missed on compiling": (
        "from numba.core import cgutils; del cgutils.get_item_pointer",
        "get_item_pointer",
    ),
    "an option that has gone": ("import numba; numba.njit = lambda: None", "no_cfunc_wrapper"),
    "no SciPy": ("import sys; sys.modules['scipy'] = None", "scipy"),
}


def assert_one_warning(text: str, cause: str) -> None:
    assert text.count("laws run uncompiled") == 1
    assert cause in text
    assert "Traceback" not in text


@pytest.mark.parametrize(("before", "told"), CAUSES.values(), ids=CAUSES)
def test_a_numba_that_does_not_fit_leaves_laws_as_written(tmp_path, before, told) -> None:
    printed, text = use(before, NUMBA_CACHE_DIR=str(tmp_path))
    assert printed == AS_WRITTEN
    assert_one_warning(text, told)


@pytest.mark.parametrize("package", ["numba", "scipy"])
def test_a_package_that_cannot_be_imported_leaves_laws_as_written(tmp_path, package) -> None:
    (tmp_path / f"{package}.py").write_text("raise ImportError('made for another NumPy')")
    printed, text = use(f"import sys\nsys.path.insert(0, {str(tmp_path)!r})")
    assert printed == AS_WRITTEN
    assert_one_warning(text, "made for another NumPy")


def test_numba_switched_off_leaves_laws_as_written() -> None:
    printed, text = use(NUMBA_DISABLE_JIT="1")
    assert printed == AS_WRITTEN
    assert_one_warning(text, "NUMBA_DISABLE_JIT")


def test_a_numba_that_works_is_used_without_a_word() -> None:
    assert use() == (COMPILED, "")


@pytest.mark.parametrize("size", [0, 200], ids=["at the first byte", "at the first law"])
def test_on_a_full_disk_laws_are_compiled_in_memory(tmp_path, size) -> None:
    limit = f"from resource import *\nsetrlimit(RLIMIT_FSIZE, ({size}, RLIM_INFINITY))"
    printed, text = use(limit, NUMBA_CACHE_DIR=str(tmp_path))
    assert printed == COMPILED
    assert text.count("cannot be kept on disk") == 1
    assert "File too large" in text
    assert "Traceback" not in text
    assert not [*tmp_path.rglob("*.nb?")]
