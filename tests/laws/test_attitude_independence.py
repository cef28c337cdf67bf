"""What holds at every attitude of C, and by how much classical Euler fails it."""

from dataclasses import replace

import numpy as np
import pytest
from law_numerics import (
    INDEPENDENT_OF_ATTITUDE,
    assert_close,
    moments,
    random_attitude,
    random_family,
    random_spd,
    rate_of_change,
)

from geoimp_drake.laws.impedance.families import make_family
from geoimp_drake.rotations import quaternion

independent_families = pytest.mark.parametrize("name", INDEPENDENT_OF_ATTITUDE)


def stiffness_at_zero(family, Q_WC):
    """∂ᶜμ_E/∂(rotation of D seen from C) at zero displacement (3, 3), in C [Nm/rad]."""
    R_WC = quaternion.to_rotation(Q_WC)

    def moment_C(rotvec):
        Q_WD = quaternion.product(Q_WC, quaternion.exp(rotvec))
        return R_WC.T @ family.elastic_moment_W(Q_WD, Q_WC)

    return np.stack([rate_of_change(lambda d, e=e: moment_C(d * e)) for e in np.eye(3)], axis=-1)


def stiffness_errors(name, count=20):
    rng = np.random.default_rng(0)
    for _ in range(count):
        K_o = random_spd(rng, 1.0, 10.0)
        family = make_family(name, np.eye(3), np.eye(3), K_o)
        yield np.abs(stiffness_at_zero(family, random_attitude(rng)) - K_o).max()


@independent_families
def test_stiffness_at_zero_is_K_o_whatever_the_attitude(name):
    assert max(stiffness_errors(name)) < 1e-7


def test_stiffness_of_classical_euler_depends_on_the_attitude():
    worst = max(stiffness_errors("classical-euler"))
    print(f"classical Euler: stiffness at zero off K_o by up to {worst:.1f} Nm/rad")
    assert worst > 3.0
    K_o = np.diag([4.0, 1.0, 2.5])
    family = make_family("classical-euler", np.eye(3), np.eye(3), K_o)
    upright = stiffness_at_zero(family, np.array([1.0, 0.0, 0.0, 0.0]))
    assert_close(upright, K_o, atol=1e-8)  # T(0) = I


def turned(moment, Q):
    """The same motion described from a world frame turned by `Q`."""
    R = quaternion.to_rotation(Q)
    return replace(
        moment,
        Q_WD=quaternion.product(Q, moment.Q_WD),
        Q_WC=quaternion.product(Q, moment.Q_WC),
        **{key: R @ getattr(moment, key) for key in ("w_WD", "dw_WD", "w_WC", "dw_WC", "mu_W")},
    )


def change_when_W_turns(name, seed=0):
    """The largest change of ω̇_c [rad/s²] and its size, over random motions."""
    rng = np.random.default_rng(seed)
    change, size = 0.0, 0.0
    for moment in moments(30):
        family, Q = random_family(name, rng), random_attitude(rng)
        before = family.angular_acceleration(*moment.law_input())
        after = family.angular_acceleration(*turned(moment, Q).law_input())
        back = quaternion.to_rotation(Q).T @ after
        change = max(change, np.abs(back - before).max())
        size = max(size, np.abs(before).max())
    return change, size


@independent_families
def test_equations_of_motion_do_not_change_when_W_turns(name):
    change, size = change_when_W_turns(name)
    assert change < 1e-12 * size


def test_equations_of_classical_euler_change_when_W_turns():
    change, size = change_when_W_turns("classical-euler")
    print(f"classical Euler: ω̇_c changes by up to {change:.0f} of {size:.0f} rad/s²")
    assert change > 10.0
