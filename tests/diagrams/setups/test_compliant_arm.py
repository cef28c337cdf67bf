"""An arm of the cell on its own joint servos, with the scheme admittance."""

import numpy as np
import pytest
from runs import assert_all_hold, claims_of, run

from geoimp_drake.controllers.config import FORMS
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.errors import ConfigurationError

PERIODS = ("sampling.period=0.004",)


def test_the_plexiglas_is_pressed_by_streamed_references_as_by_torques():
    assert_all_hold(claims_of("plexiglas", "scheme=admittance", *PERIODS))


def test_both_forms_with_their_sensor_leave_the_same_log():
    still = "scheme=admittance", "duration=0.3", *PERIODS
    blocks, compiled = (run("plexiglas", *still, f"form={form}")[0] for form in FORMS)
    assert set(blocks) == set(compiled)
    for name in blocks:
        np.testing.assert_allclose(compiled[name], blocks[name], atol=1e-9, err_msg=name)


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        (["servos.bandwidth=40"], "servos is given, but the scheme is 'inner-loop'"),
        (["reference.gain=10"], "reference is given, but the scheme is 'inner-loop'"),
        (["scheme=direct", "reference.gain=10"], "reference is given, but the scheme is 'direct'"),
        (
            ["scheme=admittance", "servos.period=0.002"],
            "servos.period is 0.002 s and sampling.period, with which references come, 0.001 s",
        ),
        (["scheme=admittance", *PERIODS, "servos.bandwidth=40"], "servos.period is 0.001 s and"),
        (["scheme=admittance", "redundancy.kappa=3"], "redundancy.kappa is given"),
        (["scheme=admittance", "redundancy.weight=identity"], "redundancy.weight is given"),
    ],
)
def test_what_a_scheme_does_not_use_is_refused(settings, says):
    with pytest.raises(ConfigurationError, match=says):
        get_experiment("plexiglas").scenario((), settings)


def test_servos_have_the_period_of_the_references():
    scenario = get_experiment("plexiglas").scenario((), ("scheme=admittance", *PERIODS))
    assert scenario.joint_servos().period == 4e-3
    given = *PERIODS, "servos.period=0.004", "servos.bandwidth=40"
    scenario = get_experiment("plexiglas").scenario((), ("scheme=admittance", *given))
    assert scenario.joint_servos().bandwidth == 40.0


SAFE = "safety={force: 150.0, source: a test, contact_stiffness: 75000.0}"
NATURAL = "scheme=direct", "inertia=natural"


@pytest.mark.parametrize(
    ("experiment", "settings", "says"),
    [
        ("bar", [SAFE], "Unknown key in the scenario 'safety'"),
        ("bar", ["passivity.gains.start=0.1"], "Unknown key in the scenario 'passivity'"),
        ("bar", ["passivity.damping.most=4"], "Unknown key in the scenario 'passivity'"),
        ("collision", ["impedance.axes=rotation"], "safety is given, but impedance.axes is 'rot"),
        ("collision", ["impedance.axes=none"], "safety is given, but impedance.axes is 'none'"),
        ("collision", ["impedance.translation.axes=desired"], "safety needs gains .* in W"),
        ("collision", NATURAL, "safety needs gains .* inertia: given"),
        ("custom", [*NATURAL, "passivity.gains.start=0.1"], "passivity.gains is given, but nat"),
        ("custom", [*NATURAL, "passivity.damping.most=4"], "passivity.damping is given, but nat"),
        ("custom", ["scheme=admittance", "limits=null"], "limits is null; with scheme: admittance"),
    ],
)
def test_what_a_setup_does_not_apply_is_refused(experiment, settings, says):
    experiment = get_experiment(experiment)
    with pytest.raises(ConfigurationError, match=says):
        experiment.build(experiment.scenario((), settings))
