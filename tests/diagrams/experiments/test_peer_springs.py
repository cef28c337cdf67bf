"""The springs of other controllers: their laws, and the numbers that tell them from this library's.

What the springs do on a moving arm is in `test_orientation_loop`.
"""

import numpy as np
import pytest
from law_numerics import moments, random_rotvec, random_spd

from geoimp_drake.diagrams.experiments.peer_springs import (
    PEERS,
    SPRINGS,
    seo_moment,
    seo_stiffness,
)
from geoimp_drake.diagrams.experiments.spring_measures import (
    LOOP_STIFFNESS,
    moment_at,
    springs_figure,
    springs_table,
    work_round,
)
from geoimp_drake.diagrams.scene.turning_hand import orientation_loop
from geoimp_drake.laws.impedance import quaternion_impedance
from geoimp_drake.laws.impedance.trace_stiffness import stiffness_from_trace_form
from geoimp_drake.rotations import quaternion

every_spring = pytest.mark.parametrize("name", SPRINGS)
TABLE = dict(zip(SPRINGS, springs_table(), strict=True))
EULER = ("classical-euler", "alternative-euler")


def column(words: str) -> dict[str, float]:
    """Returns the values of the one column whose title begins so, by spring."""
    (title,) = (title for title in TABLE["seo"] if title.startswith(words))
    return {name: float(row[title]) for name, row in TABLE.items()}


@every_spring
def test_small_turns_meet_the_same_stiffness(name):
    rng = np.random.default_rng(1)
    for _ in range(20):
        K_o, turn = random_spd(rng, 1.0, 10.0), 1e-5 * random_rotvec(rng)
        moment = moment_at(SPRINGS[name], quaternion.exp(turn), K_o)
        np.testing.assert_allclose(moment, K_o @ turn, rtol=0, atol=1e-8)


def test_the_peers_laws_are_those_of_their_publications():
    rng = np.random.default_rng(2)
    for moment in moments(50):
        Q_CD, K_o = quaternion.relative(moment.Q_WC, moment.Q_WD), random_spd(rng, 1.0, 10.0)
        axes = quaternion.to_rotation(Q_CD).T
        half_sum = 0.5 * sum(np.cross(c, d) for c, d in zip(np.eye(3), axes, strict=True))
        angle = 2.0 * np.arccos(Q_CD[0])
        r = Q_CD[1:] / np.linalg.norm(Q_CD[1:])
        expected = {
            "axis-angle": K_o @ (angle * r),
            "quaternion-vector": K_o @ (2.0 * np.sin(0.5 * angle) * r),
            "cross-products": K_o @ half_sum,
        }
        for name, law in PEERS.items():
            np.testing.assert_allclose(law(Q_CD, K_o), expected[name], rtol=0, atol=1e-7)


def test_seos_spring_is_the_quaternions_but_not_for_every_stiffness():
    rng = np.random.default_rng(3)
    for moment in moments(50):
        Q_CD, K_o = quaternion.relative(moment.Q_WC, moment.Q_WD), random_spd(rng, 1.0, 10.0)
        K_R = seo_stiffness(K_o)
        np.testing.assert_allclose(stiffness_from_trace_form(K_R), K_o, atol=1e-12)
        ours = quaternion_impedance.elastic_moment(Q_CD, K_o)
        np.testing.assert_allclose(seo_moment(Q_CD, K_R), ours, rtol=0, atol=1e-12)
    assert np.linalg.eigvalsh(seo_stiffness(LOOP_STIFFNESS))[0] == pytest.approx(-1.75)
    assert TABLE["seo"]["note"] == "K_R has the eigenvalue -1.75"
    assert springs_table(np.diag([4.0, 5.0, 2.5]))[2]["note"] == ""


def test_work_round_a_closed_loop():
    """Peers' vectors times a stiffness give and take joules; Euler angles have a potential."""
    taken = column("taken out a lap")
    expected = {"axis-angle": -5.32, "quaternion-vector": -5.07, "cross-products": -4.36}
    assert {name: taken[name] for name in expected} == pytest.approx(expected, abs=0.01)
    assert max(abs(taken[name]) for name in SPRINGS if name not in expected) < 2e-4


def test_one_stiffness_for_all_axes_makes_no_joules():
    for spring in SPRINGS.values():
        assert abs(work_round(spring, 4.0 * np.eye(3))[-1]) < 2e-4


def test_the_loop_is_closed_and_stays_within_71_degrees():
    angles = [np.linalg.norm(quaternion.log(orientation_loop(s))) for s in np.linspace(0, 6.3, 500)]
    assert np.degrees(max(angles)) == pytest.approx(71.0, abs=0.1)
    np.testing.assert_allclose(orientation_loop(2.0 * np.pi), orientation_loop(0.0), atol=1e-12)


def test_only_euler_angles_answer_beside_the_axis():
    sines = column("largest misalignment")
    assert sines["classical-euler"] == pytest.approx(0.607, abs=1e-3)
    assert sines["alternative-euler"] == pytest.approx(0.344, abs=1e-3)
    assert max(sine for name, sine in sines.items() if name not in EULER) < 1e-12


def test_moments_near_a_half_turn():
    held, jump = column("moment at 179°"), column("jump at 180°")
    for name in ("quaternion", "seo", "cross-products"):
        assert held[name] == pytest.approx(np.sin(np.radians(179.0)))
        assert jump[name] < 1e-4
    assert held["axis-angle"] == pytest.approx(np.radians(179.0))
    assert jump["axis-angle"] == pytest.approx(2.0 * np.pi, abs=1e-3)
    assert jump["quaternion-vector"] == pytest.approx(4.0, abs=1e-3)


def test_euler_angles_multiply_a_moment_near_their_singularity():
    hand, turned = column("gain, hand"), column("gain, turned")
    assert hand["classical-euler"] > 200.0
    assert turned["alternative-euler"] > 15.0
    assert max(gain for name, gain in hand.items() if name != "classical-euler") < 1.001
    assert max(gain for name, gain in turned.items() if name not in EULER) < 1.001


def test_a_targets_sign_changes_the_quaternions_vector_alone():
    change = column("change as the target")
    assert change.pop("quaternion-vector") == pytest.approx(2.0)
    assert max(change.values()) < 1e-9


def test_the_figure_has_every_spring_in_every_panel():
    figure = springs_figure()
    assert [len(axes.lines) for axes in figure.axes] == [len(SPRINGS)] * 4
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "Seo, SE(3); K_R has the eigenvalue -1.75" in labels
    assert len(labels) == len(SPRINGS)
