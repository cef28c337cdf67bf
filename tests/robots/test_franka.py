"""A Franka arm that nobody here wrote: its own client and protocol, another physics engine.

The simulated robot of franky-sim runs in another process; all traffic is on loopback.
"""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from documents import README, blocks
from library_tree import ROOT
from live_trial import another_try, precedence
from pydrake.multibody.plant import MultibodyPlant

from geoimp_drake.cli import main
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.laws.frame_motion import POSITION
from geoimp_drake.parts.supervisor import Mode, SupervisorConfig
from geoimp_drake.robot_files.loading import load_robot
from geoimp_drake.robots.drive import Drive, DriveConfig
from geoimp_drake.robots.drive_log import DriveLog
from geoimp_drake.robots.franka_arm import FR3_JOINTS, FrankaArm
from geoimp_drake.robots.real_time import real_time, scheduler
from geoimp_drake.robots.robot_arm import RobotError, RobotStatus
from geoimp_drake.systems.sources.desired_motion import DesiredMotion, MotionSegment

SERVER = Path(__file__).resolve().parents[1] / "helpers" / "franka_server.py"
STIFFNESS = 500.0
ROTORS, DAMPING = [0.195] * 4 + [0.074] * 3, 0.21  # [kg m², Nms/rad]
pytestmark = another_try
# A machine with other work is late at times.
PATIENT = SupervisorConfig(hold=2.0)
IMPATIENT = SupervisorConfig(hold=0.4)


