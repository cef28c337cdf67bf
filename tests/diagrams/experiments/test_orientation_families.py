"""Case studies 2 to 4 on the real plant: geometric consistency, and no singularity."""

import numpy as np
import pytest
from runs import assert_all_hold, claims_of, family, run

from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS
from geoimp_drake.diagrams.experiments.comparisons import COMPARISONS
from geoimp_drake.diagrams.experiments.consistency import largest_misalignment
from geoimp_drake.errors import ConfigurationError, OutOfDomainError, SingularityError
from geoimp_drake.laws.impedance.coupled_stiffness import coupling_force
from geoimp_drake.laws.impedance.families import FAMILIES
from geoimp_drake.rotations import quaternion

CONSISTENT = (
    "quaternion",
    "alternative-euler",
    "angle-axis-sin-half",
    "angle-axis-tan-half",
    "angle-axis-simple",
)


@pytest.mark.parametrize("name", ["quaternion", "alternative-euler", "classical-euler"])
def test_contact_near_the_singularity(name):
    assert_all_hold(claims_of("singularity", family(name)))


def test_classical_euler_loads_the_contact_near_its_singularity_several_times_more():
    runs = {}
    for name in ("quaternion", "classical-euler", "alternative-euler"):
        log, scenario, _ = run("singularity", family(name))
        runs[name] = (log, scenario)
    claims = COMPARISONS["singularity"].claims(runs)
    assert len(claims) == 8
    assert_all_hold({claim.claim: claim for claim in claims})


@pytest.mark.parametrize("name", CONSISTENT)
def test_the_hand_turns_about_the_axis_of_the_torque(name):
    assert_all_hold(claims_of("consistency", family(name)))


def test_classical_euler_does_not():
    assert_all_hold(claims_of("consistency", family("classical-euler")))


def test_classical_euler_does_where_the_approach_axis_points_straight_down():
    down = ("start.attitude_deg=[180, 0, 0]", "start.position=[0.9, 0, 0.7]")
    guess = "start.guess=[0.1225, -0.3789, 1.0966, 0, -0.7177, -1.4483]"
    log, scenario, _ = run("consistency", family("classical-euler"), *down, guess, "duration=1.5")
    assert largest_misalignment(log, scenario, "E") < 2e-3


@pytest.mark.parametrize("name", ["quaternion", "angle-axis-tan-half", "alternative-euler"])
def test_nondiagonal_stiffness(name):
    assert_all_hold(claims_of("nondiagonal", family(name)))


@pytest.mark.parametrize("name", ["consistency", "nondiagonal"])
def test_an_angle_axis_family_without_equilibrium_ends_in_its_named_error(name):
    log, _, failure = run(name, family("angle-axis-sin"))
    assert isinstance(failure, OutOfDomainError)
    assert "90" in str(failure)
    assert 0.5 < log["t"][-1] < 6.0


def test_an_initial_attitude_at_a_singularity_is_refused():
    at_90 = ("start.attitude_deg=[0, 89.99, 0]", "duration=0.01")
    _, _, failure = run("singularity", family("classical-euler"), *at_90)
    assert isinstance(failure, SingularityError)
    _, _, failure = run("singularity", family("quaternion"), *at_90)
    assert failure is None


def test_bad_conditioning_is_reported_once_with_its_number(caplog):
    run("singularity", family("classical-euler"), "duration=0.05")
    warnings = [r.getMessage() for r in caplog.records if "cond(T)" in r.getMessage()]
    assert len(warnings) == 1
    assert "57.3" in warnings[0]


@pytest.mark.parametrize("law", ["classical-euler", "alternative-euler", "angle-axis-simple"])
def test_the_inner_loop_has_its_own_orientation_law(law):
    log, _, failure = run("nondiagonal", f"motion.orientation={law}", "duration=1.0")
    assert failure is None
    reference, _, _ = run("nondiagonal", "duration=1.0")
    difference = abs(log["six/motion_E"][:, :4] - reference["six/motion_E"][:, :4]).max()
    assert 0 < difference < 2e-3


COUPLING = "impedance.coupling=[[0, 8, 0], [-8, 0, 0], [0, 0, 8]]"


def test_a_moment_on_a_coupled_spring_displaces_it_until_its_force_vanishes():
    coupled = ("impedance.axes=both", "impedance.translation.damping=200")
    log, scenario, failure = run(
        "consistency", *coupled, "external.moment=[0, 0, 0.5]", COUPLING, "sensor.force_noise=0"
    )
    assert failure is None
    Q_WD, Q_WC = (log[f"six/motion_{frame}"][-1, :4] for frame in "DC")
    Q_CD = quaternion.relative(Q_WC, Q_WD)
    force = coupling_force(Q_CD, np.array(scenario.impedance.coupling))
    dp_W = (log["six/motion_D"] - log["six/motion_C"])[-1, 4:7]
    dp_D = quaternion.to_rotation(Q_WD).T @ dp_W
    assert np.linalg.norm(dp_D) > 1e-3
    np.testing.assert_allclose(700.0 * dp_D, -force, atol=0.1)


def test_a_coupling_that_makes_the_stiffness_indefinite_is_refused():
    strong = "impedance.coupling=[[0, 60, 0], [-60, 0, 0], [0, 0, 60]]"
    with pytest.raises(ConfigurationError, match="smallest eigenvalue is -"):
        run("consistency", "impedance.axes=both", strong)


def test_a_coupling_is_refused_where_the_family_cannot_carry_it():
    with pytest.raises(ConfigurationError, match="alternative-euler"):
        run("consistency", "impedance.axes=both", COUPLING, family("alternative-euler"))


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_every_experiment_can_be_run_with_every_family(experiment, name):
    # An approach axis that is level is where XYZ Euler angles are singular, by their definition.
    tilted = ("start.attitude_deg=[0, 80, 0]",) if experiment == "limits" else ()
    log, _, failure = run(experiment, family(name), "duration=0.02", *tilted)
    assert failure is None
    assert log["t"][-1] == pytest.approx(0.02)
