"""Kinematics (2.1) and dynamics (2.2) of a serial arm, for a compiled law that needs all of them.

Drake computes the same, but from Python its calls cost several times as much as the arithmetic.

Everything is expressed in W, and every spatial vector [angular; linear] is taken at the point that
coincides with W's origin. There velocities, inertias and forces of all links add without being
shifted. With s_j the axis of joint j, V_j the velocity of its link and I_j the link's inertia,

    V_j = V_{j−1} + s_j q̇_j,   ṡ_j = V_j × s_j,   İ_j = V_j ×* I_j − I_j V_j ×

so that, with sums over the links from j outwards,

    B_ij = s_iᵀ (Σ I) s_j  for i ≤ j,   (Cq̇)_j = s_jᵀ Σ (I A + İ V),   A = Σ ṡ q̇.

The inertia of a link is ten numbers, which add. They are the mass, the mass times the position of
its centre, and the rotational inertia about W's origin (xx, yy, zz, xy, yz, zx). Floats only.
"""

from typing import NamedTuple

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import joined, sized, vector
from geoimp_drake.rotations.components import rows, xyz
from geoimp_drake.rotations.pose import compose
from geoimp_drake.rotations.so3 import cross, rotation_about
from geoimp_drake.typing import Array

__all__ = [
    "ChainArrays",
    "ChainValues",
    "chain_coriolis",
    "chain_dynamics",
    "chain_motion",
    "chain_posture",
    "chain_state",
    "chain_values",
]

_IDENTITY, _ZEROS = np.eye(3), np.zeros(10)


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


class ChainValues(NamedTuple):
    """The quantities of an arm at one instant; the laws below write them.

    The caller of a law provides the memory, since allocating it takes as long as filling it.
    """

    x: Array  # joint positions and velocities [q; q̇] (2n,)
    s: Array  # axes of the joints (n, 6)
    links: Array  # inertias of the links (n, 10)
    X_WE: Array  # pose of E (3, 4)
    J: Array  # Jacobian of E (6, n)
    V_WE: Array  # (2.1) velocity of E, J q̇ (6,)
    Jdot_v: Array  # bias acceleration J̇ q̇ (6,)
    B: Array  # inertia of (2.2) (n, n)
    dB: Array  # its rate Ḃ, exact (n, n)
    Cv: Array  # C(q, q̇) q̇ of (2.2) (n,)
    g: Array  # of (2.2); τ = g holds the arm at rest (n,)
    ds: Array  # rates of the axes (n, 6)
    dlinks: Array  # rates of the links' inertias (n, 10)
    forces: Array  # that the links' motion takes (n, 6)


@compilable
def chain_values(n: int) -> ChainValues:
    """Returns memory for an arm of n joints."""
    return ChainValues(
        x=np.zeros(2 * n),
        s=np.zeros((n, 6)),
        links=np.zeros((n, 10)),
        X_WE=np.zeros((3, 4)),
        J=np.zeros((6, n)),
        V_WE=np.zeros(6),
        Jdot_v=np.zeros(6),
        B=np.zeros((n, n)),
        dB=np.zeros((n, n)),
        Cv=np.zeros(n),
        g=np.zeros(n),
        ds=np.zeros((n, 6)),
        dlinks=np.zeros((n, 10)),
        forces=np.zeros((n, 6)),
    )


@compilable
def chain_state(order: Array, reading: Array, found: ChainValues) -> tuple[Array, Array]:
    """Writes [q; q̇], and returns q and q̇ (n,).

    Args:
        order: the places in the reading of the joints' [q; q̇] from base to hand (2n,).
        reading: at least (2n,) [rad, m; rad/s, m/s].
        found: where to write.
    """
    for k in range(len(order)):
        found.x[k] = reading[order[k]]
    n = len(order) // 2
    return found.x[:n], found.x[n:]


@compilable
def chain_posture(arm: ChainArrays, q: Array, found: ChainValues) -> None:
    """Writes the joints' axes s, the links' inertias and X_WE.

    Args:
        arm: its constants.
        q: joint positions (n,) [rad, m].
        found: where to write.
    """
    R, p = sized(_IDENTITY, 3, 3), sized(_ZEROS[:3], 3)
    for j in range(len(q)):
        R, p = compose(R, p, arm.X_MF[j])
        axis, s_j, link = sized(arm.axes[j], 3), found.s[j], found.links[j]
        a = R @ axis
        if arm.turns[j] > 0.0:
            R = R @ rotation_about(axis, q[j])
            s_j[:3] = a
            s_j[3:6] = cross(p, a)
        else:
            p = p + q[j] * a
            s_j[3:6] = a
        I_R = R @ sized(arm.inertias[j], 3, 3) @ R.T
        link[:10] = _inertia(arm.masses[j], p + R @ sized(arm.centres[j], 3), I_R)
    R, p = compose(R, p, arm.X_ME)
    found.X_WE[:3, :3] = R
    found.X_WE[:3, 3] = p


@compilable
def chain_motion(v: Array, found: ChainValues) -> None:
    """Writes J, V_WE and J̇ q̇.

    Args:
        v: joint velocities (n,).
        found: of `chain_posture`, and where to write.
    """
    p = sized(found.X_WE[:, 3], 3)
    V, A = sized(_ZEROS[:6], 6), sized(_ZEROS[:6], 6)
    for j in range(len(v)):
        s_j, column = sized(found.s[j], 6), found.J[:, j]
        column[:6] = _shifted(s_j, p)
        V = V + v[j] * s_j
        A = A + v[j] * _cross(V, s_j)
    V_E, A_E = _shifted(V, p), _shifted(A, p)
    found.V_WE[:6] = V_E
    found.Jdot_v[:3] = A_E[:3]
    found.Jdot_v[3:6] = A_E[3:] + cross(V_E[:3], V_E[3:])


