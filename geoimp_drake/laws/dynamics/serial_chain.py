"""Kinematics (2.1) and dynamics (2.2) of a serial arm, for a compiled law that needs all of them.

Drake computes the same; from Python its calls cost several times what the arithmetic does.

Everything is expressed in W, and every spatial vector [angular; linear] is taken at the point that
coincides with W's origin: there velocities, inertias and forces of all links add without being
shifted. With s_j the axis of joint j, V_j the velocity of its link and I_j the link's inertia,

    V_j = V_{j−1} + s_j q̇_j,   ṡ_j = V_j × s_j,   İ_j = V_j ×* I_j − I_j V_j ×

so that, with sums over the links from j outwards,

    B_ij = s_iᵀ (Σ I) s_j  for i ≤ j,   (Cq̇)_j = s_jᵀ Σ (I A + İ V),   A = Σ ṡ q̇.

The inertia of a link is ten numbers, which add: mass, mass times the place of its centre, and
xx, yy, zz, xy, yz, zx of its rotational inertia about W's origin. Small vectors are tuples here:
compiled, they cost nothing. Floats only.
"""

from typing import NamedTuple

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import Row
from geoimp_drake.rotations.components import rows, xyz
from geoimp_drake.rotations.tuples import (
    ORIGIN,
    UNTURNED,
    Rows,
    attached,
    crossed,
    dot,
    plus,
    product,
    scaled,
    times,
    transposed,
    turn,
    write_pose,
)
from geoimp_drake.typing import Array

__all__ = [
    "ChainArrays",
    "chain_coriolis",
    "chain_dynamics",
    "chain_motion",
    "chain_posture",
]


class ChainArrays(NamedTuple):
    """An arm of n revolute or prismatic joints from base to hand.

    Frames: M moves with a joint, F is where M is at q = 0; E the end effector.
    """

    X_MF: Array  # pose of each F in the M before it, W before the first (n, 3, 4)
    axes: Array  # of the joints, in F (n, 3)
    turns: Array  # 1 for a revolute joint, 0 for a prismatic one (n,)
    masses: Array  # of the links (n,) [kg]
    centres: Array  # of mass, in M (n, 3) [m]
    inertias: Array  # about the centre of mass, in M (n, 3, 3) [kg m²]
    X_ME: Array  # pose of E in the last M (3, 4)
    rotors: Array  # reflected inertia of the rotors (n,) [kg m² or kg]
    friction: Array  # F of (2.2), viscous (n,) [Nm s/rad or N s/m]
    gravity: Array  # in W (3,) [m/s²]


@compilable
def chain_posture(arm: ChainArrays, q: Array) -> tuple[Array, Array, Array]:
    """Returns the joints' axes s (n, 6), the links' inertias (n, 10) and X_WE (3, 4).

    Args:
        arm: its constants.
        q: joint positions (n,) [rad, m].
    """
    n = len(q)
    s, links, X_WE = np.zeros((n, 6)), np.empty((n, 10)), np.empty((3, 4))
    R, p = UNTURNED, ORIGIN
    for j in range(n):
        R, p = attached(R, p, arm.X_MF[j])
        axis = xyz(arm.axes[j])
        a = times(R, axis)
        if arm.turns[j] > 0.0:
            R = product(R, turn(axis, q[j]))
            s[j, 0], s[j, 1], s[j, 2] = a
            s[j, 3], s[j, 4], s[j, 5] = crossed(p, a)
        else:
            p = plus(p, scaled(q[j], a))
            s[j, 3], s[j, 4], s[j, 5] = a
        _write_inertia(arm.masses[j], xyz(arm.centres[j]), rows(arm.inertias[j]), R, p, links[j])
    R, p = attached(R, p, arm.X_ME)
    write_pose(R, p, X_WE)
    return s, links, X_WE


