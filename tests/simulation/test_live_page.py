"""A run that is watched in a real browser: what it shows, and that its button pushes the hand."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
from browser import Visit, visit
from listening import listening
from live_trial import another_try

from geoimp_drake.simulation.live import INJECTED, PAUSE, PUSH, ROTATION, TRANSLATION

# At real time at most, so that there is time to start a browser and to press a button.
DURATION = 25.0
IN_THE_AIR = ("--set", "surface=null", "--no-figures")


def start(out: Path) -> subprocess.Popen[str]:
    """Starts a run that is shown, and returns it."""
    command = [sys.executable, "-m", "geoimp_drake.cli", "run", "plexiglas", "--meshcat"]
    options = [*IN_THE_AIR, "--duration", str(DURATION), "--out", str(out)]
    return subprocess.Popen([*command, *options], stderr=subprocess.PIPE, text=True)


def address(run: subprocess.Popen[str]) -> str:
    """Returns where the run is shown, as it says on the terminal."""
    assert run.stderr is not None
    for line in run.stderr:
        if found := re.search(r"Meshcat shows the run at (http://\S+)", line):
            return found[1]
    raise AssertionError("the run did not say where it is shown")


def open_controls(visited: Visit) -> None:
    """Opens the panel, which a small window hides."""
    button = visited.page.get_by_text("Open Controls")
    button.wait_for(state="attached")
    if button.is_visible():
        button.click()
    visited.page.get_by_text(PUSH).wait_for(state="visible")


@another_try
def test_the_page_has_its_controls_and_the_push_is_in_the_log(tmp_path):
    run = start(tmp_path / "out")
    try:
        url = address(run)
        assert listening([run.pid]) == {("127.0.0.1", int(url.rpartition(":")[2]))}
        with visit(url) as visited:
            open_controls(visited)
            shown = visited.page.inner_text("body")
            for name in (TRANSLATION, ROTATION, INJECTED, PUSH, PAUSE):
                assert name in shown
            visited.page.get_by_text(PUSH).click()
            visited.page.wait_for_timeout(1000)
            assert visited.errors == []
        _, said = run.communicate(timeout=120)
    finally:
        run.kill()
        run.communicate()  # closes what it was read through
    assert run.returncode == 0, said
    with np.load(tmp_path / "out" / "log.npz") as log:
        force = log["six/wrench_true"][:, 3]
    # By the environment on the hand along X: 20 N for half a second.
    assert -22.0 < force.min() < -18.0
    assert np.abs(force[-100:]).max() < 0.5
