"""The ramp of an applied wrench: linear with fourth-order blends, constant in W."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, SpatialInertia

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.systems.sources.external_wrench import (
    ExternalWrench,
    WrenchRamp,
    linear_with_fourth_order_blends,
)
from geoimp_drake.validation import check

START, DURATION, BLEND = 0.5, 1.0, 0.2


@pytest.fixture
def profile():
    return linear_with_fourth_order_blends(START, DURATION, BLEND)


def values(profile, order, times):
    derivative = profile.MakeDerivative(order)
    return np.array([derivative.value(t)[0, 0] for t in times])


def test_ramp_goes_from_zero_to_one_and_stays(profile):
    assert values(profile, 0, [0.0, START]) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert values(profile, 0, [START + DURATION, 9.0]) == pytest.approx([1.0, 1.0])


def test_middle_is_linear_at_the_rate_of_the_shortened_ramp(profile):
    times = np.linspace(START + BLEND, START + DURATION - BLEND, 20)
    assert np.ptp(values(profile, 1, times)) < 1e-9
    assert values(profile, 1, [1.0]) == pytest.approx([1 / (DURATION - BLEND)])


def test_rate_and_its_derivative_are_continuous_at_every_blend(profile):
    joints = (START, START + BLEND, START + DURATION - BLEND, START + DURATION)
    for order, jump in ((1, 1e-6), (2, 1e-3)):
        for time in joints:
            before, after = values(profile, order, [time - 1e-8, time + 1e-8])
            inside = START < time < START + DURATION
            assert abs(after - before) < jump if inside else max(abs(before), abs(after)) < jump


def test_blends_are_of_fourth_order(profile):
    assert values(profile, 4, [START + 0.05])[0] != 0
    assert values(profile, 5, [START + 0.05])[0] == 0


def test_ramp_is_symmetric_about_its_middle(profile):
    offsets = np.linspace(0.0, DURATION / 2, 11)
    up = values(profile, 0, START + DURATION / 2 + offsets)
    down = values(profile, 0, START + DURATION / 2 - offsets)
    assert up + down == pytest.approx(np.ones(11))


def test_ramp_of_two_blends_has_no_linear_part():
    profile = linear_with_fourth_order_blends(0.0, 1.0, 0.5)
    assert values(profile, 0, [0.0, 0.5, 1.0]) == pytest.approx([0.0, 0.5, 1.0], abs=1e-12)


def test_a_wrench_goes_as_it_came():
    ramp = WrenchRamp(start=START, duration=DURATION, blend=BLEND, until=4.0)
    times = np.linspace(0.0, DURATION, 11)
    came = [ramp.profile()(START + t) for t in times]
    assert [ramp.profile()(4.0 + t) for t in times] == pytest.approx(1.0 - np.array(came))
    assert ramp.profile()(3.9) == pytest.approx(1.0)
    assert ramp.profile()(9.0) == pytest.approx(0.0)
    stays = WrenchRamp(start=START, duration=DURATION, blend=BLEND)
    assert stays.profile()(9.0) == pytest.approx(1.0)


@pytest.mark.parametrize("axes", ["world", "frame"])
def test_wrench_acts_at_the_frame_in_the_axes_that_are_named(axes):
    plant = MultibodyPlant(time_step=1e-3)
    body = plant.AddRigidBody("hand", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.1))
    X_BF = RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [0.1, -0.2, 0.3])
    frame = plant.AddFrame(FixedOffsetFrame("F", body.body_frame(), X_BF))
    plant.Finalize()
    R_WF0 = RollPitchYaw(1.0, -0.5, 2.0).ToRotationMatrix().matrix()
    ramp = WrenchRamp(moment=np.array([0, 0, 2.5]), force=np.array([1.0, 2.0, 3.0]), axes=axes)
    system = ExternalWrench(frame, ramp, R_WF0)
    context = system.CreateDefaultContext()
    context.SetTime(0.5)
    (applied,) = system.get_output_port().Eval(context)
    assert applied.body_index == body.index()
    assert applied.p_BoBq_B == pytest.approx(X_BF.translation())
    R = R_WF0 if axes == "frame" else np.eye(3)
    assert applied.F_Bq_W.rotational() == pytest.approx(0.5 * R @ ramp.moment)
    assert applied.F_Bq_W.translational() == pytest.approx(0.5 * R @ ramp.force)


def test_axes_of_a_frame_need_to_be_known():
    plant = MultibodyPlant(time_step=1e-3)
    plant.Finalize()
    with pytest.raises(ConfigurationError, match=r"external\.axes is 'frame'; give R_WF0"):
        ExternalWrench(plant.world_frame(), WrenchRamp(axes="frame"))


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("moment", np.array([0, np.nan, 0]), "external.moment.*nan"),
        ("force", np.zeros(2), "external.force.*3"),
        ("axes", "E", "external.axes 'E'.*frame, world"),
        ("start", -1.0, "external.start is -1"),
        ("duration", 0.0, "external.duration is 0"),
        ("blend", 1e-20, "external.blend is 1e-20"),
        ("until", 0.9, r"external.until is 0.9 s.*full size at 1 s and cannot end before"),
        ("until", np.nan, r"external.until"),
        ("blend", 0.6, r"external.blend is 0.6 s.*two of them.*1 s"),
    ],
)
def test_bad_ramp_is_refused(field, value, message):
    ramp = WrenchRamp()
    setattr(ramp, field, value)
    with pytest.raises(ConfigurationError, match=message):
        check(ramp, "external")


def test_a_blend_that_is_nothing_at_its_time_is_refused():
    with pytest.raises(ConfigurationError, match=r"1e-05 s, which is lost in rounding at 1e\+12 s"):
        check(WrenchRamp(start=1e12, blend=1e-5), "external")
    check(WrenchRamp(start=1e12, blend=0.2), "external")
