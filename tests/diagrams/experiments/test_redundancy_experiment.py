"""Case study 5 on the real plant: null-space motion and contact leave each other alone."""

import numpy as np
import pytest
from runs import assert_all_hold, claims_of, run

from geoimp_drake.diagrams.experiments.contrasts import CONTRASTS
from geoimp_drake.diagrams.experiments.redundancy import task_value

WITHOUT = "redundancy.k_beta=0"
CONTACT = (8.0, 23.0)  # approach and contact [s]


def during(log, begin, end):
    return (log["t"] >= begin) & (log["t"] <= end)


def test_every_claim_holds_with_null_space_motion():
    claims = claims_of("redundancy")
    assert_all_hold(claims)
    assert len(claims) == 12


def test_every_claim_holds_without_it():
    claims = claims_of("redundancy", WITHOUT)
    assert_all_hold(claims)
    assert len(claims) == 10


def test_the_contact_does_not_feel_the_null_space_motion():
    (log, _, _), (other, _, _) = run("redundancy"), run("redundancy", WITHOUT)
    contact = during(log, *CONTACT)
    difference = np.abs(log["seven/wrench_true"] - other["seven/wrench_true"])[contact]
    peak = np.abs(log["seven/wrench_true"][contact])
    assert difference[:, 3:].max() < 0.03 * peak[:, 3:].max()
    assert difference[:, :3].max() < 0.03 * peak[:, :3].max()


def test_the_task_function_is_driven_down_with_k_beta_and_not_without():
    (log, scenario, _), (other, unaware, _) = run("redundancy"), run("redundancy", WITHOUT)
    end = during(log, *CONTACT).nonzero()[0][-1]
    assert task_value(log, scenario)[end] * 50 < task_value(other, unaware)[end]


def test_every_claim_across_both_runs_holds():
    runs = {"with-k-beta": run("redundancy"), "without-k-beta": run("redundancy", WITHOUT)}
    claims = CONTRASTS["redundancy"].claims({name: one[:2] for name, one in runs.items()})
    assert [claim.holds for claim in claims] == [True] * 3


def test_the_elbow_goes_its_way_while_the_hand_rests():
    log, _, _ = run("redundancy")
    elbow = log["seven/q"][during(log, 0.0, 4.0), 3]
    assert 0.3 < abs(elbow[0] - 1.1) < 0.5
    assert abs(elbow[-1] - 1.1) < 0.01


def test_joints_are_addressed_by_name():
    with pytest.raises(ValueError, match=r"elbo.*Valid: .*elbow"):
        run("redundancy", "redundancy.task.joints=[elbo]", "duration=0.01")
