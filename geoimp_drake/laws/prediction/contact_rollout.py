"""A hand that meets a wall, along the wall's normal: force over time; floats only.

The loop of `sampled_loop` along one direction, with a wall that only pushes and a D that moves.
Positions are relative to the wall's undeformed face, positive behind it.
"""

from typing import NamedTuple

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.laws.prediction.sampled_loop import SampledLoop
from geoimp_drake.typing import Array

__all__ = ["LOADS", "NormalLoop", "along", "contact_rollout"]

# Whose motion removes the tool's inertial load from a reading; a loop has the index.
LOADS = ("none", "plant", "reference")


class NormalLoop(NamedTuple):
    """A `SampledLoop` along one direction, with the attributes of the same names."""

    mobility: float  # Λ⁻¹ [1/kg]
    tool: float  # M_t [kg]
    mass_inverse: float  # M⁻¹ [1/kg], zero where C equals D
    damping: float  # D [Ns/m]
    stiffness: float  # K [N/m]
    K_D: float  # [1/s]
    K_P: float  # [1/s²]
    environment: float  # K_e [N/m]
    environment_damping: float  # D_e [Ns/m]
    step: float  # [s]
    filter_gain: float
    load: int  # index into LOADS
    is_direct: bool
    read_every: int
    sense_every: int
    sense_late: int


def along(loop: SampledLoop, direction: Array) -> NormalLoop:
    """Returns a loop along one direction, as if nothing moved across it.

    Args:
        loop: of a hand, in contact.
        direction: [rotation; translation] in W (6,), a unit vector.
    """
    matrices = [
        float(direction @ getattr(loop, name) @ direction) for name in NormalLoop._fields[:9]
    ]
    sampling = loop.read_every, loop.sense_every, loop.sense_late
    return NormalLoop._make(
        (
            *matrices,
            loop.step,
            loop.filter_gain,
            LOADS.index(loop.load),
            loop.is_direct,
            *sampling,
        )
    )


@compilable
def contact_rollout(loop: NormalLoop, desired: Array, force: Array) -> None:
    """Writes the force on the wall after each step of the plant.

    The hand starts at D, moving with it. As in Drake's plants, the wall acts only once touched,
    with the force at the end of a step, f = max(0, K_e x + D_e v). The wall's face is at x = 0.

    Args:
        loop: along the normal.
        desired: position, velocity and acceleration of D at the beginning of each step (n, 3).
        force: where to write (n,) [N].
    """
    T = loop.step
    x = x_read = c = desired[0, 0]
    v = v_read = w = desired[0, 1]
    h = reading = 0.0
    late = np.zeros(loop.sense_late + 1)
    for k in range(len(desired)):
        d, v_d, a_d = desired[k, 0], desired[k, 1], desired[k, 2]
        if loop.mass_inverse == 0.0:
            c, w = d, v_d
        elif loop.is_direct:
            c, w = x_read, v_read
        pushed = loop.damping * (w - v_d) + loop.stiffness * (c - d)
        a_C = a_d - loop.mass_inverse * (pushed + h)
        pull = loop.K_D * (w - v_read) + loop.K_P * (c - x_read)
        free = v + T * (a_C + pull + loop.mobility * h)
        f = _wall_force(loop, x, free)
        before, v = v, free - T * loop.mobility * f
        x += T * v
        force[k] = f
        a = (v - before) / T
        if k % loop.sense_every == 0:
            sample = k // loop.sense_every
            late[sample % len(late)] = f + loop.tool * a
            reading += loop.filter_gain * (late[(sample + 1) % len(late)] - reading)
            h = reading
            if loop.load == 1:
                h -= loop.tool * a
            elif loop.load == 2:
                h -= loop.tool * a_C
        if k % loop.read_every == 0:
            v_read, x_read = (x - x_read) / (T * loop.read_every), x
        c += T * w
        w += T * (a_d - loop.mass_inverse * (pushed + h))


@compilable
def _wall_force(loop: NormalLoop, x: float, free: float) -> float:
    """Returns f at the step's end, from x and the velocity that no wall would change [N]."""
    T, K_e, D_e = loop.step, loop.environment, loop.environment_damping
    v = (free - T * loop.mobility * K_e * x) / (1.0 + T * loop.mobility * (D_e + T * K_e))
    end = x + T * v
    return max(0.0, K_e * end + D_e * v) if end > 0.0 else 0.0
