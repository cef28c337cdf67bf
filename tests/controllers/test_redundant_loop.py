"""The arm on the track in closed loop: idle, pushed, reconfigured (case 5) and at a joint limit.

Steps are coarser than the 1 ms of the experiments. Sampling errors grow with the step, so what
holds here holds there. The damping D_p is lower where a coarse step asks for it.
"""

import numpy as np
import pytest
from redundant_arms import FACING, Resolver, arm_at, simulate, track_arm
from redundant_loop import Loop, closed_loop

from geoimp_drake.controllers.config import (
    ImpedanceControllerConfig,
    MotionConfig,
    RedundancyConfig,
)
from geoimp_drake.controllers.impedance_config import RotationGains, TranslationGains
from geoimp_drake.laws.redundancy.pseudo_inverse import (
    null_space_projector,
    weighted_pseudo_inverse,
)
from geoimp_drake.parts.null_space_gain import DEFAULT_KAPPA
from geoimp_drake.parts.wrist_sensor_config import WristSensorConfig
from geoimp_drake.systems.sources.desired_motion import MotionSegment
from geoimp_drake.task_functions.config import TaskConfig
from geoimp_drake.task_functions.joint_limits import JointLimitDistance

TRACK = track_arm()
ELBOW = TRACK.joint_names.index("elbow")
# A sensor that lies: 2 N, and noise and steps as a 12-bit one has.
LYING = WristSensorConfig(
    bias=np.array([0.0, 0.0, 0.0, 1.0, -1.0, 1.5]),
    force_noise=0.1,
    moment_noise=0.01,
    force_resolution=0.063,
    moment_resolution=0.0049,
)


def null_space_velocity(elbow_speed: float) -> np.ndarray:
    """Returns joint velocities that leave the end effector at rest."""
    arm = arm_at(TRACK, np.concatenate((FACING, np.zeros(7))))
    J_pinv = weighted_pseudo_inverse(arm.Jv_V_WE, np.linalg.inv(arm.B))
    direction = null_space_projector(arm.Jv_V_WE, J_pinv)[:, ELBOW]
    return elbow_speed * direction / direction[ELBOW]


def idle(weight: str = "inertia") -> ImpedanceControllerConfig:
    """Returns a controller that damps the null-space motion and holds no posture."""
    config = ImpedanceControllerConfig(
        redundancy=RedundancyConfig(weight=weight, task=TaskConfig(kind="none"))
    )
    config.impedance.translation.damping = np.array(400.0)
    return config


def case_5(k_beta: float, K_n: float = 20.0) -> ImpedanceControllerConfig:
    """Returns the chapter's gains; the elbow's target is 1.1 rad.

    The elbow trails its trajectory by 1/2.5 s (k_β times an entry of B⁻¹): 13 mrad at the end of
    one of 4 s. One of 3.5 s leaves half a second of the four to close that.
    """
    config = ImpedanceControllerConfig(
        motion=MotionConfig(K_Pp=2250.0, K_Dp=70.0, K_Po=4000.0, K_Do=75.0),
        redundancy=RedundancyConfig(
            K_n=np.array(K_n),
            k_beta=k_beta,
            task=TaskConfig("joint-target", joints=["elbow"], target=np.array([1.1]), duration=3.5),
        ),
    )
    config.impedance.translation = TranslationGains(
        np.array(16.0), np.array([800.0, 250.0, 800.0]), np.array([1300.0, 800.0, 1300.0])
    )
    config.impedance.rotation = RotationGains(np.array(0.7), np.array(4.0), np.array(2.5))
    return config


def elbow_and_hand(loop: Loop) -> np.ndarray:
    return np.append(loop.joint("elbow"), loop.end_effector().translation())


def test_elbow_of_an_idle_arm_does_not_sag_in_a_minute() -> None:
    loop = closed_loop(FACING, idle(), step=1e-2, sensor=LYING)
    # The lie moves the end effector by f/K_p in the first seconds, and the elbow with it.
    loop.simulator.AdvanceTo(10.0)
    elbow = loop.sample(50.0, 2.0, lambda: loop.joint("elbow"))
    drift = np.abs(elbow - elbow[0]).max()
    print(f"idle arm, 10 to 60 s: the elbow moves by {drift:.1e} rad")
    assert drift < 2e-3


