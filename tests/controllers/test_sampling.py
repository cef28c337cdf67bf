"""How a whole controller reads joints: periods that fit, and readings that wrap."""

import re

import numpy as np
import pytest
from arms import make_arm_plant
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from two_arms import FORMS, add_arms

from geoimp_drake.controllers.config import ImpedanceControllerConfig, SamplingConfig
from geoimp_drake.controllers.cooperative_config import CooperativeControllerConfig
from geoimp_drake.controllers.impedance_config import ImpedanceConfig, TranslationGains
from geoimp_drake.controllers.impedance_controller import make_impedance_controller
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.prediction.sampled_loop import SampledLoop
from geoimp_drake.systems.frame_motion import frame_motion_at_rest
from geoimp_drake.validation import check


@pytest.mark.parametrize(("step", "period"), [(2e-3, 1e-3), (1e-3, 1.5e-3), (1e-3, 0.9e-3)])
def test_differences_of_another_number_of_steps_each_time_are_refused(step, period) -> None:
    rig = make_arm_plant(MultibodyPlant(step))
    config = ImpedanceControllerConfig(sampling=SamplingConfig(period, "differenced"))
    with pytest.raises(ConfigurationError, match=rf"period is {period:g} s and .* step {step:g} s"):
        make_impedance_controller(rig.plant, rig.arm, rig.E, config)
    config.sampling.velocity = "measured"
    assert make_impedance_controller(rig.plant, rig.arm, rig.E, config)


@pytest.mark.parametrize(("step", "period"), [(1e-3, 3e-3), (1e-4, 7e-4), (0.0, 1.3e-3)])
def test_differences_of_whole_steps_are_taken(step, period) -> None:
    rig = make_arm_plant(MultibodyPlant(step))
    config = ImpedanceControllerConfig(sampling=SamplingConfig(period, "differenced"))
    assert make_impedance_controller(rig.plant, rig.arm, rig.E, config)


def test_two_arms_are_asked_as_well() -> None:
    pair = add_arms(MultibodyPlant(2e-3))
    config = CooperativeControllerConfig(sampling=SamplingConfig(1e-3, "differenced"))
    with pytest.raises(ConfigurationError, match=r"period is 0\.001 s and .* step 0\.002 s"):
        pair.controller(config)


@pytest.mark.parametrize("kind", [ImpedanceControllerConfig, CooperativeControllerConfig])
def test_readings_rarer_than_the_inner_loop_needs_are_refused(kind) -> None:
    config = kind(sampling=SamplingConfig(0.02))
    if kind is CooperativeControllerConfig:  # whose watch is slower to refuse
        config.monitor.enabled = False
    with pytest.raises(ConfigurationError, match=r"period is 0\.02 s.*1/K_Dp = 0\.0154 s"):
        check(config)
    config.motion.K_Do = 200.0
    config.sampling.period = 0.006
    with pytest.raises(ConfigurationError, match=r"period is 0\.006 s.*1/K_Do = 0\.005 s"):
        check(config)


@pytest.mark.parametrize(
    ("period", "damping", "said"),
    [
        (0.005, 2000.0, "M/D of translation = 0.0045 s"),
        (0.02, 4000.0, "M/D of translation = 0.00225 s"),
        (0.085, 100.0, "M/D of rotation = 0.08 s"),
        (0.05, 20.0, "D/K of translation = 0.0286 s"),
    ],
)
def test_readings_rarer_than_a_direct_impedance_needs_are_refused(period, damping, said) -> None:
    config = ImpedanceControllerConfig(scheme="direct", sampling=SamplingConfig(period))
    config.impedance.translation.damping = np.array(damping)
    with pytest.raises(ConfigurationError, match=rf"period is {period:g} s; .*{re.escape(said)}"):
        check(config)
    config.sampling.period = 0.99 * float(said.split()[-2])
    check(config)


def test_an_impedance_that_is_not_the_hands_own_is_not_asked() -> None:
    config = ImpedanceControllerConfig(sampling=SamplingConfig(0.01))
    check(config)  # M/D is 4.5 ms
    config.scheme = "direct"
    config.impedance.axes = "rotation"
    check(config)
    config.impedance.axes, config.inertia = "both", "natural"
    check(config)


@pytest.mark.parametrize("zeta", [0.1, 0.5, 1.0, 3.0])
@pytest.mark.parametrize("steps", [1, 10])
def test_a_direct_impedance_swings_soon_after_the_period_that_is_asked_for(zeta, steps) -> None:
    """Its loop with differenced velocities, `steps` of the plant between two readings."""
    mass, stiffness, one = 9.0, 700.0, np.eye(6)
    damping = 2.0 * zeta * np.sqrt(mass * stiffness)

    def growth(period: float) -> float:
        gains = one / mass, damping * one, stiffness * one, one, one
        return SampledLoop(
            one / 20.0,
            0.0 * one,
            *gains,
            period / steps,
            is_direct=True,
            read_every=steps,
            sense_every=steps,
        ).growth()

    gains = TranslationGains(*map(np.array, (mass, damping, stiffness)))
    longest, _ = ImpedanceConfig(gains, axes="translation").shortest_time()
    assert growth(0.85 * longest) < 1.0
    assert growth(2.5 * longest if zeta > 0.1 else 10.0 * longest) > 1.0


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("joints", [6, 7])
def test_readings_that_jump_by_a_turn_change_no_torque(form: str, joints: int) -> None:
    rig = make_arm_plant(joints=joints)
    config = ImpedanceControllerConfig(sampling=SamplingConfig(velocity="differenced"), form=form)
    X_WE = rig.E.CalcPoseInWorld(rig.plant.CreateDefaultContext())

    def torques(turns: np.ndarray) -> np.ndarray:
        controller = make_impedance_controller(rig.plant, rig.arm, rig.E, config)
        simulator = Simulator(controller)
        context = simulator.get_mutable_context()
        controller.GetInputPort("desired_motion").FixValue(context, frame_motion_at_rest(X_WE))
        controller.GetInputPort("wrench").FixValue(context, np.zeros(6))
        asked = []
        for k in range(4):
            v = 0.3 * np.ones(joints)
            q = rig.posture + 1e-3 * k * v + (2 * np.pi * turns if k > 1 else 0.0)
            state = np.concatenate((q, v))
            controller.GetInputPort("estimated_state").FixValue(context, state)
            simulator.AdvanceTo(1e-3 * k + 0.5e-3)
            asked.append(controller.GetOutputPort("actuation").Eval(context).copy())
        return np.array(asked)

    plain = torques(np.zeros(joints))
    jumping = torques(np.resize([1.0, -1.0, 0.0, 2.0], joints))
    np.testing.assert_allclose(jumping, plain, rtol=0, atol=1e-6 * np.abs(plain).max())
