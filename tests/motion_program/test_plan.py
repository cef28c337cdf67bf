"""Planning of motion programs: straight lines, speeds, nearest postures, errors."""

import numpy as np
import pytest
from program_rig import START, positions, track_arm, velocities
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame

from geoimp_drake.diagrams.scene.cell import END_EFFECTOR, SEVEN, add_cell
from geoimp_drake.errors import ConfigurationError, SingularityError
from geoimp_drake.motion_program import straight_line
from geoimp_drake.motion_program.plan import PlanConfig, ProgramSegment, plan
from geoimp_drake.motion_program.program import (
    JointMove,
    LinearMove,
    MotionProgram,
    SpeedOverride,
    ToolMove,
)

NEAR = START + np.array([0.1, 0.1, -0.1, 0.1, 0.2, 0.1, -0.2])
SPEED_LIMITS = np.append(1.5, np.radians([160, 115, 200, 430, 360, 500]))


def turned(X_WT: RigidTransform, axis: list, angle: float, step: list) -> RigidTransform:
    """Returns a pose that is turned about an axis of T and moved in T."""
    unit = np.array(axis) / np.linalg.norm(axis)
    return X_WT @ RigidTransform(RotationMatrix(AngleAxis(angle, unit)), step)


@pytest.fixture(scope="module")
def arm():
    return track_arm()


@pytest.fixture(scope="module")
def line(arm):
    """A straight move with a turn, from the start posture, and where it goes."""
    goal = turned(arm.pose(START), [1, 2, -1], 0.7, [0.15, -0.1, 0.2])
    return arm.plan(LinearMove(goal, "to the goal")), goal


def deviations(arm, motion, goal) -> np.ndarray:
    """Distance from the line [m] and from the attitude that belongs to the place on it [rad]."""
    start = arm.pose(START)
    whole = goal.translation() - start.translation()
    turn = (start.rotation().inverse() @ goal.rotation()).ToAngleAxis()
    found = []
    for q in positions(motion, np.linspace(0.0, motion.trajectory.end_time(), 1000)):
        X = arm.pose(q)
        s = (X.translation() - start.translation()) @ whole / (whole @ whole)
        expected = start.rotation() @ RotationMatrix(type(turn)(s * turn.angle(), turn.axis()))
        beside = X.translation() - start.translation() - s * whole
        found.append(
            (np.linalg.norm(beside), (expected.inverse() @ X.rotation()).ToAngleAxis().angle())
        )
    return np.abs(found)


def test_tool_stays_on_the_line_with_the_attitude_that_belongs_there(arm, line):
    off_line, off_attitude = deviations(arm, *line).max(axis=0)
    assert off_line < 5e-5
    assert off_attitude < 1e-4


def test_line_ends_on_its_target(arm, line):
    motion, goal = line
    reached = arm.pose(motion.trajectory.value(motion.trajectory.end_time())[:, 0])
    assert reached.IsNearlyEqualTo(goal, 1e-7)


def test_deviation_from_the_line_would_be_seen(arm, line):
    _, goal = line
    straight_in_the_joints = arm.plan(JointMove(line[0].trajectory.value(10.0)[:, 0]))
    assert (deviations(arm, straight_in_the_joints, goal).max(axis=0) > [1e-3, 1e-2]).all()


def test_velocity_is_continuous_over_moves_of_all_kinds(arm):
    motion = arm.plan(JointMove(NEAR), ToolMove([0.02, 0, 0.1]), LinearMove(arm.pose(START)))
    end = motion.trajectory.end_time()

    def largest_change(count: int) -> float:
        rates = velocities(motion, np.linspace(0.0, end, count))
        return float(np.abs(np.diff(rates, axis=0)).max())

    # A jump would not shrink with the step.
    assert largest_change(2001) == pytest.approx(4 * largest_change(8001), rel=0.05)
    for segment in motion.segments:
        np.testing.assert_allclose(velocities(motion, [segment.begin, segment.end]), 0, atol=1e-9)


def tool_speed(arm, motion, time: float) -> np.ndarray:
    (q,), (v,) = positions(motion, [time]), velocities(motion, [time])
    return arm.jacobian(q) @ v


@pytest.mark.parametrize(("percent", "speed"), [(3, 0.009), (50, 0.15), (100, 0.3)])
def test_speed_reached_is_the_nominal_one_times_the_override(arm, percent, speed):
    motion = arm.plan(SpeedOverride(percent), ToolMove([0, 0, 0.3]))
    V = tool_speed(arm, motion, 0.5 * motion.trajectory.end_time())
    expected = speed * arm.pose(START).rotation().matrix()[:, 2]
    np.testing.assert_allclose(V[3:], expected, rtol=0, atol=1e-3 * speed)
    np.testing.assert_allclose(V[:3], 0.0, atol=1e-3 * speed)
    # The time to full speed is the nominal one at any override.
    assert motion.trajectory.end_time() == pytest.approx(0.3 / speed + 0.3 / 0.6)


