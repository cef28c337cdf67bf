"""Joint readings: sampled and held, measured or differenced, without a jump at the start."""

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RevoluteJoint, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import Multiplexer, Sine

from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.systems.arm.joint_readings import JointReadings

UP = np.array([0.0, 0.0, 0.5])
AMPLITUDE, RATE, PHASE = np.array([0.7, -0.4]), np.array([2.0, 5.0]), np.array([0.3, 1.1])


def position(t: float) -> np.ndarray:
    return AMPLITUDE * np.sin(RATE * t + PHASE)


def velocity(t: float) -> np.ndarray:
    return AMPLITUDE * RATE * np.cos(RATE * t + PHASE)


def swinging_source(kind: str, period: float = 1e-3) -> tuple[Diagram, JointReadings]:
    """Returns a diagram in which two joints swing as `position` says, in continuous time."""
    builder = DiagramBuilder()
    q = builder.AddSystem(Sine(AMPLITUDE, RATE, PHASE))
    v = builder.AddSystem(Sine(AMPLITUDE * RATE, RATE, PHASE + np.pi / 2))
    both = builder.AddSystem(Multiplexer([2, 2]))
    builder.Connect(q.get_output_port(0), both.get_input_port(0))
    builder.Connect(v.get_output_port(0), both.get_input_port(1))
    block = builder.AddNamedSystem("readings", JointReadings(2, period, kind))
    builder.Connect(both.get_output_port(), block.get_input_port())
    return builder.Build(), block


def swinging_plant(kind: str, period: float = 1e-3) -> tuple[Diagram, JointReadings]:
    """Returns a diagram with a discrete plant of one pendulum that starts at 1 rad."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(1e-3))
    bob = plant.AddRigidBody("bob", SpatialInertia.SolidSphereWithMass(1.0, 0.05).Shift(UP))
    plant.AddJoint(RevoluteJoint("hinge", plant.world_frame(), bob.body_frame(), [0, 1, 0]))
    plant.Finalize()
    plant.SetDefaultPositions([1.0])
    block = builder.AddNamedSystem("readings", JointReadings(1, period, kind))
    builder.Connect(plant.get_state_output_port(), block.get_input_port())
    return builder.Build(), block


def readings(diagram: Diagram, block: JointReadings, times, v0=None) -> np.ndarray:
    """Returns the reading at each of the times, one a row; at zero, that of initialization."""
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    if v0 is not None:
        plant = next(s for s in diagram.GetSystems() if isinstance(s, MultibodyPlant))
        plant.SetVelocities(plant.GetMyMutableContextFromRoot(context), v0)
    rows = []
    for time in times:
        simulator.AdvanceTo(time) if time else simulator.Initialize()
        rows.append(block.get_output_port().Eval(block.GetMyContextFromRoot(context)))
    return np.array(rows)


@pytest.mark.parametrize("kind", ["measured", "differenced"])
def test_positions_are_sampled_and_held(kind: str) -> None:
    rows = readings(*swinging_source(kind, 0.01), [0.1001, 0.105, 0.1099])
    for row in rows:
        np.testing.assert_allclose(row[:2], position(0.1), atol=1e-12)


def test_measured_velocity_is_that_of_the_sampling_instant() -> None:
    (row,) = readings(*swinging_source("measured", 0.01), [0.105])
    np.testing.assert_allclose(row[2:], velocity(0.1), atol=1e-12)


def test_differenced_velocity_is_the_difference_of_two_readings() -> None:
    (row,) = readings(*swinging_source("differenced", 0.01), [0.105])
    np.testing.assert_allclose(row[2:], (position(0.1) - position(0.09)) / 0.01, atol=1e-12)


@pytest.mark.parametrize("kind", ["measured", "differenced"])
def test_first_reading_keeps_the_measured_velocity(kind: str) -> None:
    rows = readings(*swinging_source(kind), [0.0, 0.0005])
    np.testing.assert_allclose(rows[:, 2:], [velocity(0.0)] * 2, atol=1e-12)


@pytest.mark.parametrize("kind", ["measured", "differenced"])
@pytest.mark.parametrize("period", [1e-3, 2e-3, 5e-3])
@pytest.mark.parametrize("source", [swinging_source, swinging_plant])
def test_velocity_never_jumps_from_one_reading_to_the_next(kind, period, source) -> None:
    times = np.arange(0.0, 0.05, period) + 0.3e-3
    v0 = np.array([2.0]) if source is swinging_plant else None
    rows = readings(*source(kind, period), [0.0, *times], v0)
    n = rows.shape[1] // 2
    # Accelerations stay below 20 rad/s²; differencing lags by a period at most.
    assert np.abs(np.diff(rows[:, n:], axis=0)).max() < 20.0 * 2.0 * period
    assert np.abs(rows[0, n:]).max() > 0.5


@pytest.mark.parametrize("kind", ["measured", "differenced"])
def test_a_resolver_that_jumps_by_whole_turns_is_read_on_the_circle(kind: str) -> None:
    """A joint passes π at 2 rad/s and its reading −π; one that slides passes there, too."""
    block = JointReadings(2, 1e-3, kind, turns=np.array([1.0, 0.0]))
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    for k in range(40):
        q = 3.1 + 2e-3 * k
        wrapped = (q + np.pi) % (2 * np.pi) - np.pi
        block.get_input_port().FixValue(context, [wrapped, q, 2.0, 2.0])
        simulator.AdvanceTo(1e-3 * k + 0.5e-3)
        np.testing.assert_allclose(block.get_output_port().Eval(context), [q, q, 2.0, 2.0])
    assert wrapped < 0
    # What slides may move by more than six metres in a sample; nothing is taken off.
    block.get_input_port().FixValue(context, [wrapped, q + 7.0, 2.0, 2.0])
    simulator.AdvanceTo(0.0405)
    assert block.get_output_port().Eval(context)[1] == q + 7.0


def test_before_a_simulator_has_initialized_the_reading_passes_through() -> None:
    block = JointReadings(2, 1e-3, "differenced")
    context = block.CreateDefaultContext()
    for state in ([1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0]):
        block.get_input_port().FixValue(context, state)
        np.testing.assert_array_equal(block.get_output_port().Eval(context), state)


@pytest.mark.parametrize("bad", [np.nan, -np.inf])
def test_a_state_that_is_not_finite_is_refused_by_name(bad: float) -> None:
    block = JointReadings(2)
    block.set_name("readings")
    simulator = Simulator(block)
    state = np.array([0.0, bad, 0.0, 0.0])
    block.get_input_port().FixValue(simulator.get_mutable_context(), state)
    with pytest.raises(SignalError, match=rf"readings:state.*1: {bad}"):
        simulator.Initialize()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((2, 0.0), r"period is 0 s"),
        ((2, np.nan), r"period is nan s"),
        ((2, -1e-3), r"period is -0\.001 s"),
        ((2, 1e-3, "resolver"), r"'resolver'.*measured.*"),
    ],
)
def test_what_cannot_be_sampled_is_refused(arguments, message) -> None:
    with pytest.raises(ConfigurationError, match=message):
        JointReadings(*arguments)
