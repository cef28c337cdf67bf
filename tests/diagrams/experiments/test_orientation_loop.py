"""A hand turns the end effector round a closed loop: springs keep what they get, vectors do not."""

import numpy as np
import pytest
from runs import assert_all_hold, claims_of, run

from geoimp_drake.diagrams.experiments import orientation_loop, reproduction
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.experiments.comparisons import COMPARISONS
from geoimp_drake.diagrams.experiments.peer_springs import PEERS, SPRINGS
from geoimp_drake.diagrams.scene.turning_hand import HandConfig
from geoimp_drake.diagrams.setups.peer_impedance import PeerImpedance
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.rotations import quaternion
from geoimp_drake.simulation.energy_audit import audit_of

# One lap each way, and faster: what is claimed of two holds for it.
SHORT = ("hand.laps=1", "hand.lap=5.0", "hand.rest=0.2", "hand.lead=1.2")
# Of the other springs the one with the fewest joules, in blocks: its law is compiled for it alone.
PEER = ("impedance.spring=cross-products", "form=blocks", *SHORT)


def laps(*settings: str) -> list[float]:
    """Returns the energy out of the spring in the lap forward, and in the one back [J]."""
    log, scenario, failure = run("orientation_loop", *settings)
    assert failure is None
    spring = orientation_loop.energies(dict(log), scenario)[1]
    return [float(lap) for (lap,) in orientation_loop.laps(dict(log), scenario, spring).values()]


def test_a_spring_with_a_potential_has_given_nothing_after_a_lap():
    assert_all_hold(claims_of("orientation_loop", *SHORT))
    assert max(map(abs, laps(*SHORT))) < 0.02


def test_another_controllers_spring_gives_joules_one_way_and_takes_them_the_other():
    assert_all_hold(claims_of("orientation_loop", *PEER))
    assert laps(*PEER) == pytest.approx([-3.8, 3.8], abs=0.15)


def test_the_audit_has_what_no_potential_accounts_for_as_its_error():
    log, _, _ = run("orientation_loop", *PEER)
    loop, _, _ = run("orientation_loop", *SHORT)
    # The wrench is a sample old: 1 ms times its rate along the way is work, too.
    assert audit_of(dict(loop), "six").relative_error < 0.03
    assert np.ptp(audit_of(dict(log), "six").error) > 3.0


def test_the_hand_bears_what_the_sensor_reads():
    log, _, _ = run("orientation_loop", *SHORT)
    wrench = log["six/wrench_true"]
    np.testing.assert_allclose(wrench[:, :3], -log["hand/moment"], rtol=0, atol=0.05)
    assert np.abs(wrench[:, 3:]).max() < 0.05


def test_across_springs_the_worst_with_a_potential_and_the_best_without_are_told():
    runs = {}
    for name, settings in (("quaternion", SHORT), ("cross-products", PEER)):
        log, scenario, _ = run("orientation_loop", *settings)
        runs[name] = dict(log), scenario
    comparison = COMPARISONS["orientation_loop"]
    claims = comparison.claims(runs)
    assert len(claims) == 2
    assert_all_hold({claim.claim: claim for claim in claims})
    assert len(comparison.claims({"quaternion": runs["quaternion"]})) == 1
    over_time, by_lap = comparison.figure(runs).axes
    assert [len(axes.get_lines()) for axes in (over_time, by_lap)] == [2, 2]
    drawn = {line.get_label(): line.get_ydata() for line in by_lap.get_lines()}
    assert list(drawn[SPRINGS["cross-products"].title]) == pytest.approx(laps(*PEER))


def test_every_peer_is_reproduced():
    (study,) = (one for one in reproduction.studies() if one.name == "orientation_loop")
    assert PEERS.keys() <= {variant.name for variant in study.variants}


@pytest.mark.parametrize("name", PEERS)
def test_a_peers_law_is_the_quaternions_but_for_the_moment(name):
    rng = np.random.default_rng(4)
    M_o, D_o, K_o = np.diag([0.2, 0.3, 0.4]), np.diag([1.0, 2.0, 3.0]), np.diag([4.0, 10.0, 2.5])
    family = PeerImpedance(name, M_o, D_o, K_o)
    for _ in range(20):
        Q_WD, Q_WC = (quaternion.exp(rng.normal(size=3)) for _ in range(2))
        w_WD, dw_WD, w_WC, mu = rng.normal(size=(4, 3))
        spring = PEERS[name](quaternion.relative(Q_WC, Q_WD), K_o)
        np.testing.assert_allclose(family.elastic_moment(Q_WD, Q_WC), spring, atol=1e-12)
        R_WC = quaternion.to_rotation(Q_WC)
        np.testing.assert_allclose(family.elastic_moment_W(Q_WD, Q_WC), R_WC @ spring, atol=1e-12)
        # (3.22): the relative acceleration, from that of C.
        dw_WC = family.angular_acceleration(Q_WD, w_WD, dw_WD, Q_WC, w_WC, mu)
        relative = R_WC.T @ (dw_WD - dw_WC - np.cross(w_WC, w_WD - w_WC))
        w_CD_C = R_WC.T @ (w_WD - w_WC)
        left = M_o @ relative + D_o @ w_CD_C + spring
        np.testing.assert_allclose(left, R_WC.T @ mu, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (("impedance.spring=cross",), r"Unknown impedance.spring 'cross'.*cross-products"),
        (
            ("impedance.spring=axis-angle", "impedance.orientation=classical-euler"),
            r"impedance.spring is 'axis-angle', and impedance.orientation is 'classical-euler'",
        ),
        (("segments=[{name: rest, duration: 1.0}]",), r"1 segments; D rests"),
        (("external={force: [1, 0, 0]}",), r"external is given"),
        (("engine=mujoco",), r"engine is 'mujoco'"),
        (("hand.laps=0",), r"hand.laps"),
        (("hand.lap=-1.0",), r"hand.lap is -1"),
        (("hand.stiffness=0.0",), r"hand.stiffness is 0"),
        (("hand.lap=1.0e9",), r"steps of 0.001 s"),
    ],
)
def test_what_no_hand_does_is_refused(settings, words):
    with pytest.raises(ConfigurationError, match=words):
        get_experiment("orientation_loop").scenario((), settings)


def test_laps_follow_each_other_forward_and_back_with_rests_between():
    hand = HandConfig(laps=2, lap=6.0, rest=0.3, lead=1.5)
    names, begins, ends = zip(*hand.phases(), strict=True)
    assert names == ("lead", "forward", "forward", "back", "back")
    np.testing.assert_allclose(np.subtract(ends, begins), [1.5, 6.0, 6.0, 6.0, 6.0])
    np.testing.assert_allclose(np.subtract(begins[1:], ends[:-1]), 0.3)
    assert hand.duration == pytest.approx(ends[-1] + 0.3)
