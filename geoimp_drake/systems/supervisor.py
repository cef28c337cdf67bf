"""Supervision of an arm under control, as a block before and behind its controller."""

from geoimp_drake.parts.supervisor import Mode, Stop, SupervisorConfig, SupervisorLimits
from geoimp_drake.parts.supervisor import Supervisor as SupervisorPart
from geoimp_drake.systems.part_system import PartSystem
from geoimp_drake.typing import Array

__all__ = ["Mode", "Stop", "Supervisor", "SupervisorConfig", "SupervisorLimits"]


class Supervisor(PartSystem):
    """Starts an arm when all is well, and brakes and stops it when something is not.

    ```
    desired_motion, ─▶ supervisor ─supervised_*─▶ controller ─torque─▶ supervisor ─▶ arm
    wrench, state
    ```

    It waits for a valid reading; then the torques fade from the robot's own to the controller's.
    The last torques bridge a missing reading. In a soft start they do so, too, and the soft start
    goes on from them where it was. D comes to rest along `braked_motion`, and stays, in three
    cases. A reading is missing for too long, a signal exceeds its limit, or somebody asks for it.
    Torques never change faster than their limit. Drake's log has each change of mode with its
    reason. It is a warning if the arm is braked before its motion has ended.

    Joint readings and wrench reach the controller through this block, so that a faulty signal never
    does. A signal is faulty if it is not finite, or the same to the bit while D has moved by
    `limits.stuck`. The controller then gets the last valid one. Without a reading of the joints the
    torques stay, too, whatever the mode. A gap of 50 ms does no harm; an arm that is not read again
    needs its brakes. Without a wrench, D brakes from C instead of D, and h is zero: the arm stays
    where it is and presses no more. A wrench beyond its limit makes the arm brake, and the
    controller gets it with the limit as its length.

    ```
    INIT ─▶ SOFT_START ─▶ RUN ─▶ BRAKE ─▶ STOPPED
                 ▲         ▲
                 └─ HOLD ──┘        from any of the three ─▶ BRAKE
    ```

    It is not a certified safety function.

    Args:
        effort_limits: of the joints, in the order of the torques (n) [Nm, N].
        config: limits and times.
        period: of a tick [s].

    Raises:
        ConfigurationError: a field of the configuration cannot be used.

    Ports:
        input desired_motion: of D in W (19)
        input measured_motion: of E in W (19)
        input compliant_motion: of C in W (19)
        input wrench: h by the end effector on the environment, about Eo, in W (6)
        input torque: the one that the controller asks for (n)
        input measured_torque: the one that the robot exerts before it is taken over (n)
        input valid: 1 if there is a new reading, else 0 (1)
        input stop: to brake, see `Stop`; 1 if somebody asks for it, else 0 (1)
        input estimated_state: [q; v]; need not be connected if `supervised_state` is not (2n)
        output supervised_motion: D, or D as it comes to rest, for the controller (19)
        output supervised_torque: for the robot (n)
        output supervised_state: the last valid one, for the controller (2n)
        output supervised_wrench: the last valid one, within its limits, for the controller (6)
        output mode: see `Mode` (1)
    """

    def __init__(
        self,
        effort_limits: Array,
        config: SupervisorConfig | None = None,
        period: float = 1e-3,
    ):
        super().__init__(SupervisorPart(effort_limits, config, period))