def test_it_would_sag_if_wrenches_reached_the_null_space() -> None:
    loop = closed_loop(FACING, idle("identity"), step=1e-2, sensor=LYING)
    loop.simulator.AdvanceTo(5.0)
    elbow = loop.sample(5.0, 1.0, lambda: loop.joint("elbow"))
    print(f"the same with W = I, 5 to 10 s: {elbow[-1] - elbow[0]:.1e} rad")
    assert abs(elbow[-1] - elbow[0]) > 2e-2


def test_null_space_motion_comes_to_rest_and_does_not_move_the_hand() -> None:
    config = idle()
    config.redundancy.K_n = np.array(60.0)
    loop = closed_loop(FACING, config, step=1e-2, velocity=null_space_velocity(0.2))
    rows = loop.sample(10.0, 0.5, lambda: elbow_and_hand(loop))
    moved = np.abs(rows - rows[0]).max(axis=0)
    print(f"pushed elbow: {moved[0]:.3f} rad, then rest; hand {moved[1:].max():.1e} m")
    assert moved[0] > 0.1
    assert abs(rows[-1, 0] - rows[-2, 0]) < 1e-4
    assert moved[1:].max() < 1e-4


def test_elbow_reaches_its_target_in_time_and_the_hand_stays() -> None:
    loop = closed_loop(FACING, case_5(-250.0), step=4e-3)
    rows = loop.sample(4.0, 0.25, lambda: elbow_and_hand(loop))
    hand = np.abs(rows - rows[0])[:, 1:].max()
    print(f"case 5: elbow at {rows[-1, 0]:.4f} rad after 4 s; hand moved by {hand:.1e} m")
    assert rows[0, 0] == pytest.approx(0.702)
    assert abs(rows[-1, 0] - 1.1) < 0.01
    assert hand < 1e-4
    assert loop.null_space_output("task_value")[0] < 1e-4


def test_elbow_stays_without_the_gain() -> None:
    loop = closed_loop(FACING, case_5(0.0), step=4e-3)
    loop.simulator.AdvanceTo(1.0)
    assert loop.joint("elbow") == pytest.approx(0.702, abs=1e-6)


@pytest.mark.parametrize("K_n", [200.0, 0.0])
def test_error_energy_decays_at_its_rate_in_closed_loop(K_n: float) -> None:
    # The hand moves and turns, the elbow follows its target and starts with a push.
    segment = MotionSegment(3.0, np.array([0.02, -0.05, 0.04]), np.array([0.0, 0.1, 0.1]))
    loop = closed_loop(
        FACING, case_5(-250.0, K_n), segments=(segment,), velocity=null_space_velocity(0.3)
    )

    def energy_and_power() -> tuple[float, float]:
        e_n = loop.null_space_output("null_space_error")
        energy = 0.5 * e_n @ arm_at(TRACK, loop.state()).B @ e_n
        return energy, -K_n * e_n @ e_n if K_n else -2.0 * DEFAULT_KAPPA * energy

    V, power = loop.sample(0.4, 0.004, energy_and_power).T
    rate = (V[2:] - V[:-2]) / 0.008
    error = np.abs(rate - power[1:-1]).max() / np.abs(power).max()
    print(f"closed loop at 1 ms: V̇ + eᵀKe relative to its largest value {error:.1e}")
    assert V[-1] < 0.5 * V[0]
    assert error < 1e-2


@pytest.mark.parametrize(("k_beta", "within"), [(0.0, False), (200.0, True)])
def test_joint_limit_task_keeps_the_elbow_within_its_range(k_beta: float, within: bool) -> None:
    # The elbow coasts towards 2.59 rad; its limit is 2.18. No stops here: the law alone.
    resolver = Resolver.of(TRACK, 20.0, k_beta=k_beta, task=JointLimitDistance(TRACK))
    state = np.concatenate((FACING, null_space_velocity(0.8)))
    elbow = simulate(resolver, state, lambda t: np.zeros(6), 5.0, 0.05)[:, 1 + ELBOW]
    limit = TRACK.plant.GetPositionUpperLimits()[ELBOW]
    print(f"k_beta {k_beta:g}: elbow up to {elbow.max():.2f} rad, limit {limit:.2f}")
    assert (elbow.max() < limit) == within
    assert elbow.max() > 1.3
