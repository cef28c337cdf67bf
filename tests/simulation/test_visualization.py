"""What is drawn changes nothing in what is simulated."""

import numpy as np
import pytest

from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.simulation.experiment import run_experiment
from geoimp_drake.simulation.visualization import frame_period

# Where contact begins, the least difference in time shows in the torques.
CONTACT = ("start.position=[0.9, 0.0, 0.523]", "start.tilt_deg=2")
PUSHED = ("external.force=[5, 0, 0]", "external.moment=[1, 0, 0]", "external.blend=0.1")
CONTINUOUS = ("plant.time_step=0", "plant.contact_model=point", "surface=null", "log_period=0.009")


@pytest.mark.parametrize(
    "settings",
    [
        CONTACT,
        (*CONTACT, "form=compiled"),
        ("plant.time_step=7e-4", "log_period=0.011", "sampling.velocity=measured"),
        CONTINUOUS,
    ],
    ids=["blocks", "compiled", "steps that do not fit", "continuous plant"],
)
def test_a_run_that_is_recorded_or_watched_has_the_same_log_to_the_bit(settings, tmp_path):
    """Watched, and left alone: sliders and buttons are there and read."""
    experiment = get_experiment("plexiglas")
    logs = []
    for view in ({}, {"html": True}, {"live": True}):
        scenario = experiment.scenario((), ("duration=0.3", *PUSHED, *settings))
        result = run_experiment(experiment, scenario, tmp_path, figures=False, **view)
        assert result.failure is None
        logs.append(result.log)
    unseen, *seen = logs
    for log in seen:
        assert log.keys() == unseen.keys()
        assert [key for key in log if log[key].tobytes() != unseen[key].tobytes()] == []
    assert np.ptp(unseen["six/u"], axis=0).max() > 0.1


@pytest.mark.parametrize("step", [1e-3, 7e-4, 0.01, 1 / 32, 0.3])
def test_frames_fall_on_steps_to_the_bit(step):
    period = frame_period(step)
    assert period >= 1 / 32
    assert period < 2 / 32 or period == step
    steps = round(period / step)
    assert [k * period for k in range(1000)] == [k * steps * step for k in range(1000)]
