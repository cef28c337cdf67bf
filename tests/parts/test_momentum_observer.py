"""The observer sees what acts on an arm from outside: exactly, in time, and nothing else."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from driven_arm import DrivenArm

from geoimp_drake.compilation.compiled import SWITCH
from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.parts.momentum_observer import MomentumObserver, MomentumObserverConfig
from geoimp_drake.parts.part_loop import PartLoop
from geoimp_drake.robots.drive import DriveConfig
from geoimp_drake.robots.drive_log import DriveLog
from geoimp_drake.systems.sources.desired_motion import MotionSegment
from geoimp_drake.systems.sources.external_wrench import WrenchRamp

PERIOD, PUSHED = 1e-3, 0.9
FORCE = np.array([9.0, 0.0, -12.0])  # 15 N


@cache
def recorded(push: bool) -> tuple[DrivenArm, DriveLog]:
    """Returns an arm that is moved, and pushed by 15 N from one sample to the next."""
    ramp = WrenchRamp(force=FORCE, start=PUSHED, duration=1e-3, blend=5e-4) if push else None
    arm = DrivenArm(push=ramp)
    move = MotionSegment(1.5, [0.05, 0.0, -0.05], [0.0, 0.0, 0.2])
    return arm, arm.drive(1.5, move, config=DriveConfig(wrench="none", keep=3.0))


def observed(
    arm: DrivenArm,
    log: DriveLog,
    config: MomentumObserverConfig,
    begun: float = 0.0,
    **noise: float,
) -> dict[str, np.ndarray]:
    """Returns an observer's outputs at each tick of a drive."""
    model, joints, values = arm.loop.model, arm.loop.joints, log.values
    loop = PartLoop(MomentumObserver(model, config, PERIOD), "observer")
    random = np.random.default_rng(noise.get("seed", 0))
    v = values["v"] + noise.get("v", 0.0) * random.standard_normal(values["v"].shape)
    torque = values["torque"] + noise.get("torque", 0.0) * random.standard_normal(v.shape)
    outputs = {name: [] for name in ("external_torque", "wrench", "collision")}
    before = np.vstack((torque[:1], torque[:-1]))  # over the step that led to a reading
    for k in range(len(v)):
        signals = {
            "estimated_state": joints.reading(values["q"][k], v[k]),
            "torque": joints.actuation(before[k]),
        }
        loop.reset(signals, begun) if k == 0 else loop.step(signals, {}, PERIOD)
        for name, rows in outputs.items():
            rows.append(loop.output(name).copy())
    return {name: np.array(rows) for name, rows in outputs.items()}


@pytest.mark.parametrize("gain", [50.0, 100.0, 200.0])
def test_a_push_is_seen_exactly_and_behind_a_low_pass(gain):
    arm, log = recorded(True)
    h = observed(arm, log, MomentumObserverConfig(gain=gain))["wrench"]
    # The wrench is that of the end effector on whoever pushes.
    np.testing.assert_allclose(h[-1, 3:], -FORCE, rtol=0, atol=5e-3 * 15.0)
    np.testing.assert_allclose(h[-1, :3], 0.0, rtol=0, atol=5e-3 * 15.0)
    t = log.values["t"][:, 0]
    share = -h[:, 3:] @ FORCE / 15.0**2
    risen = t[np.argmax(share > 1.0 - np.exp(-1.0))] - PUSHED
    assert risen == pytest.approx(1.0 / gain, abs=2.1e-3)


def test_a_collision_is_found_at_once_and_only_then():
    arm, log = recorded(True)
    collision = observed(arm, log, MomentumObserverConfig(gain=200.0))["collision"][:, 0]
    t = log.values["t"][:, 0]
    assert not collision[t < PUSHED].any()
    assert t[np.argmax(collision)] - PUSHED <= 0.010


def test_noise_gives_no_alarm_in_a_hundred_thousand_samples():
    arm, log = recorded(False)
    config = MomentumObserverConfig(gain=100.0)
    samples = 0
    for seed in range(1, 1 + 100_000 // len(log.values["t"]) + 1):
        seen = observed(arm, log, config, v=1e-4, torque=0.1, seed=seed)
        samples += len(seen["collision"])
        assert not seen["collision"].any()
    assert samples >= 100_000


@pytest.mark.parametrize("begun", [0.0, 5.0])
def test_what_is_felt_at_rest_is_tared_whenever_that_is(begun):
    """Torques that are 5 % of the weight off, as with links that are heavier than the model's."""
    arm, log = recorded(True)
    model = arm.loop.model
    plant, context = arm.plant, arm.plant.CreateDefaultContext()
    weight = -0.05 * plant.CalcGravityGeneralizedForces(context)
    assert abs(weight).max() > 5.0
    values = {**log.values, "torque": log.values["torque"] + weight}
    heavy = DriveLog(values, {}, log.ticks, log.computing)
    plain, tared = (
        observed(arm, heavy, MomentumObserverConfig(gain=100.0, tare=tare), begun)["wrench"][-1]
        for tare in (0.0, 0.4)
    )
    assert abs(plain[3:] + FORCE).max() > 3.0
    assert abs(tared[3:] + FORCE).max() < 0.5
    assert model.num_joints == 6


def test_what_it_cannot_use_is_named():
    arm, log = recorded(False)
    with pytest.raises(ConfigurationError, match=r"observer\.gain is -1"):
        MomentumObserver(arm.loop.model, MomentumObserverConfig(gain=-1.0))
    with pytest.raises(ConfigurationError, match=r"observer\.threshold"):
        MomentumObserver(arm.loop.model, MomentumObserverConfig(threshold=np.zeros(6)))
    with pytest.raises(ConfigurationError, match=r"observer\.threshold.*6"):
        MomentumObserver(arm.loop.model, MomentumObserverConfig(threshold=np.ones(5)))
    loop = PartLoop(MomentumObserver(arm.loop.model, MomentumObserverConfig(), PERIOD), "observer")
    with pytest.raises(ConfigurationError, match=r"'torques'.*estimated_state, torque"):
        loop.reset({"torques": np.zeros(6)})
    values = {**log.values, "torque": log.values["torque"] * np.nan}
    with pytest.raises(SignalError, match="observer:torque"):
        observed(arm, DriveLog(values, {}, log.ticks, log.computing), MomentumObserverConfig())


def test_as_written_the_laws_give_the_same(monkeypatch):
    arm, log = recorded(True)
    around = slice(int(PUSHED / PERIOD) - 5, int(PUSHED / PERIOD) + 15)
    short = replace(log, values={name: rows[around] for name, rows in log.values.items()})
    compiled = observed(arm, short, MomentumObserverConfig())
    monkeypatch.setenv(SWITCH, "0")
    written = observed(arm, short, MomentumObserverConfig())
    assert np.abs(compiled["wrench"]).max() > 1.0
    for name, values in compiled.items():
        np.testing.assert_allclose(written[name], values, rtol=1e-9, atol=1e-9)
