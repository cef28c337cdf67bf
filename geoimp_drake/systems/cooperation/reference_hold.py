"""Both hands come to rest when a grasp has opened, and then do what the user has chosen."""

from geoimp_drake.parts.reference_hold import Hold, ReferenceHoldConfig
from geoimp_drake.systems.part_system import PartSystem

__all__ = ["ReferenceHold"]


class ReferenceHold(PartSystem):
    """Passes two reference motions on until a grasp opens; from then on they rest.

    It takes the references at the first sample at which `opened` is set. Their velocities then
    decay with the time constant T of the stop, v(t) = v exp(−t/T), angular velocity likewise. After
    `delay` follows one of these:

    - `hold`: both hands stay.
    - `release`: both hands stay, and the output `release` asks every hand that still holds the
      object to open its gripper.
    - `retreat`: every hand whose grasp has opened draws back from the other hand by
      `retreat_distance`, along the line between the references at the hold. It does so with a
      fifth-order polynomial in `retreat_duration`. A hand that holds the object stays.

    This lasts until the simulator is initialized again.

    Args:
        config: stop and reaction.
        period: sampling period [s].

    Raises:
        ConfigurationError: a field cannot be used.
        SignalError: a reference is NaN or infinite, or its quaternion is not unit.

    Ports:
        input reference_motion_1: of the first hand in W (19)
        input reference_motion_2: of the second (19)
        input opened: of `GraspMonitor` (3)
        output held_motion_1: of the first hand in W (19)
        output held_motion_2: of the second (19)
        output release: 1 for a hand that is to open its gripper, else 0 (2)
    """

    def __init__(self, config: ReferenceHoldConfig | None = None, period: float = 1e-3):
        super().__init__(Hold(config, period))
