"""Limits for an arm that may hit somebody, as a block before its controller."""

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.parts.safety_limits import SafetyConfig
from geoimp_drake.parts.safety_limits import SafetyLimits as SafetyLimitsPart
from geoimp_drake.systems.part_system import PartSystem
from geoimp_drake.typing import Array

__all__ = ["SafetyConfig", "SafetyLimits"]


class SafetyLimits(PartSystem):
    """Slows D, leashes it to C, and stops it at C when somebody is hit.

    ```
    desired_motion ─▶ safety ─safe_motion, stiffness_scale─▶ controller ─C, wrench─▶ safety
    ```

    - *Cap*: D moves to where it should be, at most with the speed (L.8), which follows from the
      effective mass in the direction of motion.
    - *Leash*: spring and damper between D and C pull with half of the force at most (L.9).
    - *Reaction*: once the wrist measures the force `detection`, D rests where C is, and K is
      multiplied by `softer`. This lasts until the simulation starts again.

    Where none of them acts, D passes unchanged, to the bit. D's attitude is not slowed. The force
    is that of the contact; the gains are those of the translation, in W.

    It is not a certified safety function: one computer and one sensor, whose faults nobody sees.

    Args:
        model: the arm.
        gains: M_p, D_p and K_p of the impedance (3, 3), in W.
        config: limits and their source.
        period: of a tick [s].

    Raises:
        ConfigurationError: a field of the configuration cannot be used.
        SignalError: a signal is not finite, or a quaternion not unit.

    Ports:
        input desired_motion: of D in W (19)
        input compliant_motion: of C in W when the last step began (19)
        input wrench: h by the end effector on the environment, about Eo, in W (6)
        input estimated_state: [q; v] of the arm (2n)
        output safe_motion: of D for the controller (19)
        output stiffness_scale: factors of K_p and K_o (2)
        output safety: D's greatest speed [m/s], how far D is held back [m], 1 after a reaction (3)
    """

    def __init__(
        self,
        model: ControlModel,
        gains: tuple[Array, Array, Array],
        config: SafetyConfig,
        period: float = 1e-3,
    ):
        super().__init__(SafetyLimitsPart(model, gains, config, period))
