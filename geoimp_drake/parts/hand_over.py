"""From one controller's torques to another's without a jump, and where to put D for that."""

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.frame_motion import (
    ACCELERATION,
    FRAME_MOTION_SIZE,
    FRAME_STATE_SIZE,
    POSITION,
    QUATERNION,
)
from geoimp_drake.laws.smooth_rest import smooth_step
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.part import Memory, Now, Output
from geoimp_drake.parts.signals import check_signal
from geoimp_drake.rotations import quaternion
from geoimp_drake.typing import Array
from geoimp_drake.validation import positive

__all__ = ["HandOver", "desired_at_equilibrium"]

# The search for D: step of the differences [m, rad], accelerations that count as none, and the
# number of steps after which it gives up.
_STEP, _AT_REST, _STEPS = 1e-6, 1e-9, 20


class HandOver:
    """The part of `systems.hand_over.HandOver`; arguments and errors are the same."""

    def __init__(self, num_joints: int, fade: float = 0.5, period: float = 1e-3):
        positive(fade, "fade", "s")
        positive(period, "period", "s")
        n = num_joints
        self._fade = fade
        self.inputs = {"torque_1": n, "torque_2": n, "selected": 1}
        # Which controller is on, since when [s], the old torques less the new ones then, and the
        # torques sent at the last sample.
        self.memory = Memory(on=0.0, since=-fade, difference=np.zeros(n), sent=np.zeros(n))
        self.samplings = ((period, self.sample),)
        signals = ("memory", "time", "torque_1", "torque_2")
        self.outputs = (
            Output("torque", n, lambda now, u: self._write(now.memory, now, u), signals),
        )

    def start(self, memory: Array, now: Now) -> None:
        """Begins with the selected controller, without a fade."""
        memory[self.memory.on] = float(now["selected"][0] > 0.5)
        memory[self.memory.since] = now.time - self._fade

    def sample(self, memory: Array, now: Now) -> None:
        """Notes the torques sent, and changes over if the other controller is now selected.

        Raises:
            SignalError: a torque that is passed on is NaN or infinite.
        """
        places, selected = self.memory, float(now["selected"][0] > 0.5)
        self._write(memory, now, memory[places.sent])
        check_signal(memory[places.sent], now.port(_name(memory[places.on])))
        if selected != memory[places.on]:
            memory[places.difference] = memory[places.sent] - now[_name(selected)]
            memory[places.on], memory[places.since] = selected, now.time

    def _write(self, memory: Array, now: Now, torque: Array) -> None:
        places = self.memory
        share, _, _ = smooth_step(now.time - memory[places.since], self._fade)
        torque[:] = now[_name(memory[places.on])] + (1.0 - share) * memory[places.difference]


def _name(selected: float) -> str:
    return "torque_2" if selected else "torque_1"


def desired_at_equilibrium(impedance: Impedance, compliant: Array, wrench: Array) -> Array:
    """Returns the motion (19) of a D at rest with which C stays at rest while a wrench acts.

    Without a moment, D is displaced by K_p⁻¹ f. The search, Newton's method by differences, works
    for every orientation family and for coupled stiffnesses. A controller that starts in contact
    with this D commands the torques that already act.

    Args:
        impedance: of the end effector.
        compliant: motion of C, whose pose is used (19).
        wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6) [Nm, N];
            finite.

    Raises:
        ConfigurationError: no D within reach balances the wrench: its moment is larger than the
            elastic moment of the family can be.
    """
    D = np.zeros(FRAME_MOTION_SIZE)
    D[:FRAME_STATE_SIZE] = compliant[:FRAME_STATE_SIZE]
    D[FRAME_STATE_SIZE - 6 : FRAME_STATE_SIZE] = 0.0
    C = D[:FRAME_STATE_SIZE].copy()
    for _ in range(_STEPS):
        a = _acceleration(impedance, D, C, wrench)
        if np.abs(a).max() < _AT_REST:
            return D
        slopes = [
            (_acceleration(impedance, _moved(D, step), C, wrench) - a) / _STEP
            for step in _STEP * np.eye(6)
        ]
        D = _moved(D, -np.linalg.lstsq(np.array(slopes).T, a, rcond=None)[0])
    raise ConfigurationError(
        f"No desired pose balances the wrench {np.round(wrench, 3).tolist()}: it is more than the "
        f"springs of '{impedance.rotation.name}' give. Raise the stiffness, or release the contact."
    )


def _acceleration(impedance: Impedance, D: Array, C: Array, wrench: Array) -> Array:
    return impedance.motion_of(D, wrench, C)[ACCELERATION]


def _moved(D: Array, step: Array) -> Array:
    """Returns a motion at rest turned by step[:3] [rad] and displaced by step[3:] [m], in W."""
    moved = D.copy()
    turned = quaternion.product(quaternion.exp(step[:3]), D[QUATERNION])
    moved[QUATERNION] = quaternion.normalized(turned)
    moved[POSITION] += step[3:]
    return moved