@compilable
def chain_motion(s: Array, v: Array, p_WE: Array) -> tuple[Array, Array, Array]:
    """Returns the Jacobian J (6, n) of E, its velocity (2.1) J q̇ and its bias J̇ q̇ (6,).

    Args:
        s: of `chain_posture` (n, 6).
        v: joint velocities (n,).
        p_WE: E's origin (3,) [m].
    """
    n, p = len(v), xyz(p_WE)
    J, V_WE, Jdot_v = np.empty((6, n)), np.empty(6), np.empty(6)
    w, v_O, dw, dv_O = ORIGIN, ORIGIN, ORIGIN, ORIGIN
    for j in range(n):
        a, b = _halves(s[j])
        J[0, j], J[1, j], J[2, j] = a
        J[3, j], J[4, j], J[5, j] = plus(b, crossed(a, p))
        w, v_O = plus(w, scaled(v[j], a)), plus(v_O, scaled(v[j], b))
        da, db = crossed(w, a), plus(crossed(w, b), crossed(v_O, a))
        dw, dv_O = plus(dw, scaled(v[j], da)), plus(dv_O, scaled(v[j], db))
    v_WE = plus(v_O, crossed(w, p))
    V_WE[0], V_WE[1], V_WE[2] = w
    V_WE[3], V_WE[4], V_WE[5] = v_WE
    Jdot_v[0], Jdot_v[1], Jdot_v[2] = dw
    Jdot_v[3], Jdot_v[4], Jdot_v[5] = plus(plus(dv_O, crossed(dw, p)), crossed(w, v_WE))
    return J, V_WE, Jdot_v


@compilable
def chain_dynamics(
    arm: ChainArrays, s: Array, links: Array, v: Array
) -> tuple[Array, Array, Array, Array]:
    """Returns B, Ḃ, Cq̇ and g of (2.2); τ = g holds the arm at rest, Ḃ is exact.

    Args:
        arm: its constants.
        s: of `chain_posture` (n, 6).
        links: of `chain_posture` (n, 10).
        v: joint velocities (n,).
    """
    n = len(v)
    ds, dlinks, forces = _rates(s, links, v)
    gravity = xyz(arm.gravity)
    B, dB, g = np.empty((n, n)), np.empty((n, n)), np.empty(n)
    outward, doutward, f, df = np.zeros(10), np.zeros(10), np.empty(6), np.empty(6)
    for j in range(n - 1, -1, -1):
        outward += links[j]
        doutward += dlinks[j]
        f[:] = 0.0
        df[:] = 0.0
        _add_momentum(outward, _halves(s[j]), f)
        _add_momentum(outward, _halves(ds[j]), df)
        _add_momentum(doutward, _halves(s[j]), df)
        for i in range(j + 1):
            B[i, j] = B[j, i] = _dot(s[i], f)
            dB[i, j] = dB[j, i] = _dot(ds[i], f) + _dot(s[i], df)
        B[j, j] += arm.rotors[j]
        a, b = _halves(s[j])
        # The weight of the links from j outwards.
        moment = crossed((outward[1], outward[2], outward[3]), gravity)
        g[j] = -(dot(a, moment) + outward[0] * dot(b, gravity))
    return B, dB, _felt(s, forces), g


@compilable
def chain_coriolis(s: Array, links: Array, v: Array) -> Array:
    """Returns C(q, v)v (n,).

    Args:
        s: of `chain_posture` (n, 6).
        links: of `chain_posture` (n, 10).
        v: joint velocities (n,).
    """
    return _felt(s, _rates(s, links, v)[2])


@compilable
def _rates(s: Array, links: Array, v: Array) -> tuple[Array, Array, Array]:
    """Returns ṡ (n, 6), İ (n, 10) and the forces I A + İ V (n, 6) that the links' motion takes."""
    n = len(v)
    ds, dlinks, forces = np.empty((n, 6)), np.zeros((n, 10)), np.zeros((n, 6))
    w, v_O, dw, dv_O = ORIGIN, ORIGIN, ORIGIN, ORIGIN  # V and A
    for j in range(n):
        a, b = _halves(s[j])
        w, v_O = plus(w, scaled(v[j], a)), plus(v_O, scaled(v[j], b))
        da, db = crossed(w, a), plus(crossed(w, b), crossed(v_O, a))
        ds[j, 0], ds[j, 1], ds[j, 2] = da
        ds[j, 3], ds[j, 4], ds[j, 5] = db
        dw, dv_O = plus(dw, scaled(v[j], da)), plus(dv_O, scaled(v[j], db))
        _write_inertia_rate(links[j], w, v_O, dlinks[j])
        _add_momentum(links[j], (dw, dv_O), forces[j])
        _add_momentum(dlinks[j], (w, v_O), forces[j])
    return ds, dlinks, forces


