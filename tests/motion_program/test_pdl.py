"""Reading PDL 2: what a program means, and errors with their line and column."""

import re

import numpy as np
import pytest
from program_rig import INSERTION, START, positions, track_arm, velocities
from pydrake.math import RigidTransform

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.motion_program.pdl import parse_program, read_program
from geoimp_drake.motion_program.plan import plan
from geoimp_drake.motion_program.program import (
    JointMove,
    LinearMove,
    MotionProgram,
    SpeedOverride,
    ToolMove,
)
from geoimp_drake.motion_program.taught import TaughtVariable, taught_values

POSE = RigidTransform([0.1, 0.2, 0.3])
TAUGHT = {"home": np.arange(7.0), "goal": POSE}
TEXT = """PROGRAM sample   -- a comment: MOVE TO nowhere
CONST slow = 3
      deep = 50
VAR home, spare : JOINTPOS
    goal : POSITION FOR ARM[1]
    count : INTEGER
    side : REAL
BEGIN
  MOVE TO home
  MOVE LINEAR TO goal
  $ARM_OVR := slow
  MOVE RELATIVE VEC(-1.5, 0, deep) IN TOOL
END sample
"""


def read(old: str = "", new: str = "", taught=TAUGHT, constants=None) -> MotionProgram:
    assert old in TEXT
    return parse_program(TEXT.replace(old, new, 1), taught, constants, "sample.pdl")


def same(program: MotionProgram, other: MotionProgram) -> bool:
    names = [[getattr(step, "name", "") for step in p.steps] for p in (program, other)]
    shown = [
        repr([re.sub(r"(name|place)='[^']*'", "", repr(step)) for step in p.steps])
        for p in (program, other)
    ]
    return shown[0] == shown[1] and [n.casefold() for n in names[0]] == [
        n.casefold() for n in names[1]
    ]


def test_program_becomes_its_steps_in_SI_units():
    program = read()
    to_home, to_goal, slow, into = program.steps
    assert program.name == "sample"
    assert isinstance(to_home, JointMove)
    np.testing.assert_array_equal(to_home.target, TAUGHT["home"])
    assert isinstance(to_goal, LinearMove)
    assert to_goal.X_WT.IsExactlyEqualTo(POSE)
    assert slow == SpeedOverride(3.0, "sample.pdl, line 11")
    assert isinstance(into, ToolMove)
    np.testing.assert_allclose(into.displacement, [-0.0015, 0.0, 0.05], rtol=1e-12)


def test_moves_carry_their_text_and_line():
    to_home, _, _, into = read("MOVE TO home", "move   To Home  -- first").steps
    assert (to_home.name, to_home.place) == ("move To Home", "sample.pdl, line 9")
    assert into.name == "MOVE RELATIVE VEC(-1.5, 0, deep) IN TOOL"


def test_case_layout_and_comments_do_not_matter():
    lower = parse_program(TEXT.lower(), {"HOME": TAUGHT["home"], "Goal": POSE})
    squeezed = re.sub(r"\s+", " ", re.sub(r"--.*", "", TEXT))
    assert same(lower, read())
    assert same(parse_program(squeezed, TAUGHT), read())
    assert not same(read("-1.5", "1.5"), read())


def test_constants_are_overridden_and_numeric_variables_taught():
    program = read(
        "VEC(-1.5, 0, deep)",
        "VEC(-side, +count, deep)",
        TAUGHT | {"side": 2.5, "count": 4},
        {"DEEP": 90},
    )
    np.testing.assert_allclose(program.steps[-1].displacement, [-0.0025, 0.004, 0.09])


@pytest.mark.parametrize(
    ("old", "new", "place", "message"),
    [
        ("PROGRAM", "PROGRM", (1, 1), "expected 'PROGRAM', found 'PROGRM'"),
        ("slow = 3", "slow 3", (2, 12), "expected '=', found '3'"),
        ("BEGIN", "BEGINN", (9, 3), "expected ',' or ':', found 'MOVE'"),
        ("MOVE TO home", "MOVE TO", (10, 3), "expected a name, found 'MOVE'"),
        ("MOVE TO home", "MOVE TO end", (9, 11), "expected a name, found 'end'"),
        ("MOVE TO home", "GO home", (9, 3), r"expected \$ARM_OVR or 'END' or 'MOVE', found 'GO'"),
        ("(-1.5, 0, deep)", "(-1.5, 0)", (12, 28), r"expected ',', found '\)'"),
        (" IN TOOL", " IN BASE", (12, 39), "expected 'TOOL', found 'BASE'"),
        (":= slow", ":= slow %", (11, 20), "expected .*'MOVE', found '%'"),
        ("POSITION", "XTNDPOS", (5, 12), r"expected a type \(JOINTPOS.*, found 'XTNDPOS'"),
        ("END sample", "", (12, 43), "found the end of the text"),
        ("END sample", "END other", (13, 5), "'sample' ends with 'END other'"),
        ("$ARM_OVR", "$LIN_SPD", (11, 3), r"unknown system variable '\$LIN_SPD'"),
        ("slow = 3", "slow = 101", (11, 15), "override is 101 %"),
        (":= slow", ":= 0", (11, 15), "override is 0 %"),
        (":= slow", ":= home", (11, 15), "'home' is a JOINTPOS; .*takes a constant"),
        ("MOVE TO home", "MOVE TO goal", (9, 11), "'goal' is a POSITION; MOVE TO takes"),
        ("TO goal", "TO home", (10, 18), "'home' is a JOINTPOS; MOVE LINEAR TO takes"),
        (
            "TO goal",
            "TO gaol",
            (10, 18),
            r"'gaol' is not declared; .* slow \(constant\), deep .*goal \(POSITION\), count",
        ),
        ("MOVE TO home", "MOVE TO spare", (9, 11), "'spare' is not taught"),
        (", deep)", ", count)", (12, 30), "'count' is not taught"),
        ("count", "Goal", (6, 5), "'Goal' is declared already, in line 5"),
        ("ARM[1]", "ARM[2]", (5, 29), r"ARM\[2\]: a program moves one arm"),
    ],
)
def test_errors_say_where_they_are_and_what_is_expected(old, new, place, message):
    line, column = place
    with pytest.raises(ConfigurationError, match=message) as error:
        read(old, new)
    assert str(error.value).startswith(f"sample.pdl, line {line}, column {column}: ")


