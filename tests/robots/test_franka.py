"""A Franka arm that nobody here wrote: its own client and protocol, another physics engine.

The simulated robot of franky-sim runs in another process; all traffic is on loopback.
"""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant

from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.laws.frame_motion import POSITION
from geoimp_drake.parts.supervisor import Mode, SupervisorConfig
from geoimp_drake.robot_files.loading import load_robot
from geoimp_drake.robots.drive import Drive, DriveConfig
from geoimp_drake.robots.franka_arm import FrankaArm
from geoimp_drake.systems.sources.desired_motion import DesiredMotion, MotionSegment

SERVER = Path(__file__).resolve().parents[1] / "helpers" / "franka_server.py"
STIFFNESS = 500.0
# A machine with other work is late at times.
PATIENT = SupervisorConfig(hold=0.4)


class Server:
    """The robot's process, and the contact forces that it has printed."""

    def __init__(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, str(SERVER)], stdout=subprocess.PIPE, text=True
        )
        self.forces: list[float] = []
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.startswith("ready"):
                self.address = line.split()[1]
                break
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def _listen(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.startswith("force"):
                self.forces.append(float(line.split()[1]))

    def end(self) -> None:
        self.process.kill()
        self.process.wait()
        self._listener.join()
        assert self.process.stdout is not None
        self.process.stdout.close()


@pytest.fixture
def server() -> Iterator[Server]:
    server = Server()
    yield server
    server.end()


def controller() -> ControlLoop:
    plant = MultibodyPlant(1e-3)
    urdf = files("franky_sim") / "assets" / "fr3.urdf"
    robot = load_robot(str(urdf), plant, end_effector="fr3_link8", geometry="leave-out")
    plant.Finalize()
    config = ImpedanceControllerConfig()
    translation, rotation = config.impedance.translation, config.impedance.rotation
    translation.mass, translation.damping = np.array(20.0), np.array(600.0)
    translation.stiffness = np.array(STIFFNESS)
    rotation.mass, rotation.damping = np.array(4.0), np.array(40.0)
    rotation.stiffness = np.array(30.0)
    arm, E = robot.model_instance, robot.end_effector_frame
    return ControlLoop(plant, arm, E, config, gravity="robot", joints=FrankaArm("").joints)


def test_it_moves_freely_and_then_presses_on_a_box_as_the_impedance_says(server):
    loop, arm = controller(), FrankaArm(server.address)
    drive = Drive(arm, loop, DriveConfig(supervisor=PATIENT, keep=20.0))
    X_WE = loop.pose(drive.look().q)
    motion = DesiredMotion(
        X_WE,
        [
            MotionSegment(2.0, [0.0, 0.1, 0.05]),
            MotionSegment(2.0, [0.0, -0.1, -0.05]),
            MotionSegment(5.0, [0.0, 0.0, -0.16]),
            MotionSegment(2.5),
        ],
    )
    log = drive.run(motion, 11.5)
    assert log.values["mode"][-1] == Mode.STOPPED
    t = log.values["t"][:, 0] - log.values["t"][0, 0]
    E, C, D = (log.values[f"motion_{frame}"][:, POSITION] for frame in "ECD")
    free = t < 4.5
    assert np.linalg.norm(E - C, axis=1)[free].max() < 1e-3
    assert np.linalg.norm(E - C, axis=1).max() < 5e-3
    # At rest: what MuJoCo's contact feels against the spring from C to D.
    spring = STIFFNESS * (E - D)[-200, 2]
    felt = np.median(server.forces[-12:-4])
    assert spring > 15.0
    assert abs(felt - spring) < 0.1 * spring


def test_a_robot_that_falls_silent_is_braked_when_it_speaks_again(server, caplog):
    loop, arm = controller(), FrankaArm(server.address)
    drive = Drive(arm, loop, DriveConfig(supervisor=PATIENT, wrench="none"))
    X_WE = loop.pose(drive.look().q)

    def pause() -> None:
        os.kill(server.process.pid, signal.SIGSTOP)
        threading.Timer(0.8, lambda: os.kill(server.process.pid, signal.SIGCONT)).start()

    threading.Timer(2.0, pause).start()
    log = drive.run(DesiredMotion(X_WE, [MotionSegment(20.0, [0.0, 0.1, 0.0])]), 20.0)
    assert log.values["mode"][-1] == Mode.STOPPED
    assert log.ticks < 12_000
    assert any("no valid reading for" in record.getMessage() for record in caplog.records)
