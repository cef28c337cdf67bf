"""The energy that an end effector gives out, from its measured wrench and motion."""

from geoimp_drake.parts import passivity_observer as part
from geoimp_drake.parts.passivity_observer import ObserverConfig
from geoimp_drake.systems.part_system import PartSystem

__all__ = ["PassivityObserver"]


class PassivityObserver(PartSystem):
    """Sums up the work of the measured wrench on the measured motion of the end effector.

    Wrench and displacement are paired by steps: a wrench that arrives d periods late did its work
    on the displacement z of d periods ago. Paired with the present one, the work of a contact that
    rings would have the wrong sign. The work of what alternates,

        w = (h − h̄)ᵀ(z − z̄)     (L.6)

    is summed up while it is positive: this is a push. If a push follows another within half a
    second, and is at least half as strong, the contact rings. A single impact does not ring. Below
    about 1 mJ a push tells nothing.

    Args:
        period: of wrench and readings [s].
        config: the wrench's delay, and the criterion for alternating.

    Raises:
        ConfigurationError: a number cannot be used.
        SignalError: an input is not finite, or a quaternion not unit.

    Ports:
        input wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6)
        input measured_motion: of E in W (19)
        output given_out: work done so far on the environment; a held state (1) [J]
        output alternating: energy of a push while it rings, else zero; a held state (1) [J]
    """

    def __init__(self, period: float = 1e-3, config: ObserverConfig | None = None):
        super().__init__(part.PassivityObserver(period, config))
