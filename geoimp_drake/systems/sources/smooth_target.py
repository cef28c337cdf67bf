"""A desired motion towards a target pose that may be given anew at any time."""

import numpy as np
from pydrake.math import RigidTransform

from geoimp_drake.parts.smooth_target import SmoothedTarget
from geoimp_drake.systems.part_system import FlowingPartSystem

__all__ = ["SmoothTarget"]


class SmoothTarget(FlowingPartSystem):
    """Moves D towards a live target pose, with continuous velocity and acceleration.

    A new target may come at any time, also in mid-motion, and however far it jumps:

        p⃛_d = λ³ (p_t − p_d) − 3λ² ṗ_d − 3λ p̈_d,   ω̈_d = λ³ log(R_t R_dᵀ) − 3λ² ω_d − 3λ ω̇_d

    This is a filter with three equal poles. The rotation is filtered along the rotation vector in
    W, so that D takes the shorter way round, up to half a turn. From rest nothing overshoots. A
    step d has its largest velocity 0.27 λd and its largest acceleration 0.23 λ²d; λ is 8.4 divided
    by the settling time.

    Args:
        X_WD: where D rests at the start.
        settling: until 1 % of a step is left [s].
        speed: where the filter would be faster than this, D moves at this speed [m/s].
        angular_speed: the same for the rotation [rad/s].

    Raises:
        ConfigurationError: a number is not positive.
        SignalError: the target is NaN or infinite.

    Ports:
        input target: X_WT, the RigidTransform that D is to have; X_WD if not connected
        output motion: the motion of D in W (19)
    """

    def __init__(
        self,
        X_WD: RigidTransform,
        settling: float = 1.0,
        *,
        speed: float = np.inf,
        angular_speed: float = np.inf,
    ):
        super().__init__(SmoothedTarget(X_WD, settling, speed, angular_speed))
