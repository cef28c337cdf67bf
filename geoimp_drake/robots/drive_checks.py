"""Checks before a drive: does the robot fit its controller, and is it the expected robot?"""

from geoimp_drake.controllers.admittance_controller import AdmittanceLoop
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.robots.robot_arm import RobotArm, RobotError, RobotStatus

__all__ = ["check_fit", "check_status", "check_wrench", "is_finite_status"]


def check_fit(robot: RobotArm, loop: ControlLoop | AdmittanceLoop) -> None:
    """Raises ConfigurationError if commands, joints, period or gravity do not fit."""
    if robot.takes != loop.gives:
        raise ConfigurationError(
            f"{robot.name} takes a {robot.takes} of each joint, and the controller gives a "
            f"{loop.gives}: scheme: admittance is for positions, inner-loop and direct are for "
            f"torques."
        )
    if tuple(robot.joints) != loop.joints.names:
        raise ConfigurationError(
            f"{robot.name} has the joints {', '.join(robot.joints)}; the controller's are "
            f"{', '.join(loop.joints.names)}. Make it with joints=robot.joints."
        )
    if abs(robot.period - loop.period) > 1e-9:
        raise ConfigurationError(
            f"{robot.name} ticks every {robot.period:g} s; the controller's sampling.period is "
            f"{loop.period:g} s. Give it the robot's."
        )
    if isinstance(loop, ControlLoop) and robot.gravity != loop.gravity:
        held = "be compensated twice" if robot.gravity == "robot" else "not be compensated"
        raise ConfigurationError(
            f"Gravity would {held}: "
            f"{robot.name} says that the {robot.gravity} does it, the controller was made with "
            f"gravity='{loop.gravity}'. Give it gravity='{robot.gravity}'."
        )


def check_wrench(robot: RobotArm, wrench: str | None) -> None:
    """Raises ConfigurationError if the wrench is to be observed where no torques are known."""
    if robot.takes == "position" and wrench in (None, "observer"):
        raise ConfigurationError(
            f"{robot.name} takes positions: what its servos exert is not known well enough to "
            f"observe a wrench. Give wrench: robot, a sensor's or the robot's own estimate."
        )


def check_status(
    status: RobotStatus | None, robot: RobotArm, loop: ControlLoop | AdmittanceLoop
) -> RobotStatus:
    """Returns a robot's first status; raises RobotError if it is missing or not of this arm."""
    n = len(loop.joints.names)
    if status is None:
        raise RobotError(f"{robot.name} does not answer. Is it switched on, and its address right?")
    counts = {len(values) for values in (status.q, status.v, status.torque)}
    if counts != {n}:
        reported = " or ".join(map(str, sorted(counts)))
        raise RobotError(f"{robot.name} reports {reported} joints; the controller has {n}.")
    if not is_finite_status(status):
        raise RobotError(
            f"{robot.name} reports q = {status.q}, v = {status.v}; these are not finite numbers."
        )
    return status


def is_finite_status(status: RobotStatus) -> bool:
    """Returns whether everything that a robot reports is finite."""
    values = (status.q, status.v, status.torque)
    more = (status.wrench, status.external_torque)
    return all(is_finite(value) for value in (*values, *more) if value is not None)