def test_turn_on_the_spot_runs_at_the_nominal_rotational_speed(arm):
    goal = turned(arm.pose(START), [0, 1, 1], 0.9, [0, 0, 0])
    config = PlanConfig(rotational_speed=0.4, rotational_acceleration=1.5)
    motion = arm.plan(SpeedOverride(50), LinearMove(goal), config=config)
    V = tool_speed(arm, motion, 0.5 * motion.trajectory.end_time())
    np.testing.assert_allclose(np.linalg.norm(V[:3]), 0.2, rtol=1e-3)
    np.testing.assert_allclose(V[3:], 0.0, atol=1e-4)


def test_joints_of_a_joint_move_go_straight_together_and_one_at_its_speed(arm):
    target = START + np.array([0.5, 0.2, -0.3, 0.4, 0.2, 0.1, -0.2])
    motion = arm.plan(JointMove(target), config=PlanConfig(joint_move_speed=0.2))
    times = np.linspace(0.0, motion.trajectory.end_time(), 400)
    part = (positions(motion, times) - START) / (target - START)
    np.testing.assert_allclose(part, part[:, :1] * np.ones(7), atol=1e-12)
    fastest = np.abs(velocities(motion, times)).max(axis=0) / (0.2 * SPEED_LIMITS)
    assert fastest.max() == pytest.approx(1.0, rel=1e-6)


def test_posture_along_a_line_changes_as_little_as_it_can(arm):
    """Without a part in the null space of the weighted pseudo-inverse, but for the knots' size."""
    weights = np.array([5.0, 1, 1, 2, 1, 1, 1])
    motion = arm.plan(ToolMove([0.05, 0, 0.2]), config=PlanConfig(joint_weights=weights))
    for t in np.linspace(0.1, 0.9, 5) * motion.trajectory.end_time():
        (q,), (v,) = positions(motion, [t]), velocities(motion, [t])
        J, W_inv = arm.jacobian(q), np.diag(1 / weights)
        least = W_inv @ J.T @ np.linalg.solve(J @ W_inv @ J.T, J @ v)
        assert np.linalg.norm(v - least) < 0.02 * np.linalg.norm(v)


@pytest.mark.parametrize(("weight", "share"), [(1e4, 0.0), (1e-3, 1.0)])
def test_weight_of_the_track_decides_who_moves(arm, weight, share):
    config = PlanConfig(joint_weights=np.array([weight, 1, 1, 1, 1, 1, 1]))
    motion = arm.plan(ToolMove([0, 0, 0.1]), config=config)
    travel = motion.trajectory.value(motion.trajectory.end_time())[0, 0] - START[0]
    assert travel == pytest.approx(0.1 * share, abs=2e-3)


def test_segments_follow_each_other_with_their_names(arm):
    steps = ToolMove([0, 0, 0.02], "in"), ToolMove([0, 0, 0], "stay"), JointMove(NEAR, "away")
    motion = arm.plan(*steps, start_time=1.5)
    first, stay, away = motion.segments
    assert [segment.name for segment in motion.segments] == ["in", "stay", "away"]
    assert first.begin == motion.trajectory.start_time() == 1.5
    assert stay == ProgramSegment("stay", first.end, first.end)
    assert (away.begin, away.end) == (first.end, motion.trajectory.end_time())
    assert motion.joint_names[0] == "track"


def test_tool_frame_turned_about_its_tip_moves_along_its_own_axis():
    plant = MultibodyPlant(1e-3)
    add_cell(plant, "track_arm")
    tip = plant.GetFrameByName(END_EFFECTOR, plant.GetModelInstanceByName(f"{SEVEN}_tool"))
    X_TP = RigidTransform(RotationMatrix.MakeXRotation(np.radians(2.0)))
    P = plant.AddFrame(FixedOffsetFrame("turned", tip, X_TP))
    plant.Finalize()
    instance = plant.GetModelInstanceByName(SEVEN)
    motion = plan(plant, instance, P, MotionProgram([ToolMove([0, 0, 0.09])]), START)
    rig = track_arm()
    first, last = (rig.pose(q) for q in positions(motion, [0.0, motion.trajectory.end_time()]))
    moved = first.inverse() @ last
    expected = 0.09 * np.array([0.0, -np.sin(np.radians(2)), np.cos(np.radians(2))])
    np.testing.assert_allclose(moved.translation(), expected, atol=1e-6)


