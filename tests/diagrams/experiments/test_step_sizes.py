"""The set-ups at other step sizes, and with a continuous plant under error control."""

import numpy as np
import pytest
from runs import run

from geoimp_drake.systems.frame_motion import POSITION, QUATERNION

DURATION = "duration=0.4"
CONTINUOUS = (
    "plant.time_step=0",
    "plant.contact_model=point",
    "simulator.integration_scheme=runge_kutta3",
    "simulator.use_error_control=true",
)


def step_of(seconds: float) -> tuple[str, ...]:
    """Returns the settings for one step size of plant, sampling, sensor and integrator."""
    keys = ("plant.time_step", "sampling.period", "sensor.period", "simulator.max_step_size")
    return tuple(f"{key}={seconds}" for key in keys)


@pytest.mark.parametrize("settings", [step_of(5e-4), step_of(4e-3), CONTINUOUS])
def test_the_hand_turns_alike_under_a_torque(settings):
    reference, _, _ = run("consistency", DURATION)
    log, _, failure = run("consistency", DURATION, *settings)
    assert failure is None
    turned = np.abs(reference["six/motion_E"][-1, QUATERNION] - log["six/motion_E"][0, QUATERNION])
    assert turned.max() > 1e-2
    for part, bound in ((QUATERNION, 2e-3), (POSITION, 2e-4)):
        difference = (log["six/motion_E"] - reference["six/motion_E"])[-1, part]
        assert np.abs(difference).max() < bound


def test_a_wrist_sensor_feels_nothing_on_a_continuous_plant_without_contact():
    """Drake leaves gravity out of these forces if the contact model is hydroelastic."""
    log, _, _ = run("plexiglas", "surface=null", "duration=0.2", *CONTINUOUS)
    assert np.abs(log["six/wrench_true"][:, 3:]).max() < 0.05
