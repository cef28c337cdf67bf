"""Damping that rises while a contact rings."""

from geoimp_drake.parts import adaptive_damping as part
from geoimp_drake.parts.adaptive_damping import AdaptiveDampingConfig
from geoimp_drake.systems.part_system import PartSystem

__all__ = ["AdaptiveDamping"]


class AdaptiveDamping(PartSystem):
    """Raises an impedance's damping while a contact gives out alternating energy.

    It observes that energy W as `PassivityObserver` does, and outputs the factor 1 + λ(c − 1),

        λ := λ + Δt/T₁ up to 1 while W > 0,   λ := λ(1 − Δt/T₂) otherwise     (L.7)

    Args:
        period: of wrench and readings [s].
        config: c, T₁, T₂, and how the energy is observed.

    Raises:
        ConfigurationError: a number cannot be used.
        SignalError: an input is not finite, or a quaternion not unit.

    Ports:
        input wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6)
        input measured_motion: of E in W (19)
        output damping_scale: factor of D; a held state (1)
        output given_out: work done so far on the environment; a held state (1) [J]
        output alternating: W; a held state (1) [J]
    """

    def __init__(self, period: float = 1e-3, config: AdaptiveDampingConfig | None = None):
        super().__init__(part.AdaptiveDamping(period, config))
