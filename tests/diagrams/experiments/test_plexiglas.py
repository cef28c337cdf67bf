"""Case study 1 on the real plant: the claims, and what the claims' own arithmetic can tell."""

import numpy as np
import pytest
from runs import assert_all_hold, claims_of, family, norm, run

from geoimp_drake.diagrams.experiments import plexiglas
from geoimp_drake.diagrams.experiments.comparisons import COMPARISONS
from geoimp_drake.simulation.figures import contact_time


def test_every_claim_of_the_chapter_holds():
    assert_all_hold(claims_of("plexiglas"))


def test_the_normal_force_is_that_of_both_springs_in_series():
    stiffness = claims_of("plexiglas")["normal force over depth"].value
    assert stiffness == pytest.approx(plexiglas.NORMAL_STIFFNESS, rel=0.02)


@pytest.mark.parametrize(
    ("key", "column", "factor", "claim"),
    [
        ("six/wrench", slice(3, 6), 1.02, "at rest f = K_p Δp_dc, relative error"),
        ("six/wrench", slice(0, 3), 1.03, "at rest ᶜμ = K'_o ᶜε_dc, relative error"),
        ("six/wrench", slice(3, 6), 1.2, "normal force over depth"),
        ("six/wrench_true", slice(3, 6), 3.5, "largest force component"),
        ("six/wrench_true", slice(0, 3), 8.0, "largest moment component"),
        (
            "six/wrench_true",
            slice(3, 6),
            1.02,
            "at rest f = K_p Δp_de, true f and E, relative error",
        ),
        ("six/motion_E", 6, 1.01, "at rest f = K_p Δp_de, true f and E, relative error"),
        (
            "six/wrench_true",
            slice(0, 3),
            1.03,
            "at rest ᵉμ = K'_o ᵉε_de, true μ and E, relative error",
        ),
    ],
)
def test_a_claim_fails_on_a_log_that_is_wrong(key, column, factor, claim):
    log, scenario, _ = run("plexiglas")
    wrong = dict(log)
    wrong[key] = np.array(log[key])
    wrong[key][:, column] *= factor
    judged = {c.claim: c for c in plexiglas.claims(wrong, scenario)}
    assert judged[claim].holds is False


def test_a_plant_breaks_what_is_claimed_of_E_and_not_what_is_blind():
    claims = claims_of("plexiglas", "world.links.mass=1.5", "form=compiled")
    force = "at rest f = K_p Δp_dc, relative error"
    true_force = "at rest f = K_p Δp_de, true f and E, relative error"
    assert {name for name, claim in claims.items() if claim.blind} == {
        force,
        "at rest ᶜμ = K'_o ᶜε_dc, relative error",
    }
    assert claims[force].value < 1e-4
    # 0.6 % for each 10 %.
    assert claims[true_force].value == pytest.approx(0.03, rel=0.2)
    assert claims[true_force].holds is False


def test_no_claim_at_rest_rests_on_one_noisy_sample():
    noise = ("sensor.force_noise=0.3", "sensor.moment_noise=0.01", "form=compiled")
    assert_all_hold(claims_of("plexiglas", *noise))


def test_contact_is_where_the_tilted_rim_meets_the_surface():
    log, scenario, _ = run("plexiglas")
    touch = int(np.searchsorted(log["t"], contact_time(log, "six")))
    # The disk's mesh is a heptagon, and 1 N, which counts as contact, sinks its corner in a little.
    rim = 0.055 * np.cos(np.pi / 7) * np.sin(np.deg2rad(scenario.start.tilt_deg))
    height = log["six/motion_E"][touch, 6] - 0.52
    assert height == pytest.approx(rim, abs=1.5e-3)


def test_the_arm_follows_C():
    log, _, _ = run("plexiglas")
    error = log["six/motion_E"][:, 4:7] - log["six/motion_C"][:, 4:7]
    assert np.abs(error).max() < 1e-3


OTHERS = (
    "classical-euler",
    "alternative-euler",
    "angle-axis-sin",
    "angle-axis-tan-half",
    "angle-axis-simple",
)


@pytest.mark.parametrize("other", OTHERS)  # angle-axis-sin-half is the quaternion family itself
def test_families_agree_in_peak_and_steady_force(other):
    runs = {}
    for name in ("quaternion", other):
        log, scenario, failure = run("plexiglas", family(name), "segments.1.duration=3.0")
        assert failure is None
        runs[name] = (log, scenario)
    claims = COMPARISONS["plexiglas"].claims(runs)
    assert [claim.holds for claim in claims] == [True, True]


def test_the_same_seed_gives_the_same_noise_and_the_mean_is_that_without():
    noise = ("sensor.force_noise=0.05", "sensor.moment_noise=0.003", "duration=0.3")
    log, _, _ = run("plexiglas", *noise)
    quiet, _, _ = run("plexiglas", "duration=0.3")
    spread = (log["six/wrench"] - log["six/wrench_true"])[1:]
    assert spread[:, 3:].std() == pytest.approx(0.05, rel=0.3)
    assert np.abs(log["six/wrench_true"] - quiet["six/wrench_true"]).max() < 0.1
    assert norm(quiet, "six/wrench", slice(3, 6)).max() < 0.2
