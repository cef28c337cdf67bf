"""One step of a momentum observer in one call, (2.2) and (R.3); and the wrench at E in another.

Floats only.
"""

from collections.abc import Callable
from functools import cache

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import local, sized
from geoimp_drake.laws.dynamics.linear_equations import solution
from geoimp_drake.laws.dynamics.serial_chain import (
    ChainArrays,
    ChainValues,
    chain_dynamics,
    chain_motion,
    chain_posture,
    chain_state,
)
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.laws.sensing.momentum_observer import momentum_residual
from geoimp_drake.typing import Array

__all__ = ["external_wrench", "momentum_observation"]


@cache
def momentum_observation(n: int) -> Callable[..., bool]:
    """Returns the law of an arm of n joints."""

    def law(
        arm: ChainArrays,
        found: ChainValues,
        order: Array,
        actuation_order: Array,
        reading: Array,
        torque: Array,
        gain: float,
        elapsed: float,
        momentum: Array,
        forces: Array,
        residual: Array,
    ) -> bool:
        """Advances the observer by one step; returns False if a signal is not finite.

        Args:
            arm: its constants.
            found: memory for its quantities.
            order: of the reading (2n,), see `serial_chain.chain_state`.
            actuation_order: which joint each actuator drives (n,).
            reading: at the end of the step (2n,) [rad, m; rad/s, m/s].
            torque: over the step, in the order of the actuators (n,) [Nm, N].
            gain: K [1/s].
            elapsed: of the step [s]; zero takes the reading alone, as at the start.
            momentum: p at the beginning of the step; overwritten by that at its end (n,).
            forces: Ḃq̇ − Cq̇ − Fq̇ − g, likewise (n,) [Nm, N].
            residual: r, likewise; it stays if `elapsed` is zero (n,) [Nm, N].
        """
        q, velocity = chain_state(order, reading, found)
        if not is_finite(found.x) or not is_finite(torque):
            return False
        chain_posture(arm, q, found)
        chain_dynamics(arm, velocity, found)
        v, B, dB = sized(velocity, n), sized(found.B, n, n), sized(found.dB, n, n)
        p = B @ v
        b = dB @ v - sized(found.Cv, n) - sized(arm.friction, n) * v - sized(found.g, n)
        if elapsed > 0.0:
            joint_torque = local(v)
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
def external_wrench(
    arm: ChainArrays, found: ChainValues, order: Array, reading: Array, external: Array, h: Array
) -> None:
    """Writes the wrench h by the end effector on its environment, about Eo, in W (6,).

    External torques are those of a wrench −h on the arm, τ_ext = −Jᵀh, solved in the least-squares
    sense. With more than six joints, the part that no wrench at E explains is left out.

    Args:
        arm: its constants.
        found: memory for its quantities.
        order: of the reading (2n,), see `serial_chain.chain_state`.
        reading: [q; v] (2n,).
        external: τ_ext (n,) [Nm, N].
        h: where to write (6,).

    Raises:
        numpy.linalg.LinAlgError: J is exactly singular.
    """
    q, v = chain_state(order, reading, found)
    chain_posture(arm, q, found)
    chain_motion(v, found)
    J = found.J
    h[:6] = -solution(sized(J @ J.T, 6, 6), sized(J @ external, 6))
