"""What the limits of two arms leave undone, as accelerations of object and mutual pose."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import sized
from geoimp_drake.laws.cooperation.absolute_velocity import absolute_velocity
from geoimp_drake.laws.cooperation.mutual_velocity import (
    mutual_angular_velocity,
    mutual_linear_velocity,
    mutual_velocity,
)
from geoimp_drake.laws.frame_motion import POSITION, QUATERNION
from geoimp_drake.rotations.quaternion import to_rotation
from geoimp_drake.typing import Array

__all__ = ["object_slack"]


@compilable
def object_slack(
    Q_W1: Array, motions: Array, slack_1: Array, slack_2: Array, slacks: Array
) -> None:
    """Writes the slacks of C and of the mutual pose (2, 6): (4.5) and (4.9) of accelerations.

    A slack is what an arm's limits leave undone of its hand's acceleration, see `held_back`. With
    both rows, the references of the hands accelerate by the hands' own slacks. Floats only.

    Args:
        Q_W1: orientation of the first hand (4,).
        motions: of the object, and of the mutual pose in its frames (2, 19).
        slack_1: of the first hand, [angular; linear], in W (6,) [rad/s², m/s²].
        slack_2: of the second (6,).
        slacks: where to write.
    """
    first, second = sized(slack_1, 6), sized(slack_2, 6)
    R_WO = to_rotation(sized(motions[0, QUATERNION], 4))
    of_object, mutual = absolute_velocity(first, second), mutual_velocity(first, second)
    slacks[0, :6] = of_object
    slacks[1, :3] = mutual_angular_velocity(to_rotation(sized(Q_W1, 4)), mutual[:3])
    p_12_W = R_WO @ sized(motions[1, POSITION], 3)
    slacks[1, 3:6] = mutual_linear_velocity(R_WO, of_object[:3], p_12_W, mutual[3:])
