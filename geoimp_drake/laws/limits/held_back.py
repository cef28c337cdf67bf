"""The slack that the compliant frame takes up: what adds no energy, and the rest from a tank."""

from geoimp_drake.typing import Array

__all__ = ["held_back"]


def held_back(
    slack: Array, velocity: Array, M: Array, gained: float, tank: float, cap: float, step: float
) -> tuple[Array, float]:
    """Returns the acceleration of C beyond that of its law (6,), and the energy in the tank [J].

    (L.3) V̇_c := V̇_c + s,  Ė_tank = P_D − V_cᵀ M s while E_tank > 0, and at most the cap

    s = Jα + J̇q̇ − a is what the limits leave undone. The error E − C then obeys the motion loop's
    law as if there were no limits: nothing winds up. Ms is a wrench on C. The energy that it takes
    from C goes into a tank, and so does what the impedance's own damping dissipates. The energy
    that it gives to C comes out of the tank. If the tank holds too little for a step, s loses its
    part along V_c, which does the work. Floats only.

    Args:
        slack: s, [angular; linear] (6,), in W [rad/s², m/s²].
        velocity: V_c (6,), in W [rad/s, m/s].
        M: mass matrix of the impedance, in W (6, 6).
        gained: power P_D that damping dissipates [W].
        tank: energy in it [J].
        cap: the most that it holds [J].
        step: time since the last call [s].
    """
    Mv = M @ velocity
    power = float(Mv @ slack)
    tank = min(tank + step * gained, cap)
    if tank >= step * power:
        return slack, min(tank - step * power, cap)
    return slack - velocity * (power / float(Mv @ velocity)), tank