class Server:
    """The robot's process, and the contact forces that it has printed."""

    def __init__(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, str(SERVER)], stdout=subprocess.PIPE, text=True
        )
        self.forces: list[float] = []
        self.address, self._is_heard = "", threading.Event()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        self._is_heard.wait(60)
        if not self.address:
            self.end()
            raise RuntimeError("franky-sim is not ready within 60 s, or has ended before")

    def _listen(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            word, *values = line.split()
            if word == "ready":
                self.address = values[0]
                self._is_heard.set()
            elif word == "force":
                self.forces.append(float(values[0]))
        self._is_heard.set()  # it has ended

    def end(self) -> None:
        self.process.kill()
        self.process.wait(10)
        self._listener.join(10)
        assert self.process.stdout is not None
        self.process.stdout.close()


@pytest.fixture
def server() -> Iterator[Server]:
    with precedence():
        server = Server()
        yield server
        server.end()


def controller() -> ControlLoop:
    plant = MultibodyPlant(1e-3)
    urdf = files("franky_sim") / "assets" / "fr3.urdf"
    robot = load_robot(str(urdf), plant, end_effector="fr3_link8", geometry="leave-out")
    # What the file does not say of the robot's joints, and MuJoCo's model of it does.
    for joint, rotor in zip(FR3_JOINTS, ROTORS, strict=True):
        plant.GetJointActuatorByName(joint).set_default_rotor_inertia(rotor)
        plant.GetJointByName(joint).set_default_damping(DAMPING)
    plant.Finalize()
    config = ImpedanceControllerConfig()
    translation, rotation = config.impedance.translation, config.impedance.rotation
    translation.mass, translation.damping = np.array(20.0), np.array(600.0)
    translation.stiffness = np.array(STIFFNESS)
    rotation.mass, rotation.damping = np.array(4.0), np.array(40.0)
    rotation.stiffness = np.array(30.0)
    arm, E = robot.model_instance, robot.end_effector_frame
    return ControlLoop(plant, arm, E, config, gravity="robot", joints=FR3_JOINTS)


def drive(
    arm: FrankaArm,
    loop: ControlLoop,
    wrench: str,
    *segments: MotionSegment,
    supervisor: SupervisorConfig = PATIENT,
) -> DriveLog:
    drive = Drive(arm, loop, DriveConfig(supervisor=supervisor, keep=30.0, wrench=wrench))
    with real_time():
        before = scheduler()
        motion = DesiredMotion(loop.pose(drive.look().q), segments)
        log = drive.run(motion, motion.duration())
        assert scheduler() == before  # libfranka changes it
    return log


def errors(log: DriveLog, A: str, B: str) -> np.ndarray:
    """Returns the distance of two frames' origins at each tick [m]."""
    motions = (log.values[f"motion_{frame}"][:, POSITION] for frame in (A, B))
    return np.linalg.norm(np.subtract(*motions), axis=1)


def test_its_hand_follows_in_free_motion(server):
    """Within 1 mm; what is left, 0.3 mm, is the dry friction of MuJoCo's joints, 0.2 to 1.1 Nm."""
    arm = FrankaArm(server.address)
    log = drive(arm, controller(), "none", MotionSegment(1.5, [0.0, 0.1, 0.05]), MotionSegment(0.5))
    assert log.failure is None
    assert errors(log, "E", "D").max() < 1e-3


def test_the_program_of_the_page_lifts_its_hand(server):
    page = ROOT / "docs" / "howto" / "on_a_robot.md"
    texts = [block.text for block in blocks(page) if block.language == "python"]
    (program,) = [text for text in texts if "FrankaArm(" in text]
    (imports,) = [text.partition("\n\nplant =")[0] for text in texts if "\n\nplant =" in text]
    names: dict[str, Any] = {}
    exec(f"{imports}\n{program}", names)
    urdf = str(files("franky_sim") / "assets" / "fr3.urdf")
    log = names["lift_the_hand"](server.address, urdf, supervisor=PATIENT, wrench="none")
    assert log.failure is None
    assert errors(log, "E", "D").max() < 1e-3
    way = np.ptp(log.values["motion_E"][:, POSITION], axis=0)
    np.testing.assert_allclose(way, [0.0, 0.0, 0.05], rtol=0, atol=1e-3)


def test_the_scenario_of_the_readme_lifts_its_hand(server, tmp_path, monkeypatch, capsys):
    """C gives way to the dry friction, which the observer takes for a push, by 8 of 50 mm."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(files("franky_sim") / "assets" / "fr3.urdf", "fr3.urdf")
    (text,) = (block.text for block in blocks(README) if block.language == "yaml")
    Path("franka.yaml").write_text(text, "utf-8")
    here = [f"robot.driver.{it}" for it in (f"address={server.address}", "supervisor.hold=2.0")]
    drive = ["drive", "franka.yaml", *(word for one in here for word in ("--set", one))]
    assert main([*drive, "--dry-run"]) == 0
    assert "gravity is held by the robot" in capsys.readouterr().out
    assert main([*drive, "--no-figures"]) == 0
    with np.load("results/franka/log.npz") as log:
        E, C = (log[f"arm/motion_{frame}"][:, POSITION] for frame in "EC")
    assert 0.035 < E[-1, 2] - E[0, 2] < 0.051
    assert np.linalg.norm(E - C, axis=1).max() < 1e-3


def test_20_s_at_1_khz_in_free_motion_and_then_pressed_on_a_box(server):
    """The observer takes friction for a push, to which C gives way; the hand keeps to C."""
    arm, rest = FrankaArm(server.address), MotionSegment(2.0)
    there, back = MotionSegment(2.0, [0.0, 0.1, 0.05]), MotionSegment(2.0, [0.0, -0.1, -0.05])
    down = MotionSegment(6.0, [0.0, 0.0, -0.18])
    log = drive(arm, controller(), "observer", there, back, rest, down, MotionSegment(8.0))
    assert log.failure is None
    assert 20_000 < log.ticks < 21_000
    assert arm.success_rate >= (0.99 if is_on_time(log) else 0.8)
    t = log.values["t"][:, 0] - log.values["t"][0, 0]
    assert errors(log, "E", "C")[t < 6.0].max() < 1e-3
    assert errors(log, "E", "C").max() < 5e-3
    # At rest: what MuJoCo's contact feels against the spring from E to D.
    E, D = (log.values[f"motion_{frame}"][:, POSITION] for frame in "ED")
    spring = STIFFNESS * (E - D)[-300, 2]
    felt = -np.median(server.forces[-8:-3])
    assert spring > 15.0
    assert abs(felt - spring) < 0.1 * spring


def is_on_time(log: DriveLog) -> bool:
    """Whether this machine has time for both ends: each has a core, and the ticks are short."""
    has_cores = os.getloadavg()[0] <= (os.cpu_count() or 1)
    return has_cores and bool(np.quantile(log.computing, 0.99) < 5e-4)


def test_external_torques_are_those_that_act_on_the_joints():
    """libfranka's are measured torques less expected ones; `franky-sim` estimates none."""
    pushed = np.arange(7.0)
    state = SimpleNamespace(time=SimpleNamespace(to_sec=lambda: 1.0), q=[0.0] * 7, dq=[0.0] * 7)
    state.tau_J_d, state.tau_ext_hat_filtered = [0.0] * 7, (-pushed).tolist()
    state.tau_J = [3.0] * 7
    library = SimpleNamespace(read_once=lambda: state)
    arm = FrankaArm("nowhere")
    arm._robot = library
    np.testing.assert_array_equal(arm.connect().external_torque, pushed)
    state.tau_ext_hat_filtered = state.tau_J
    assert arm.connect().external_torque is None


def test_a_connection_that_fails_leaves_the_thread_as_it_was(monkeypatch):
    arm = FrankaArm("nowhere")

    def refuse(*_) -> None:
        with contextlib.suppress(PermissionError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(98))
        raise arm._library.NetworkException("another client has it")

    before = scheduler()
    monkeypatch.setattr(arm, "_ask", lambda: None)
    monkeypatch.setattr(arm._library, "Robot", refuse)
    with pytest.raises(RobotError, match="another client"):
        arm.connect()
    assert scheduler() == before


class Silenced(FrankaArm):
    """Stops the robot's process after some statuses: by their count, since machines are slow.

    Args:
        server: the robot.
        statuses: how many come before.
        pause: after which it goes on [s]; None for never.
    """

    def __init__(self, server: Server, statuses: int, pause: float | None = None):
        super().__init__(server.address)
        self._process, self._left, self._pause = server.process, statuses, pause

    def read(self) -> RobotStatus:
        """See `FrankaArm`."""
        self._left -= 1
        if self._left == 0:
            os.kill(self._process.pid, signal.SIGSTOP)
            if self._pause is not None:
                # By another process: libfranka waits, and may let no other thread run meanwhile.
                again = f"(sleep {self._pause}; kill -CONT {self._process.pid}) &"
                subprocess.run(["sh", "-c", again], check=True)
        return super().read()


def test_a_robot_that_falls_silent_ends_the_drive_and_is_named(server):
    """A real one stops by itself after 20 commands that did not come."""
    arm = Silenced(server, 2000)
    log = drive(arm, controller(), "none", MotionSegment(20.0, [0.0, 0.1, 0.0]))
    assert isinstance(log.failure, RobotError)
    assert f"franka {server.address}: " in str(log.failure)
    assert 1000 < log.ticks < 2100
    assert len(log.values["t"]) == log.ticks


def test_a_robot_that_pauses_is_braked_by_the_supervisor(server, caplog):
    """It is back before libfranka gives it up, but later than a status may be held."""
    arm = Silenced(server, 3000, pause=1.5 * IMPATIENT.hold)
    far = MotionSegment(20.0, [0.0, 0.1, 0.0])
    log = drive(arm, controller(), "none", far, supervisor=IMPATIENT)
    assert log.failure is None
    assert "stopped by its supervisor" in str(log.early)
    assert "to BRAKE, no valid reading for" in caplog.text
    modes = log.values["mode"][:, 0]
    assert [Mode(mode) for mode in dict.fromkeys(modes)][-2:] == [Mode.BRAKE, Mode.STOPPED]
    speed = np.linalg.norm(log.values["v"][modes == Mode.STOPPED], axis=1)
    assert speed[-1] < 0.02


def test_what_takes_the_connection_and_says_nothing_is_named(server):
    """It would hold libfranka, and with it the whole program, for ever."""
    os.kill(server.process.pid, signal.SIGSTOP)
    with pytest.raises(RobotError, match=r"does not answer within 1 s.*FCI"):
        FrankaArm(server.address, patience=1.0).connect()
