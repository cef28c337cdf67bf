"""An insertion ends when the peg is in or the cell stops, and a grasp error is the plan's alone."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.experiments.peg_in_hole import sweep_values
from geoimp_drake.diagrams.setups.insertion_end import InsertionEnd, InsertionWatch
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.simulation.run import simulate
from geoimp_drake.systems.frame_motion import frame_motion_at_rest

FACING = RotationMatrix.MakeXRotation(np.pi)  # the peg looks into the hole


def tip(depth: float) -> np.ndarray:
    return frame_motion_at_rest(RigidTransform(FACING, [0.0, 0.0, -depth]))


def ends_at(depth: float, force: float) -> float:
    """The time at which a run of 1 s ends whose depth and force grow to these."""
    mouth, wrench = frame_motion_at_rest(RigidTransform()), np.zeros(6)
    grown = np.array([0.0, 0.0, 0.0, 0.6 * force, 0.0, 0.8 * force])
    builder = DiagramBuilder()
    watch = builder.AddSystem(InsertionWatch(InsertionEnd(depth=0.045, force=130.0), 0.01))
    for k, ends in enumerate(((tip(0.0), tip(depth)), (mouth, mouth), (wrench, grown))):
        path = PiecewisePolynomial.FirstOrderHold([0.0, 1.0], np.array(ends).T)
        source = builder.AddSystem(TrajectorySource(path))
        builder.Connect(source.get_output_port(), watch.get_input_port(k))
    outcome = simulate(builder.Build(), SimulatorConfig(max_step_size=0.005), 1.0)
    assert outcome.failure is None
    return outcome.time


@pytest.mark.parametrize(
    ("depth", "force", "end"),
    [
        (0.0894, 0.0, 0.51),  # 45 mm deep at 0.5034 s; it looks every 10 ms
        (0.044, 129.0, 1.0),
        (0.0, 259.0, 0.51),
        (-0.09, -259.0, 0.51),
    ],
)
def test_a_run_ends_when_the_peg_is_in_or_the_cell_stops(depth, force, end):
    assert ends_at(depth, force) == pytest.approx(end, abs=1e-9)


def built(*overrides: str):
    experiment = get_experiment("peg_in_hole")
    scenario = experiment.scenario((), ("duration=0.01", *overrides))
    return experiment.build(scenario)


def test_a_grasp_error_moves_the_peg_and_not_its_plan():
    wrong = built("grasp.offset=[3.0e-4, 0, 0]", "grasp.rotation_deg=[0, 1, 0]")
    plants = [built().plant, wrong.plant]
    pegs, contexts = [], [plant.CreateDefaultContext() for plant in plants]
    for plant, context in zip(plants, contexts, strict=True):
        pegs.append(plant.GetFrameByName("peg").CalcPoseInWorld(context))
    X_TP = pegs[0].inverse() @ pegs[1]
    assert X_TP.translation() == pytest.approx([3e-4, 0.0, 0.0], abs=1e-12)
    assert X_TP.rotation().ToAngleAxis().angle() == pytest.approx(np.deg2rad(1.0))
    taught = plants[1].GetFrameByName("taught_tip").CalcPoseInWorld(contexts[1])
    assert taught.IsNearlyEqualTo(pegs[0], 1e-12)
    assert np.array_equal(*(times_of_moves(setup) for setup in (built(), wrong)))


def times_of_moves(setup) -> np.ndarray:
    outcome = simulate(setup.diagram, setup.scenario.simulator, 0.01, events=setup.events)
    return setup.recorder.collect(outcome.context)["program/times"]


def values(depth: float, force: float) -> dict[str, float | bool]:
    scenario = get_experiment("peg_in_hole").scenario((), ("until={depth: 0.045}",))
    log = {
        "t": np.array([0.0, 0.8]),
        "seven/motion_E": np.array([tip(0.0), tip(depth)]),
        "hole/motion_H": np.array(2 * [frame_motion_at_rest(RigidTransform())]),
        "six/wrench_true": np.array([[0, 0, 0, force, 0, 0], [0, 0, 0, 0, 0, 1.0]]),
    }
    return sweep_values(log, scenario)


@pytest.mark.parametrize(
    ("depth", "force", "ended"),
    [
        (0.0451, 10.0, ("success", "seated")),
        (0.0451, 60.0, ("seated",)),
        (0.0300, 10.0, ("jammed",)),
        (0.0009, 10.0, ()),
    ],
)
def test_how_a_sample_ended(depth, force, ended):
    found = values(depth, force)
    assert tuple(name for name in ("success", "seated", "jammed") if found[name]) == ended
    assert found["time"] == 0.8
    assert found["mating_force"] == force


@pytest.mark.parametrize(
    ("override", "message"),
    {
        "until.depth=-1": "until.depth is -1",
        "until={force: 0}": "until.force is 0",
        "grasp.offset=[1, 2]": "grasp.offset",
        "grasp.rotation_deg=[.nan, 0, 0]": "grasp.rotation_deg",
    }.items(),
)
def test_what_cannot_be_used_is_named(override, message):
    with pytest.raises(ConfigurationError, match=message):
        get_experiment("peg_in_hole").scenario((), (override,))