@compilable
def chain_dynamics(arm: ChainArrays, v: Array, found: ChainValues) -> None:
    """Writes B, Ḃ, Cq̇ and g of (2.2).

    Args:
        arm: its constants.
        v: joint velocities (n,).
        found: of `chain_posture`, and where to write.
    """
    chain_coriolis(v, found, found.Cv)
    gravity, B, dB = sized(arm.gravity, 3), found.B, found.dB
    outward, doutward = sized(_ZEROS, 10), sized(_ZEROS, 10)
    for j in range(len(v) - 1, -1, -1):
        outward = outward + sized(found.links[j], 10)
        doutward = doutward + sized(found.dlinks[j], 10)
        s_j, ds_j = sized(found.s[j], 6), sized(found.ds[j], 6)
        f = _momentum(outward, s_j)
        df = _momentum(outward, ds_j) + _momentum(doutward, s_j)
        for i in range(j + 1):
            s_i, ds_i = sized(found.s[i], 6), sized(found.ds[i], 6)
            B[i, j] = B[j, i] = s_i @ f
            dB[i, j] = dB[j, i] = ds_i @ f + s_i @ df
        B[j, j] += arm.rotors[j]
        # The weight of the links from j outwards.
        found.g[j] = -(s_j[:3] @ cross(outward[1:4], gravity) + outward[0] * (s_j[3:] @ gravity))


@compilable
def chain_coriolis(v: Array, found: ChainValues, felt: Array) -> None:
    """Writes C(q, v)v (n,); ṡ, İ and the forces in `found` are then those of v, not of q̇.

    Args:
        v: joint velocities (n,).
        found: of `chain_posture`; ṡ, İ and the forces I A + İ V are written.
        felt: where to write.
    """
    V, A = sized(_ZEROS[:6], 6), sized(_ZEROS[:6], 6)
    for j in range(len(v)):
        s_j, link = sized(found.s[j], 6), sized(found.links[j], 10)
        V = V + v[j] * s_j
        ds_j, dlink = _cross(V, s_j), _inertia_rate(link, V)
        A = A + v[j] * ds_j
        rate, inertia_rate, force = found.ds[j], found.dlinks[j], found.forces[j]
        rate[:6] = ds_j
        inertia_rate[:10] = dlink
        force[:6] = _momentum(link, A) + _momentum(dlink, V)
    total = sized(_ZEROS[:6], 6)
    for j in range(len(v) - 1, -1, -1):
        total = total + sized(found.forces[j], 6)
        felt[j] = sized(found.s[j], 6) @ total


@compilable
def _inertia(mass: float, c: Array, I_c: Array) -> Array:
    """Returns the ten numbers (10,) of a link with centre of mass c and inertia I_c there, in W."""
    x, y, z = xyz(c)
    (xx, xy, _), (_, yy, yz), (zx, _, zz) = rows(I_c)
    return vector(
        mass,
        mass * x,
        mass * y,
        mass * z,
        xx + mass * (y * y + z * z),
        yy + mass * (z * z + x * x),
        zz + mass * (x * x + y * y),
        xy - mass * x * y,
        yz - mass * y * z,
        zx - mass * z * x,
    )


@compilable
def _inertia_rate(link: Array, V: Array) -> Array:
    """Returns the rate (10,) of a link's inertia when it moves with V (6,)."""
    mass, x, y, z, xx, yy, zz, xy, yz, zx = _ten(link)
    wx, wy, wz, vx, vy, vz = _six(V)
    # ω × I − I ω × and, for the centre that moves with v, 2 (h·v) 1 − v hᵀ − h vᵀ.
    return vector(
        0.0,
        mass * vx + wy * z - wz * y,
        mass * vy + wz * x - wx * z,
        mass * vz + wx * y - wy * x,
        2.0 * (wy * zx - wz * xy + y * vy + z * vz),
        2.0 * (wz * xy - wx * yz + z * vz + x * vx),
        2.0 * (wx * yz - wy * zx + x * vx + y * vy),
        wy * yz - wz * yy + wz * xx - wx * zx - x * vy - y * vx,
        wz * zx - wx * zz + wx * yy - wy * xy - y * vz - z * vy,
        wx * xy - wy * xx + wy * zz - wz * yz - z * vx - x * vz,
    )


@compilable
def _momentum(link: Array, V: Array) -> Array:
    """Returns [I ω + h × v; m v + ω × h] (6,) of an inertia (10,) moving with V = [ω; v] (6,)."""
    mass, x, y, z, xx, yy, zz, xy, yz, zx = _ten(link)
    wx, wy, wz, vx, vy, vz = _six(V)
    return vector(
        xx * wx + xy * wy + zx * wz + y * vz - z * vy,
        xy * wx + yy * wy + yz * wz + z * vx - x * vz,
        zx * wx + yz * wy + zz * wz + x * vy - y * vx,
        mass * vx + wy * z - wz * y,
        mass * vy + wz * x - wx * z,
        mass * vz + wx * y - wy * x,
    )


@compilable
def _cross(V: Array, s: Array) -> Array:
    """Returns V × s (6,), the rate of an axis s (6,) that moves with V."""
    w, a = V[:3], s[:3]
    return joined(cross(w, a), cross(w, s[3:]) + cross(V[3:], a))


@compilable
def _shifted(V: Array, p: Array) -> Array:
    """Returns V (6,) at the point p instead of W's origin."""
    return joined(V[:3], V[3:] + cross(V[:3], p))


@compilable
def _six(V: Array) -> tuple[float, ...]:
    return V[0], V[1], V[2], V[3], V[4], V[5]


@compilable
def _ten(a: Array) -> tuple[float, ...]:
    return a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9]
