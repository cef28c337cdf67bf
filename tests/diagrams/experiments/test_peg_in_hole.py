"""Loose cooperation on the real plant: the peg goes in although the plan is wrong."""

import numpy as np
import pytest
from runs import assert_all_hold, claims_of, run

from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.experiments.contrasts import CONTRASTS
from geoimp_drake.diagrams.experiments.peg_in_hole import depth, sweep_values
from geoimp_drake.diagrams.setups.loose import build_loose
from geoimp_drake.diagrams.setups.loose_scenario import LooseScenario
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.frame_motion import POSITION, QUATERNION, pose_of

# The peg's arm is far away during this [s].
EARLY = 1.5
RIGID = ("peg_in_hole", "impedance.axes=none")


def scenario(*overrides: str) -> LooseScenario:
    return get_experiment("peg_in_hole").scenario((), overrides)


def test_every_claim_of_the_misplanned_run_holds():
    claims = claims_of("peg_in_hole")
    assert_all_hold(claims)
    assert len(claims) == 6


def test_every_claim_of_the_nominal_run_holds():
    claims = claims_of("peg_in_hole", "plan=nominal")
    assert_all_hold(claims)
    assert claims["depth of the peg"].value > 45.0


def test_without_impedance_the_same_run_exceeds_the_sensors_range():
    claims = claims_of("peg_in_hole", "impedance.axes=none")
    assert_all_hold(claims)


def test_a_rigid_hand_is_loaded_several_times_as_much():
    runs = {"misplanned": run("peg_in_hole"), "position-controlled": run(*RIGID)}
    (claim,) = CONTRASTS["peg_in_hole"].claims({name: one[:2] for name, one in runs.items()})
    assert claim.holds


def test_the_peg_reaches_the_bottom_and_stays_there():
    log, run_scenario, _ = run("peg_in_hole")
    behind = depth(log, run_scenario)
    bottom = run_scenario.peg_hole.hole_depth
    assert behind[0] < -0.1
    assert behind.max() < bottom + 1e-4
    assert behind[-1] > bottom - 1e-4


def test_the_peg_is_turned_by_what_the_plan_is_wrong_until_it_is_in():
    """The taught pose is turned about W's axes, and the hole gives way to the peg."""
    log, run_scenario, _ = run("peg_in_hole")
    P, H = (pose_of(log[key][400]) for key in ("seven/motion_E", "hole/motion_H"))
    planned = np.deg2rad(np.hypot(*run_scenario.misplanned.rotation_deg[[0, 2]]))
    assert np.arccos(-P.rotation().col(2) @ H.rotation().col(2)) == pytest.approx(planned, rel=0.02)
    P, H = (pose_of(log[key][-1]) for key in ("seven/motion_E", "hole/motion_H"))
    assert np.arccos(-P.rotation().col(2) @ H.rotation().col(2)) < np.deg2rad(1.5)


def test_a_sweep_counts_the_run_as_a_success_and_the_rigid_one_not():
    log, run_scenario, _ = run("peg_in_hole")
    values = sweep_values(dict(log), run_scenario)
    assert values["success"]
    assert values["mating_force"] < 50.0
    rigid, rigid_scenario, _ = run("peg_in_hole", "impedance.axes=none")
    assert not sweep_values(dict(rigid), rigid_scenario)["success"]


def test_either_arm_may_carry_the_peg():
    log, swapped, failure = run("peg_in_hole", "peg_arm=six")
    assert failure is None
    assert swapped.compliant == "seven"
    assert depth(log, swapped)[-1] > swapped.peg_hole.hole_depth - 1e-4
    claims = claims_of("peg_in_hole", "peg_arm=six")
    assert_all_hold(claims)


def rotation_of_C(remote_centre: float, force: str) -> float:
    """Returns how far C turns under a force at the hole's mouth [rad]."""
    log, _, failure = run(
        "peg_in_hole",
        f"remote_centre=[0,0,{remote_centre}]",
        f"external={{force: {force}, axes: frame, duration: 0.3, blend: 0.1}}",
        f"duration={EARLY}",
    )
    assert failure is None
    C, D = (log[f"six/motion_{frame}"][-1] for frame in "CD")
    assert np.abs(C[POSITION] - D[POSITION]).max() > 5e-3  # the force is felt
    return float(2 * np.linalg.norm(quaternion.relative(C[QUATERNION], D[QUATERNION])[1:]))


def test_a_force_through_the_remote_centre_turns_nothing_and_one_beside_it_does():
    """M_o 9 and D_o 13.5 make 30 N at 50 mm turn C by about 0.05 rad in this time."""
    lateral, axial = "[30, 0, 0]", "[0, 0, -30]"
    through = rotation_of_C(0.165, lateral)
    beside = rotation_of_C(0.215, lateral)
    along = rotation_of_C(0.215, axial)
    assert through < 2e-3
    assert beside > 0.03
    assert along < 2e-3


def test_a_coupled_stiffness_shifts_the_centre_of_compliance():
    """K_c moves the point where a lateral force only translates: -K_c/K_p along the axis."""
    coupling = "impedance.coupling=[[0,10,0],[-10,0,0],[0,0,0]]"
    log, run_scenario, failure = run("peg_in_hole", coupling)
    assert failure is None
    claims = claims_of("peg_in_hole", coupling)
    assert claims["depth of the peg"].holds
    assert claims["largest mating force component"].holds
    assert sweep_values(dict(log), run_scenario)["seated"]


BAD = {
    "plan=wrong": "plan 'wrong'.*misplanned, nominal",
    "peg_arm=five": "peg_arm 'five'.*seven, six",
    "misplanned.path=-0.1": "misplanned.path is -0.1",
    "misplanned.rotation_deg=[1, 2]": "misplanned.rotation_deg",
    "tip=0.08": "tip less the peg",
    "mouth=.nan": "mouth",
    "program.file=nowhere.pdl": "nowhere.pdl",
    "program.constants.speed=3": "speed.*spd",
    "program.poses.beyond.offset=[0, 0, 0]": "beyond.*pro",
    "seven.start=[0.6, 0.25]": "start|seven|posture",
    "peg_hole.peg_diameter=0.02": "20 mm does not fit into .*18 mm",
    "seven.start=[1.15, 0.145, -0.4, 0.8, 0.16, 1.16, 4.65]": "behind the hole's mouth",
}


@pytest.mark.parametrize(("override", "message"), BAD.items())
def test_what_cannot_be_used_is_named(override, message):
    with pytest.raises(ConfigurationError, match=message):
        build_loose(scenario(override, "duration=0.01"))
