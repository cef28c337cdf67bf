"""Stiffness and damping that change without giving out more energy than was stored."""

from geoimp_drake.parts import passive_gains as part
from geoimp_drake.parts.energy_tank import TankConfig
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.systems.part_system import PartSystem

__all__ = ["PassiveGains"]


class PassiveGains(PartSystem):
    """Passes changing gains on to an impedance, as far as an energy tank allows.

    A spring whose stiffness rises while it is loaded gains energy that no wrench has supplied, and
    may give it out. As a step begins, this block lets a share σ of the change take place,

        K := K + σ(K* − K),   E_tank := min(E_tank + W_D, Ē) − σΔ𝒰,   σ = min(1, E_tank/Δ𝒰)  (L.4)

    where Δ𝒰 is the energy that the whole change would put into the spring: the potential is that of
    the orientation family, with its coupling. What damping dissipates, W_D ≥ zᵀDz/Δt (L.5), fills
    the tank, and so does a stiffness that falls. So from any instant on, the impedance gives out at
    most the energy that it had stored plus that in the tank. Damping changes at once, since it only
    dissipates. While no change is asked for, the gains pass unchanged, to the bit.

    Args:
        springs: the impedance; it gives the gains that no signal sets.
        config: of the tank.

    Raises:
        ConfigurationError: the tank's numbers cannot be used.
        SignalError: a factor is not positive and finite, or a matrix is not finite, symmetric and
            positive semidefinite. Or it has a coupling that is not possible.

    Ports:
        input desired_motion: of D in W (19)
        input compliant_motion: of C in W (19)
        input stiffness_scale: factors of K_p and K_o, one each if not connected (2)
        input stiffness: K* (6×6) row by row, [angular; linear], as configured if not connected (36)
        input damping: D (6×6), the same (36)
        output stiffness: K (6×6), with its factors; a held state (36)
        output damping: D (6×6); a held state (36)
        output tank: energy in the tank; a held state (1) [J]
    """

    def __init__(self, springs: Impedance, config: TankConfig | None = None):
        super().__init__(part.PassiveGains(springs, config))
