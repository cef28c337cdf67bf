"""How long a run may be: known from its settings, before anything is allocated."""

import pytest

from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS, OWN
from geoimp_drake.errors import ConfigurationError

ALL = {**EXPERIMENTS, **{own.name: own for own in OWN.values()}}


@pytest.mark.parametrize("name", ALL)
def test_a_run_with_too_many_steps_is_refused_for_every_set_up(name):
    with pytest.raises(ConfigurationError, match=r"1e\+07 s has 1e\+10 steps of 0.001 s"):
        ALL[name].scenario((), ("duration=1e7", "plant.time_step=0.001"))
    with pytest.raises(ConfigurationError, match=r"100 s has 1e\+11 steps of 1e-09 s"):
        ALL[name].scenario((), ("duration=100", "sensor.period=1e-9"))


@pytest.mark.parametrize("name", ["plexiglas", "bar"])
def test_the_length_of_a_motion_counts_where_no_duration_is_given(name):
    motion = ("segments=[{duration: 20000.0}, {duration: 1.0}]",)
    with pytest.raises(ConfigurationError, match=r"2e\+06 rows of log, about 4 GB"):
        EXPERIMENTS[name].scenario((), motion)
    assert EXPERIMENTS[name].scenario((), (*motion, "duration=5")).duration == 5.0
    long_but_sparse = EXPERIMENTS[name].scenario((), (*motion, "log_period=0.1"))
    assert long_but_sparse.duration is None


def test_the_length_of_a_motion_program_counts_as_soon_as_it_is_planned():
    experiment = EXPERIMENTS["peg_in_hole"]
    with pytest.raises(ConfigurationError, match=r"1e\+08 s has 1e\+11 steps"):
        experiment.build(experiment.scenario((), ("hold=1e8",)))
