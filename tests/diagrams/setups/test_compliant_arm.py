"""An arm of the cell on its own joint servos, with the scheme admittance."""

import pytest
from runs import assert_all_hold, claims_of

from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.errors import ConfigurationError

PERIODS = ("servos.period=0.004", "sampling.period=0.004")


def test_the_plexiglas_is_pressed_by_streamed_references_as_by_torques():
    assert_all_hold(claims_of("plexiglas", "scheme=admittance", *PERIODS))


def test_the_compiled_form_of_the_scheme_has_no_sensor():
    experiment = get_experiment("plexiglas")
    scenario = experiment.scenario((), ("scheme=admittance", "form=compiled"))
    with pytest.raises(ConfigurationError, match="give form 'blocks'"):
        experiment.build(scenario)
