"""The internal impedance alone: what squeezes gives way, and it starts on the hands."""

import numpy as np
import pytest
from internal_gains import bar_internal
from pydrake.common import RandomDistribution
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import (
    Adder,
    Gain,
    LogVectorOutput,
    MatrixGain,
    RandomSource,
    ZeroOrderHold,
)
from signal_sources import Rig, Source, constant, fixed_step

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.internal_impedance import InternalGains, InternalImpedanceConfig
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.cooperation.internal_impedance import InternalImpedance
from geoimp_drake.systems.frame_motion import POSITION, QUATERNION
from geoimp_drake.typing import Array

HANDS = np.array([0.0, 1.0, 0.0])  # Δp_21 of the grasp


def at_rest(p=HANDS, rotvec=(0.0, 0.0, 0.0)) -> np.ndarray:
    motion = np.zeros(19)
    motion[QUATERNION], motion[POSITION] = quaternion.exp(np.array(rotvec)), p
    return motion


def rig_of(
    wrench: Array, measured: Array | None = None, config: InternalImpedanceConfig | None = None
) -> Rig:
    return Rig(
        InternalImpedance.of((config or bar_internal()).make()),
        {
            "desired_motion": at_rest(),
            "wrench": wrench,
            "measured_motion": at_rest() if measured is None else measured,
        },
    )


def test_squeezing_moves_the_hands_apart_and_pulling_together() -> None:
    """h_i = ½(h_2 − h_1) is against Δp_21 when the hands squeeze."""
    for force in (-30.0, 30.0):
        wrench = np.array([0.0, 0.0, 0.0, 0.0, force, 0.0])
        rig = rig_of(wrench).advance(1.5)
        expected = [0.0, 1.0 - force / 2000.0, 0.0]
        np.testing.assert_allclose(rig.read("compliant_motion")[POSITION], expected, atol=1e-5)


def test_moment_between_the_hands_turns_their_references_along_itself() -> None:
    """μ_i = ½(μ_2 − μ_1) on the object: the hands give way against it."""
    rig = rig_of(np.array([2.0, 0, 0, 0, 0, 0])).advance(1.0)
    turned = quaternion.log(rig.read("compliant_motion")[QUATERNION])
    np.testing.assert_allclose(turned, [-np.arcsin(0.02), 0.0, 0.0], atol=1e-6)


def test_it_starts_at_rest_on_the_measured_mutual_pose() -> None:
    measured = at_rest([0.001, 1.002, -0.003], (0.01, 0.0, -0.02))
    rig = rig_of(np.zeros(6), measured)
    np.testing.assert_allclose(rig.read("compliant_motion")[:13], measured[:13], atol=1e-15)
    rig.advance(1.5)
    np.testing.assert_allclose(rig.read("compliant_motion")[:7], at_rest()[:7], atol=1e-5)


@pytest.mark.parametrize(("axes", "part"), [("rotation", POSITION), ("translation", QUATERNION)])
def test_part_that_is_left_out_keeps_the_pose_of_the_grasp(axes: str, part: slice) -> None:
    wrench = np.array([1.0, 1.0, 1.0, 20.0, 20.0, 20.0])
    rig = rig_of(wrench, config=bar_internal(axes=axes)).advance(0.3)
    motion = rig.read("compliant_motion")
    np.testing.assert_array_equal(motion[part], at_rest()[part])
    other = QUATERNION if part == POSITION else POSITION
    assert np.abs(motion[other] - at_rest()[other]).max() > 1e-4


