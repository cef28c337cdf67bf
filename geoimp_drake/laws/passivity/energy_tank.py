"""Changing gains: the energy that a change puts into the spring comes from a tank."""

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.typing import Array

__all__ = ["least_dissipated", "taken_from_tank"]


@compilable
def least_dissipated(z: Array, D: Array, step: float) -> float:
    """(L.5) zᵀDz/Δt ≤ ∫ΔVᵀDΔV dt [J], the least that damping dissipates over z = ∫ΔV dt.

    The mean of squares is no less than the square of the mean, however V changes in between.

    Args:
        z: change of the displacement, [angular; linear] (6,).
        D: damping (6, 6).
        step: Δt, positive [s].
    """
    return z @ (D @ z) / step


def taken_from_tank(injected: float, gained: float, tank: float, cap: float) -> tuple[float, float]:
    """Returns the share σ of a change of K that takes place, and the energy then in the tank [J].

    (L.4) K := K + σ(K* − K),  E_tank := min(E_tank + W_D, Ē) − σΔ𝒰,  σ = min(1, E_tank/Δ𝒰)

    Δ𝒰 = 𝒰(K*) − 𝒰(K), at the present displacement, is the energy that the whole change would put
    into the spring. 𝒰 is linear in K, so a share of the change puts in that share of Δ𝒰. A change
    that takes energy out of the spring is never delayed, and that energy goes into the tank.

    Args:
        injected: Δ𝒰 [J].
        gained: W_D, what damping has dissipated since the last call [J].
        tank: E_tank [J].
        cap: Ē, the most that it holds [J].
    """
    tank = min(tank + gained, cap)
    if injected <= tank:
        return 1.0, min(tank - injected, cap)
    return tank / injected, 0.0