@pytest.mark.parametrize(
    ("move", "message"),
    [
        (ToolMove([0, 0, 2.5], "too far"), r"too far .*\d+% of the way: beyond .*track at 1\.2"),
        (ToolMove([-1.5, 0, 0], "up"), r"up .*\d+% of the way: beyond .*elbow at 2\."),
        (JointMove(START + 3.0, "wild"), r"wild: beyond the joint limits: track at 2\.8000"),
        (JointMove(START[:6], "six"), "six: joint positions"),
        (JointMove(np.full(7, np.nan), "none"), "none"),
        (ToolMove([0, np.nan, 0], "nan"), "nan"),
        (ToolMove([0, 0, 1e9], "off"), r"off: the line is 1e\+09 m long, 1e\+11 times 0.01 m; at"),
        (SpeedOverride(0.5), r"0\.5 %"),
        (SpeedOverride(101), "101 %"),
        (ToolMove([0, 0, 0]), "Nothing moves"),
        (ToolMove([0, 0, 2.5], "in", place="a.pdl, line 3"), r"a\.pdl, line 3: in .*% of the way"),
    ],
    ids=str,
)
def test_moves_that_cannot_be_made_are_named_with_the_place(arm, move, message):
    with pytest.raises(ConfigurationError, match=message):
        arm.plan(move)


def test_pose_out_of_reach_is_refused_with_its_place(arm, monkeypatch):
    """By the first knot already, or a joint's limit would come first."""
    monkeypatch.setattr(straight_line, "_KNOT_DISTANCE", 3.0)
    with pytest.raises(ConfigurationError, match=r"up .* 25% of the way: no posture .*3\.5"):
        arm.plan(ToolMove([-10, 0, 0], "up"))


def test_wrist_that_turns_over_on_the_line_is_refused_at_full_speed(arm):
    """Past the straight wrist the forearm turns half round; the track is told to stay."""
    first, last = START.copy(), START.copy()
    first[[4, 5]], last[[4, 5]] = (0.0, 0.25), (0.0, -0.25)
    beside = arm.pose(last) @ RigidTransform([0.0, 0.003, 0.0])
    config = PlanConfig(joint_weights=np.array([1e5, 1, 1, 1, 1, 1, 1]))
    with pytest.raises(ConfigurationError, match=r"through: forearm_roll would move at [23]\d"):
        arm.plan(LinearMove(beside, "through"), start=first, config=config)
    slow = arm.plan(SpeedOverride(15), LinearMove(beside), start=first, config=config)
    turn = slow.trajectory.value(slow.trajectory.end_time())[:, 0] - first
    assert abs(turn[4]) > 2.5
    assert abs(turn[0]) < 1e-3


def test_joint_too_fast_is_named_with_the_override_that_it_could_follow(arm):
    config = PlanConfig(joint_speeds=np.full(7, 0.05))
    with pytest.raises(ConfigurationError, match=r"in: track would move at .* override") as error:
        arm.plan(ToolMove([0, 0, 0.3], "in"), config=config)
    percent = float(str(error.value).split(" % or less")[0].split()[-1])
    arm.plan(SpeedOverride(0.99 * percent), ToolMove([0, 0, 0.3], "in"), config=config)


def test_line_that_the_arm_cannot_keep_to_is_refused(arm, monkeypatch):
    """Between its knots a cubic strays a little everywhere; nothing is exact to 1e-16."""
    monkeypatch.setattr(straight_line, "_POSITION_TOLERANCE", 1e-16)
    with pytest.raises(SingularityError, match=r"in \(|in: .*% of the way"):
        arm.plan(ToolMove([0, 0, 0.05], "in"))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("linear_speed", 0.0),
        ("rotational_acceleration", np.inf),
        ("joint_move_speed", 1.5),
        ("joint_speeds", np.zeros(7)),
        ("joint_weights", np.ones(6)),
        ("joint_accelerations", np.full(7, np.nan)),
    ],
)
def test_configuration_that_cannot_be_used_is_named(arm, field, value):
    with pytest.raises(ConfigurationError, match=field):
        arm.plan(ToolMove([0, 0, 0.1]), config=PlanConfig(**{field: value}))


def test_a_move_that_takes_no_time_in_floating_point_is_named(arm):
    wild = PlanConfig(joint_speeds=np.full(7, 1e9), joint_accelerations=np.full(7, 1e12))
    with pytest.raises(ConfigurationError, match=r"turn: a move from 1e\+10 s on would take"):
        arm.plan(JointMove(START + 0.1, "turn"), config=wild, start_time=1e10)


def test_a_start_time_that_is_none_is_refused(arm):
    with pytest.raises(ConfigurationError, match=r"start_time is inf s; it must be finite"):
        arm.plan(JointMove(START + 0.1, "turn"), start_time=np.inf)


def test_start_beyond_its_limits_is_refused(arm):
    with pytest.raises(ConfigurationError, match=r"start posture: .*track at 1\.3"):
        arm.plan(ToolMove([0, 0, 0.1]), start=START + 1.5 * np.eye(7)[0])
