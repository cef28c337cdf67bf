"""A simulated arm at the other end of LCM: it sends statuses and obeys commands."""

import time
from typing import Any

import numpy as np
from pydrake.lcm import DrakeLcm

from geoimp_drake.robots.lcm_arm import LcmMessages, channels
from geoimp_drake.robots.plant_arm import PlantArm
from geoimp_drake.typing import Array

__all__ = ["LcmRobot"]

# After this time without a command the arm holds its weight alone [s]; drake-franka-driver's time.
_EXPIRY = 0.1


class LcmRobot:
    """Lets an arm in a plant speak Drake's messages of an iiwa or a Panda.

    The plant moves on by a status at a time, at real time unless told otherwise.

    Args:
        arm: in its plant; it holds its weight itself.
        robot: `iiwa` or `panda`.
        url: of LCM; empty for its own default.
        period: of the statuses, a multiple of the plant's step [s].
        channel: what the channels' names begin with; by default IIWA or PANDA.
    """
