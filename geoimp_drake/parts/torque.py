"""Joint torques, and the watch over their limits."""

import logging

import numpy as np

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.motion_control.inverse_dynamics import actuation, peak_effort
from geoimp_drake.parts.part import Memory, Now, Output, held
from geoimp_drake.parts.signals import check_signal
from geoimp_drake.typing import Array

__all__ = ["Saturation", "Torque"]

_log = logging.getLogger("drake")

_NONE: list[int] = []


class Saturation:
    """Remembers the largest torques as fractions of the limits, and warns of new saturations.

    Args:
        model: the arm's control model.
        consequence: of a saturation, for the warning.

    Attributes:
        limits: of the torques, in the order of the actuators (n,) [Nm, N].
    """

    def __init__(self, model: ControlModel, consequence: str = "the plant clamps it"):
        self._model, self._consequence = model, consequence
        self.limits = model.effort_limits[model.actuation_order]
        self._law = compiled(peak_effort)
        self.memory = Memory(peak=np.zeros(model.num_joints))

    def compare(self, memory: Array, torque: Array) -> list[int]:
        """Updates the fractions; returns which actuators have just passed their limits.

        Args:
            memory: (n,), updated.
            torque: requested, in the order of the actuators (n,) [Nm, N].
        """
        return self.which(self._law(torque, self.limits, memory))

    def which(self, passed: int) -> list[int]:
        """Returns the actuators whose bits are set in `passed`, what `peak_effort` returns."""
        return [k for k in range(len(self.limits)) if passed >> k & 1] if passed else _NONE

    def report(self, saturated: list[int], torque: Array, system: str, time: float) -> None:
        """Warns of new saturations.

        Args:
            saturated: the actuators, see `compare`.
            torque: requested (n,) [Nm, N].
            system: the name in the warning.
            time: [s].
        """
        model = self._model
        for k in saturated:
            joint = model.actuation_order[k]
            _log.warning(
                f"{system}: joint '{model.joint_names[joint]}' saturates at t = "
                f"{time:.3f} s: {torque[k]:.1f} asked, the limit is "
                f"±{model.effort_limits[joint]:g}; {self._consequence}."
            )


class Torque:
    """The part of `InverseDynamicsInnerLoop`; arguments and errors are the same."""

    def __init__(self, model: ControlModel):
        self._order, n = model.actuation_order, model.num_joints
        self._saturation, self._law = Saturation(model), compiled(actuation)
        self.models = [model]
        self.inputs = {"joint_acceleration": n, "arm": object(), "wrench": 6}
        self.memory = self._saturation.memory
        self.outputs = (
            Output("actuation", n, self._write, tuple(self.inputs)),
            held("peak_effort", self.memory.peak),
        )

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Compares the torques that this step uses with the limits."""
        torque = now.output("actuation")
        saturated = self._saturation.compare(memory, torque)
        if saturated:
            self._saturation.report(saturated, torque, now.system, now.time)

    def _write(self, now: Now, u: Array) -> None:
        arm, h, alpha = now["arm"], now["wrench"], now["joint_acceleration"]
        if not self._law(arm.B, alpha, arm.Cv, arm.Fv, arm.g, arm.Jv_V_WE, h, self._order, u):
            check_signal(h, now.port("wrench"))
            check_signal(alpha, now.port("joint_acceleration"))