def squeeze(
    config: InternalImpedanceConfig,
    error: float,
    grasp: float,
    time: float,
    noise: float = 0.0,
) -> np.ndarray:
    """The force in a stiff grasp over time when the assumed mutual pose is wrong by `error` [m].

    The hands follow their references exactly and the wrench is one sample old, with `noise` as its
    standard deviation [N, Nm].
    """
    builder = DiagramBuilder()
    internal = builder.AddSystem(InternalImpedance.of(config.make()))
    # Hands further apart than the object is long pull it: f_i = k (Δp_21 − l), along y.
    pick = np.zeros((6, 19))
    pick[4, 5] = grasp
    spring = builder.AddSystem(MatrixGain(pick))
    random = builder.AddSystem(RandomSource(RandomDistribution.kGaussian, 6, 1e-3))
    weakened = builder.AddSystem(Gain(noise, 6))
    reading = builder.AddSystem(Adder(2, 6))
    age = builder.AddSystem(ZeroOrderHold(1e-3, 6))
    true_length = np.zeros(19)
    true_length[5] = 1.0 + error
    difference = builder.AddSystem(_Difference(true_length))
    start = at_rest([0.0, 1.0 + error, 0.0])
    for name, value in (("desired_motion", at_rest()), ("measured_motion", start)):
        source = builder.AddSystem(Source(constant(value)))
        builder.Connect(source.get_output_port(), internal.GetInputPort(name))
    builder.Connect(internal.GetOutputPort("compliant_motion"), difference.get_input_port())
    builder.Connect(difference.get_output_port(), spring.get_input_port())
    builder.Connect(random.get_output_port(), weakened.get_input_port())
    builder.Connect(spring.get_output_port(), reading.get_input_port(0))
    builder.Connect(weakened.get_output_port(), reading.get_input_port(1))
    builder.Connect(reading.get_output_port(), age.get_input_port())
    builder.Connect(age.get_output_port(), internal.GetInputPort("wrench"))
    log = LogVectorOutput(spring.get_output_port(), builder, 1e-2)
    simulator = fixed_step(builder.Build())
    simulator.AdvanceTo(time)
    return log.FindLog(simulator.get_context()).data()[4]


class _Difference(Source):
    """Subtracts a constant."""

    def __init__(self, offset: np.ndarray):
        super(Source, self).__init__()
        self.DeclareVectorInputPort("value", len(offset))
        self.DeclareVectorOutputPort(
            "difference",
            len(offset),
            lambda context, output: output.SetFromVector(
                self.get_input_port().Eval(context) - offset
            ),
        )


def test_error_of_the_grasp_leaves_the_series_of_both_stiffnesses() -> None:
    """Instead of 100 N at 50 000 N/m; what is left is nearly K times the error."""
    force = squeeze(bar_internal(), 0.002, 5e4, 2.0)
    np.testing.assert_allclose(force[-1], -0.002 * 2000.0 * 5e4 / 52000.0, rtol=1e-3)


def test_sixty_seconds_of_noise_and_of_an_old_wrench_leave_it_where_it_was() -> None:
    """The force neither drifts nor grows: the last ten seconds are like ten at the beginning."""
    force = squeeze(bar_internal(), 0.005, 5e4, 60.0, noise=0.3)
    early, late = force[200:1200], force[-1000:]
    np.testing.assert_allclose(late.mean(), -0.005 * 2000.0 * 5e4 / 52000.0, rtol=2e-3)
    assert 0.0 < late.std() < 1.2 * early.std() < 0.3


def test_damping_too_high_for_the_period_is_refused_with_the_number() -> None:
    gains = InternalGains(np.array(10.0), np.array(18000.0), np.array(2000.0))
    with pytest.raises(ConfigurationError, match=r"internal\.translation\.damping .* is 1\.8"):
        bar_internal(translation=gains).make()
    with pytest.raises(ConfigurationError, match="shorten the period"):
        bar_internal().make(period=0.05)
    gains.damping = np.array(12000.0)
    bar_internal(translation=gains).make()


def test_full_matrices_are_judged_by_their_fastest_direction() -> None:
    mass = np.array([[10.0, 9.9, 0.0], [9.9, 10.0, 0.0], [0.0, 0.0, 10.0]])
    gains = InternalGains(mass, np.array(400.0), np.array(2000.0))
    with pytest.raises(ConfigurationError, match="is 4"):
        bar_internal(translation=gains).make()


@pytest.mark.parametrize("key", ["mass", "damping", "stiffness"])
@pytest.mark.parametrize("part", ["translation", "rotation"])
def test_gain_that_is_not_positive_is_named(part: str, key: str) -> None:
    config = bar_internal()
    setattr(getattr(config, part), key, np.diag([1.0, -1.0, 1.0]))
    with pytest.raises(ConfigurationError, match=rf"internal\.{part}\.{key} is not positive"):
        config.make()