@pytest.mark.parametrize(
    ("taught", "constants", "message"),
    [
        ({"home": TAUGHT["home"]}, {}, r"line 10, column 18: 'goal' is not taught"),
        (TAUGHT | {"spare": np.zeros(7)}, {}, "no statement uses spare"),
        (TAUGHT | {"gaol": POSE}, {}, "Unknown taught variable .* Did you mean 'goal'"),
        (TAUGHT | {"slow": 3}, {}, "Unknown taught variable"),
        (TAUGHT, {"speed": 3}, "Unknown constant .* Valid: deep, slow"),
        (TAUGHT, {"slow": "fast"}, "'slow' .*'fast'; give a finite number"),
        (TAUGHT, {"slow": 300}, "line 11, column 15: the speed override is 300 %"),
        (TAUGHT | {"goal": np.zeros(7)}, {}, "'goal' .* is a POSITION; give a pose"),
        (TAUGHT | {"home": POSE}, {}, "'home' .* is a JOINTPOS; give one number a joint"),
        (TAUGHT | {"home": [0, np.nan]}, {}, "'home'.*finite"),
        (TAUGHT | {"count": 1.5}, {}, "'count' .* is an INTEGER, not 1.5"),
    ],
)
def test_values_that_do_not_fit_the_program_are_refused(taught, constants, message):
    with pytest.raises(ConfigurationError, match=message):
        read(taught=taught, constants=constants)


def test_constant_given_but_used_nowhere_is_refused():
    with pytest.raises(ConfigurationError, match="no statement uses slow"):
        read(":= slow", ":= 5", constants={"slow": 3})


def test_file_that_cannot_be_read_is_named(tmp_path):
    with pytest.raises(ConfigurationError, match=r"nothing\.pdl cannot be read"):
        read_program(tmp_path / "nothing.pdl", {})


@pytest.mark.parametrize("word", ["x" * 101, "9" * 31, "1e1000", "²"])
def test_names_and_numbers_have_a_length(word):
    with pytest.raises(ConfigurationError, match=r"^sample\.pdl, line 10") as error:
        read("goal\n  $", f"{word}\n  $")
    assert len(str(error.value)) < 200


def test_a_byte_order_mark_does_not_matter(tmp_path):
    file = tmp_path / "marked.pdl"
    file.write_bytes(b"\xef\xbb\xbf" + TEXT.encode())
    assert same(read_program(file, TAUGHT), read())


def test_taught_variables_of_a_scenario_become_values():
    home = TaughtVariable("home", joints=[1, 2, 3])
    goal = TaughtVariable("goal", position=[0.1, 0.2, 0.3], attitude_deg=[0, 0, 90])
    values = taught_values([home, goal])
    np.testing.assert_array_equal(values["home"], [1.0, 2.0, 3.0])
    np.testing.assert_allclose(values["goal"] @ [1.0, 0, 0], [0.1, 1.2, 0.3])


@pytest.mark.parametrize(
    ("variables", "message"),
    [
        ([TaughtVariable("a")], "taught.0 'a' has none of joints"),
        ([TaughtVariable("a", np.zeros(7), np.zeros(3))], "taught.0 'a' has both of"),
        ([TaughtVariable("a", position=np.zeros(2))], "taught.0.position"),
        ([TaughtVariable("a", joints=np.zeros(6))] * 2, "'a' is taught twice"),
    ],
)
def test_taught_variables_that_cannot_be_used_are_named(variables, message):
    with pytest.raises(ConfigurationError, match=message):
        taught_values(variables)


@pytest.mark.parametrize(("constants", "depth"), [({}, 0.05), ({"dpt": 90}, 0.09)])
def test_insertion_program_runs_slowly_along_the_approach_axis_at_its_end(constants, depth):
    arm = track_arm()
    before_the_hole = arm.pose(START) @ RigidTransform([0.0, 0.0, 0.1])
    taught = {"int": START + 0.05, "pro": before_the_hole}
    program = read_program(INSERTION, taught, constants)
    motion = plan(arm.plant, arm.arm, arm.T, program, START)
    to_int, to_pro, into = motion.segments
    np.testing.assert_allclose(positions(motion, [to_int.end])[0], taught["int"], atol=1e-12)
    first, last = (arm.pose(q) for q in positions(motion, [to_pro.end, into.end]))
    assert first.IsNearlyEqualTo(before_the_hole, 1e-7)
    np.testing.assert_allclose((first.inverse() @ last).translation(), [0, 0, depth], atol=1e-7)
    middle = 0.5 * (into.begin + into.end)
    (q,), (v,) = positions(motion, [middle]), velocities(motion, [middle])
    assert np.linalg.norm((arm.jacobian(q) @ v)[3:]) == pytest.approx(0.009, rel=1e-3)