@compilable
def _felt(s: Array, forces: Array) -> Array:
    """Returns what each joint feels of the forces (n, 6) on the links from it outwards (n,)."""
    felt, total = np.empty(len(s)), np.zeros(6)
    for j in range(len(s) - 1, -1, -1):
        total += forces[j]
        felt[j] = _dot(s[j], total)
    return felt


@compilable
def _write_inertia(mass: float, centre: Row, inertia: Rows, R: Rows, p: Row, link: Array) -> None:
    """Writes the ten numbers (10,) of a link whose frame has the pose R, p in W."""
    c = plus(p, times(R, centre))
    x, y, z = c
    I = product(product(R, inertia), transposed(R))  # noqa: E741 - its letter in (2.2)
    link[0], link[1], link[2], link[3] = mass, mass * x, mass * y, mass * z
    link[4], link[5] = I[0][0] + mass * (y * y + z * z), I[1][1] + mass * (z * z + x * x)
    link[6], link[7] = I[2][2] + mass * (x * x + y * y), I[0][1] - mass * x * y
    link[8], link[9] = I[1][2] - mass * y * z, I[2][0] - mass * z * x


@compilable
def _write_inertia_rate(link: Array, w: Row, v: Row, rate: Array) -> None:
    """Writes the rate (10,) of a link's inertia when it moves with [ω; v]."""
    mass, x, y, z, xx, yy, zz, xy, yz, zx = _ten(link)
    wx, wy, wz = w
    vx, vy, vz = v
    hx, hy, hz = plus(scaled(mass, v), crossed(w, (x, y, z)))
    rate[0], rate[1], rate[2], rate[3] = 0.0, hx, hy, hz
    # ω × I − I ω × and, for the centre that moves with v, 2 (h·v) 1 − v hᵀ − h vᵀ.
    rate[4] = 2.0 * (wy * zx - wz * xy + y * vy + z * vz)
    rate[5] = 2.0 * (wz * xy - wx * yz + z * vz + x * vx)
    rate[6] = 2.0 * (wx * yz - wy * zx + x * vx + y * vy)
    rate[7] = wy * yz - wz * yy + wz * xx - wx * zx - x * vy - y * vx
    rate[8] = wz * zx - wx * zz + wx * yy - wy * xy - y * vz - z * vy
    rate[9] = wx * xy - wy * xx + wy * zz - wz * yz - z * vx - x * vz


@compilable
def _add_momentum(link: Array, V: tuple[Row, Row], momentum: Array) -> None:
    """Adds the momentum [I ω + h × v; m v + ω × h] (6,) of an inertia (10,) moving with (ω, v)."""
    mass, x, y, z, xx, yy, zz, xy, yz, zx = _ten(link)
    (wx, wy, wz), (vx, vy, vz) = V
    momentum[0] += xx * wx + xy * wy + zx * wz + y * vz - z * vy
    momentum[1] += xy * wx + yy * wy + yz * wz + z * vx - x * vz
    momentum[2] += zx * wx + yz * wy + zz * wz + x * vy - y * vx
    momentum[3] += mass * vx + wy * z - wz * y
    momentum[4] += mass * vy + wz * x - wx * z
    momentum[5] += mass * vz + wx * y - wy * x


@compilable
def _ten(a: Array) -> tuple[float, ...]:
    return a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9]


@compilable
def _halves(V: Array) -> tuple[Row, Row]:
    return (V[0], V[1], V[2]), (V[3], V[4], V[5])


@compilable
def _dot(a: Array, b: Array) -> float:
    """The scalar product of two spatial vectors (6,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]
