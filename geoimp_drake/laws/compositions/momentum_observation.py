"""One step of a momentum observer in one call: dynamics (2.2), residual, and the wrench at E.

`*arm` are the fields of a `serial_chain.ChainArrays`, passed one by one because that is faster for
a compiled law. Floats only.
"""

from collections.abc import Callable
from functools import cache

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import sized
from geoimp_drake.laws.dynamics.linear_equations import solution
from geoimp_drake.laws.dynamics.serial_chain import (
    ChainArrays,
    chain_dynamics,
    chain_motion,
    chain_posture,
)
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.laws.sensing.momentum_observer import momentum_residual
from geoimp_drake.typing import Array

__all__ = ["external_wrench", "momentum_observation"]


@cache
def momentum_observation(n: int) -> Callable[..., bool]:
    """Returns the law of an arm of n joints."""

    def law(
        order: Array,
        actuation_order: Array,
        reading: Array,
        torque: Array,
        gain: float,
        elapsed: float,
        momentum: Array,
        forces: Array,
        residual: Array,
        *arm: Array,
    ) -> bool:
        """Moves the observer on by a step; returns False if a signal is not finite.

        Args:
            order: of the reading (2n,).
            actuation_order: which joint each actuator drives (n,).
            reading: at the end of the step (2n,) [rad, m; rad/s, m/s].
            torque: over the step, in the order of the actuators (n,) [Nm, N].
            gain: K [1/s].
            elapsed: of the step [s]; zero takes the reading alone, as at the start.
            momentum: p at the beginning, then at the end (n,).
            forces: Ḃq̇ − Cq̇ − Fq̇ − g at the beginning, then at the end (n,).
            residual: r at the beginning, then at the end (n,) [Nm, N].
            arm: its constants.
        """
        x, chain = reading[order], ChainArrays(*arm)
        if not is_finite(x) or not is_finite(torque):
            return False
        s, links, _ = chain_posture(chain, x[:n])
        inertia, inertia_rate, coriolis, weight = chain_dynamics(chain, s, links, x[n:])
        v, B, dB = sized(x[n:], n), sized(inertia, n, n), sized(inertia_rate, n, n)
        p = B @ v
        b = dB @ v - sized(coriolis, n) - sized(chain.friction, n) * v - sized(weight, n)
        if elapsed > 0.0:
            joint_torque = np.empty(n)
            for k in range(n):
                joint_torque[actuation_order[k]] = torque[k]
            # The mean of both ends leaves no error of first order in the step.
            mean = 0.5 * (sized(forces, n) + b) + sized(joint_torque, n)
            residual[:n] = momentum_residual(
                p, sized(momentum, n), mean, sized(residual, n), gain, elapsed
            )
        momentum[:n] = p
        forces[:n] = b
        return True

    return law


@compilable
def external_wrench(order: Array, reading: Array, external: Array, h: Array, *arm: Array) -> None:
    """Writes the wrench h by the end effector on its environment, about Eo, in W (6,).

    External torques are those of a wrench −h on the arm, τ_ext = −Jᵀh, in the least squares: with
    more than six joints what no wrench at E explains is left out.

    Args:
        order: of the reading (2n,).
        reading: [q; v] (2n,).
        external: τ_ext (n,) [Nm, N].
        h: where to write (6,).
        arm: its constants.

    Raises:
        numpy.linalg.LinAlgError: J is exactly singular.
    """
    x, n = reading[order], len(order) // 2
    s, _, X_WE = chain_posture(ChainArrays(*arm), x[:n])
    J = chain_motion(s, x[n:], X_WE[:, 3])[0]
    h[:6] = -solution(sized(J @ J.T, 6, 6), sized(J @ external, 6))
