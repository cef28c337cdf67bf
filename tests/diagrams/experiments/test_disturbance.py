"""Why the impedance has a stiff inner loop (section 3.3): what model error and friction do to E."""

from functools import cache

import numpy as np
import pytest
from runs import run

from geoimp_drake.diagrams.experiments.measures import quaternion_error
from geoimp_drake.laws.frame_motion import POSITION

MOTION = (
    "form=compiled",
    "sensor.inertial_load=plant",  # the direct scheme has no reference that is not accelerated
    "start.tilt_deg=0",
    "impedance.translation.damping=400",
    "impedance.rotation.damping=1.5",
    "segments=[{name: move, duration: 1.0, displacement: [0.05, 0.1, -0.08]},"
    "{name: rest, duration: 4.0}]",
)
HEAVY, FRICTION = "world.links.mass=1.1", "world.joints.coulomb=0.01"


@cache
def offset(scheme: str, *world: str) -> tuple[float, float]:
    """Returns how far E is from D at rest [m] and sin(ϑ/2), in the last half second."""
    log, _, failure = run("plexiglas", *MOTION, f"scheme={scheme}", *world)
    assert failure is None
    rest = log["t"] >= log["t"][-1] - 0.5
    dp = (log["six/motion_D"] - log["six/motion_E"])[rest][:, POSITION]
    epsilon = quaternion_error(dict(log), "six", "E")[rest]
    return float(np.linalg.norm(dp.mean(axis=0))), float(np.linalg.norm(epsilon.mean(axis=0)))


def ratios(*world: str) -> tuple[float, float]:
    direct, inner = offset("direct", *world), offset("inner-loop", *world)
    return direct[0] / inner[0], direct[1] / inner[1]


def test_without_a_disturbance_both_schemes_rest_on_d():
    for scheme in ("direct", "inner-loop"):
        assert max(offset(scheme)) < 1e-5


def test_heavier_links_move_a_direct_impedance_as_its_softness_says():
    position, rotation = ratios(HEAVY)
    assert position >= 20.0
    assert position == pytest.approx(2025.0 * 9.0 / 700.0, rel=0.1)  # K_Pp M_p / K_p
    assert rotation >= 100.0
    assert offset("inner-loop", HEAVY)[0] <= 0.6e-3


def test_friction_moves_it_too():
    position, rotation = ratios(FRICTION)
    assert position >= 5.0
    assert rotation >= 30.0
    assert offset("inner-loop", "world.joints.coulomb=0.02")[0] <= 4e-3


def test_in_contact_the_inner_loop_keeps_the_spring():
    log, _, failure = run("plexiglas", "form=compiled", HEAVY)
    assert failure is None
    rest = log["t"] >= log["t"][-1] - 1.0
    dp = (log["six/motion_D"] - log["six/motion_E"])[rest][:, POSITION].mean(axis=0)
    force = log["six/wrench_true"][rest, 3:].mean(axis=0)
    assert np.linalg.norm(force - 700.0 * dp) <= 0.01 * np.linalg.norm(force)
