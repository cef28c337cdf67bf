"""Each family knows where it is defined, and says so with the number."""

import numpy as np
import pytest
from law_numerics import assert_close, every_family, geometric_families, moments, random_family

from geoimp_drake.errors import ConfigurationError, OutOfDomainError, SingularityError
from geoimp_drake.laws.impedance.families import FAMILIES, make_family
from geoimp_drake.laws.motion_control.orientation_control import ORIENTATION_LAWS, orientation_law
from geoimp_drake.laws.motion_control.resolved_acceleration import (
    check_regular,
    resolved_acceleration,
)
from geoimp_drake.rotations import euler, quaternion

I3 = np.eye(3)
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
Y = np.array([0.0, 1.0, 0.0])


def turned_about_y(degrees):
    return quaternion.from_axis_angle(Y, np.radians(degrees))


@every_family
def test_family_carries_its_name_and_accepts_ordinary_attitudes(name):
    family = random_family(name, np.random.default_rng(0))
    assert family.name == name
    for moment in moments(20):
        family.check_domain(*moment.attitudes())


def test_unknown_names_are_refused_with_the_valid_ones():
    with pytest.raises(ConfigurationError, match=", ".join(FAMILIES)):
        make_family("euler", I3, I3, I3)
    with pytest.raises(ConfigurationError, match=", ".join(ORIENTATION_LAWS)):
        orientation_law("euler")
    assert list(FAMILIES) == list(ORIENTATION_LAWS)


@pytest.mark.parametrize(("name", "limit"), [("sin", 90), ("tan-half", 180), ("simple", 180)])
def test_angle_axis_refuses_its_largest_angle_wherever_C_is(name, limit):
    family = make_family(f"angle-axis-{name}", I3, I3, I3)
    for moment in moments(10):
        Q_WC = moment.Q_WC
        family.check_domain(quaternion.product(Q_WC, turned_about_y(limit - 0.2)), Q_WC)
        with pytest.raises(OutOfDomainError, match=f"f = {name}"):
            family.check_domain(quaternion.product(Q_WC, turned_about_y(limit + 1e-6)), Q_WC)


def test_quaternion_takes_every_attitude_and_is_continuous_through_a_half_turn():
    family = make_family("quaternion", I3, I3, np.diag([4.0, 1.0, 2.5]))
    before, after = turned_about_y(180.0 - 1e-6), turned_about_y(180.0 + 1e-6)
    family.check_domain(after, IDENTITY)
    moment = family.elastic_moment(before, IDENTITY)
    assert_close(family.elastic_moment(after, IDENTITY), moment, atol=1e-6)


@pytest.mark.parametrize("sign", [-1, 1])
def test_classical_euler_refuses_pitch_near_a_quarter_turn_of_either_frame(sign):
    family, steep = make_family("classical-euler", I3, I3, I3), turned_about_y(sign * 89.95)
    with pytest.raises(SingularityError, match=r"C in W.*0\.000873"):
        family.check_domain(IDENTITY, steep)
    with pytest.raises(SingularityError, match="D in W"):
        family.check_domain(steep, IDENTITY)
    family.check_domain(turned_about_y(sign * 88.0), turned_about_y(sign * 88.0))


def test_alternative_euler_refuses_relative_pitch_only():
    family, steep = make_family("alternative-euler", I3, I3, I3), turned_about_y(90.0)
    family.check_domain(steep, steep)
    with pytest.raises(SingularityError, match="D seen from C"):
        family.check_domain(steep, IDENTITY)


@geometric_families
def test_geometric_families_are_perfectly_conditioned(name):
    family = make_family(name, I3, I3, I3)
    assert family.conditioning(turned_about_y(89.0), IDENTITY) == 1.0


def test_conditioning_of_the_euler_families_is_that_of_their_T():
    D, C = turned_about_y(60.0), turned_about_y(85.0)
    classical = make_family("classical-euler", I3, I3, I3).conditioning(D, C)
    assert classical == pytest.approx(np.linalg.cond(euler.T(np.radians([0, 85, 0]))))
    alternative = make_family("alternative-euler", I3, I3, I3).conditioning(D, C)
    assert alternative == pytest.approx(np.linalg.cond(euler.T(np.radians([0, -25, 0]))))


def test_isotropic_quaternion_spring_never_holds_more_than_its_stiffness():
    family = make_family("quaternion", I3, I3, 2.5 * I3)
    held = [
        np.linalg.norm(family.elastic_moment(turned_about_y(degrees), IDENTITY))
        for degrees in range(0, 181, 5)
    ]
    assert max(held) == pytest.approx(2.5)
    assert np.argmax(held) == 90 // 5


def test_classical_euler_sees_no_jump_where_an_angle_wraps():
    family = make_family("classical-euler", I3, I3, I3)
    x = np.array([1.0, 0.0, 0.0])
    before = quaternion.from_axis_angle(x, np.pi - 0.01)
    after = quaternion.from_axis_angle(x, np.pi + 0.01)
    assert_close(family.displacement(after, before), 0.02 * x, atol=1e-12)


def test_singular_arm_is_reported_with_its_singular_value():
    J = np.diag([1.0, 1.0, 1.0, 1.0, 1.0, 0.0])
    with pytest.raises(np.linalg.LinAlgError):
        resolved_acceleration(J, np.zeros(6), np.ones(6))
    with pytest.raises(SingularityError, match="singular value of its Jacobian is 0,"):
        check_regular(J)
    with pytest.raises(SingularityError, match=r"0\.01, not above 0\.05"):
        check_regular(J + np.diag([0, 0, 0, 0, 0, 0.01]), 0.05)
    check_regular(np.eye(6))
