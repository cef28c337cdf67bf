"""The controller of one arm as one system is that of blocks: same numbers, same errors."""

import logging
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from arms import POSTURES, ArmPlant, make_arm_plant
from port_values import largest_difference, ports
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    ModelInstanceIndex,
    RevoluteJoint,
    SpatialInertia,
)
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, System
from rigs import ControlledArm, arm_state_at, make_controlled_arm, quick_config

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.dynamics import Scratch
from geoimp_drake.compilation.compiled import SWITCH, is_available
from geoimp_drake.controllers import forms
from geoimp_drake.controllers.config import ImpedanceControllerConfig, RedundancyConfig
from geoimp_drake.controllers.inner_loop import InnerLoopParts, make_inner_loop
from geoimp_drake.errors import SignalError, SingularityError
from geoimp_drake.laws.impedance.families import FAMILIES
from geoimp_drake.laws.motion_control.orientation_control import ORIENTATION_LAWS
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import SingularityDamping
from geoimp_drake.parts.impedance_controller import ImpedanceController
from geoimp_drake.parts.inner_loop import InnerLoop
from geoimp_drake.parts.part import Now, Output, held
from geoimp_drake.systems.frame_motion import frame_motion_at_rest
from geoimp_drake.systems.part_system import PartSystem, system_of
from geoimp_drake.task_functions.config import TaskConfig

pytestmark = pytest.mark.skipif(not is_available(), reason="numba is not installed")

BLOCKS = (
    "impedance",
    "joint_readings",
    "arm_model",
    "motion_control",
    "redundancy",
    "inverse_dynamics",
    "limits",
)
FORMS = ("compiled", "blocks")
SHUFFLED = {6: [4, 2, 6, 1, 3, 5], 7: [7, 2, 5, 1, 3, 4, 6]}
STEPS = 60
PUSH = np.array([30.0, -20.0, 12.0]), np.array([0.8, -1.2, 0.5])  # [N], [Nm]
SAME = 1e-11  # relative to the largest entry


@dataclass
class Case:
    """An arm and how it is controlled."""

    joints: int = 6
    velocity: str = "measured"
    redundancy: dict[str, Any] = field(default_factory=dict)
    options: dict[str, Any] = field(default_factory=dict)
    family: str = "quaternion"
    tracking: str = "quaternion"
    scheme: str = "inner-loop"
    limited: bool = True
    inertia: str | None = None

    def config(self, form: str) -> ImpedanceControllerConfig:
        config = quick_config(self.velocity)
        config.redundancy = RedundancyConfig(**self.redundancy)
        config.form, config.scheme, config.inertia = form, self.scheme, self.inertia
        config.limits = config.limits if self.limited else None
        if self.inertia == "natural":
            for part in (config.impedance.translation, config.impedance.rotation):
                part.mass, part.damping = type(part)().mass, type(part)().damping
        config.impedance.orientation, config.motion.orientation = self.family, self.tracking
        return config

    def arm(self, form: str) -> ControlledArm:
        X_DE = RigidTransform(RollPitchYaw(0.02, -0.03, 0.04), [0.004, -0.003, 0.002])
        arm = make_controlled_arm(self.joints, self.config(form), X_DE=X_DE, **self.options)
        arm.push(*PUSH)
        return arm


TARGET = TaskConfig("joint-target", joints=["joint4"], target=np.array([1.1]), duration=0.05)
LIMITS = TaskConfig("joint-limits", margin=0.9)
PLANE = TaskConfig("plane-distance", link="link3", normal=np.array([0.3, -0.2, 1.0]), offset=-1.0)
WEIGHT = np.diag(np.arange(1.0, 8.0)) + 0.3
CASES = {
    "six": Case(),
    "six, differenced": Case(6, "differenced"),
    "six, motors in another order": Case(options={"actuator_order": SHUFFLED[6]}),
    "six, declared from the hand": Case(6, "differenced", options={"from_hand": True}),
    "seven": Case(7),
    "seven, differenced": Case(7, "differenced"),
    "seven among others": Case(7, options={"company": True, "actuator_order": SHUFFLED[7]}),
    "target": Case(7, redundancy={"task": TARGET, "k_beta": -250.0}),
    "manipulability": Case(7, redundancy={"task": TaskConfig("manipulability"), "k_beta": 20.0}),
    "limits": Case(7, "differenced", {"task": LIMITS, "k_beta": 5.0}),
    "plane": Case(7, redundancy={"task": PLANE, "k_beta": 2.0}),
    "identity": Case(7, redundancy={"weight": "identity"}),
    "constant": Case(7, redundancy={"K_n": np.linspace(1.0, 3.0, 7)}),
    "matrix": Case(7, redundancy={"weight": "matrix", "weight_matrix": WEIGHT}),
    "damped": Case(7, redundancy={"damping": SingularityDamping(1.0, 0.3)}),
    **{f"family {name}": Case(family=name) for name in FAMILIES if name != "quaternion"},
    **{f"law {name}": Case(tracking=name) for name in ORIENTATION_LAWS if name != "quaternion"},
    "six, at its efforts": Case(options={"effort": 20.0, "actuator_order": SHUFFLED[6]}),
    "seven, at its efforts": Case(7, "differenced", options={"effort": 20.0}),
    "direct, at its efforts": Case(scheme="direct", options={"effort": 20.0}),
    "direct": Case(scheme="direct"),
    "natural": Case(scheme="direct", inertia="natural"),
    "seven, natural, other law": Case(
        7, "differenced", family="classical-euler", scheme="direct", inertia="natural"
    ),
    "seven, direct, other law": Case(7, family="classical-euler", scheme="direct"),
    "seven, other laws": Case(7, family="angle-axis-sin", tracking="alternative-euler"),
}
every_case = pytest.mark.parametrize("name", CASES)


def everything(arm: ControlledArm) -> dict[str, np.ndarray]:
    """Returns the plant's state and what every port of the controller says."""
    context = arm.controller.GetMyContextFromRoot(arm.context)
    state = arm.rig.plant.GetPositionsAndVelocities(arm.plant_context)
    return {"state": state, **ports(arm.controller, context)}


def assert_the_same(compiled: ControlledArm, blocks: ControlledArm) -> None:
    assert largest_difference(everything(compiled), everything(blocks)) < SAME


def both_forms(case: Case) -> tuple[ControlledArm, ControlledArm]:
    compiled, blocks = map(case.arm, FORMS)
    assert isinstance(compiled.controller, PartSystem)
    assert isinstance(compiled.controller.part, ImpedanceController)
    names = tuple(block.get_name() for block in blocks.controller.GetSystems())
    expected = BLOCKS if case.limited else BLOCKS[:-1]
    assert names == (*expected, "no_wrench") if case.inertia == "natural" else names == expected
    return compiled, blocks


def advance(arms: tuple[ControlledArm, ...], time: float) -> None:
    for arm in arms:
        arm.simulator.AdvanceTo(time)


class LoopAlone:
    """An inner loop by itself, as a part."""

    def __init__(self, loop: InnerLoop):
        self._loop, n, self._signals = loop, loop.model.num_joints, loop.new_signals()
        self.inputs = {"estimated_state": 2 * n, "reference_motion": 19, "wrench": 6}
        self.memory = loop.memory
        self.samplings = ((loop.readings.period, loop.sample),)
        reading = "memory", "estimated_state"
        torque = *reading, "reference_motion", "wrench", "time"
        self.outputs = (
            Output("actuation", n, self._write_torque, torque),
            Output("measured_motion", 19, self._write_motion, reading),
            held("peak_effort", loop.memory.peak),
            Output("smallest_singular_value", 1, self._write_singular_value, reading),
            Output("null_space_error", n, self._write_error, torque),
            Output("task_value", 1, self._write_task_value, torque),
        )

    def new_workspace(self) -> tuple[Scratch]:
        return (self._loop.new_workspace(),)

    def start(self, memory: np.ndarray, now: Now) -> None:
        self._loop.start(memory, now)

    def begin(self, memory: np.ndarray, state: np.ndarray, now: Now) -> None:
        u = np.empty(self._loop.model.num_joints)
        *_, bound, limited = self._write_torque(now, u)
        self._loop.compare_with_limits(memory, self._signals, bound, limited, now)

    def _write_torque(self, now: Now, u: np.ndarray) -> tuple[np.ndarray, float, float, np.ndarray]:
        memory = self._loop.pass_through(now.memory, now)
        self._signals.reference[:] = now["reference_motion"]
        self._signals.wrench[:] = now["wrench"]
        found = self._loop.write_torque(now, memory, self._signals)
        u[:] = self._signals.u
        return found

    def _write_motion(self, now: Now, motion: np.ndarray) -> None:
        self._loop.write_motion(self._loop.pass_through(now.memory, now), now, motion)

    def _write_singular_value(self, now: Now, value: np.ndarray) -> None:
        memory = self._loop.pass_through(now.memory, now)
        value[:] = self._loop.smallest_singular_value(memory, now)

    def _write_error(self, now: Now, error: np.ndarray) -> None:
        n = len(error)
        error[:] = self._write_torque(now, np.empty(n))[0] if self._loop.is_redundant else 0.0

    def _write_task_value(self, now: Now, value: np.ndarray) -> None:
        n = self._loop.model.num_joints
        value[:] = self._write_torque(now, np.empty(n))[1] if self._loop.is_redundant else 0.0


@dataclass
class Fed:
    """An inner loop whose inputs are given by hand, and its simulator."""

    system: System
    simulator: Simulator

    @staticmethod
    def of(model: ControlModel, case: Case, form: str = "compiled") -> "Fed":
        config = case.config(form)
        parts = InnerLoopParts.of(model, config.motion, config.sampling, config.redundancy)
        is_compiled = form == "compiled"
        loop = system_of(LoopAlone(parts.loop())) if is_compiled else make_inner_loop(parts)
        loop.set_name("loop")
        return Fed(loop, Simulator(loop))

    @property
    def context(self) -> Context:
        return self.simulator.get_mutable_context()

    def give(self, port: str, value: np.ndarray) -> None:
        self.system.GetInputPort(port).FixValue(self.context, value)

    def give_all(self, state: np.ndarray) -> "Fed":
        """Gives a state, a reference near where E is then, and a wrench."""
        self.give("estimated_state", state)
        self.give("wrench", np.arange(1.0, 7.0))
        self.give("reference_motion", frame_motion_at_rest(RigidTransform()))
        reference = self.read("measured_motion")
        reference[4:] += 0.01 * np.arange(1.0, 16.0)
        self.give("reference_motion", reference)
        return self

    def read(self, port: str) -> np.ndarray:
        return self.system.GetOutputPort(port).Eval(self.context).copy()


def arm_of(rig: ArmPlant) -> tuple[MultibodyPlant, ModelInstanceIndex, Frame]:
    return rig.plant, rig.arm, rig.E


def fed(case: Case, form: str = "compiled") -> Fed:
    rig = make_arm_plant(joints=case.joints, **case.options)
    model = ControlModel.of_arm(*arm_of(rig))
    v = 0.1 * np.arange(1.0, case.joints + 1)
    return Fed.of(model, case, form).give_all(np.append(rig.posture, v))


def parallel_axes() -> ControlModel:
    """Returns an arm whose six axes are vertical: it is singular everywhere, exactly."""
    plant = MultibodyPlant(1e-3)
    arm = plant.AddModelInstance("arm")
    frame = plant.world_frame()
    for k in range(6):
        inertia = SpatialInertia.SolidBoxWithMass(2.0, 0.1, 0.1, 0.3)
        body = plant.AddRigidBody(f"link{k}", arm, inertia)
        place = FixedOffsetFrame(f"place{k}", frame, RigidTransform([0.3, 0.0, 0.0]), arm)
        joint = RevoluteJoint(f"joint{k}", plant.AddFrame(place), body.body_frame(), [0, 0, 1])
        plant.AddJointActuator(f"motor{k}", plant.AddJoint(joint))
        frame = body.body_frame()
    plant.Finalize()
    return ControlModel.of_arm(plant, arm, frame)


@every_case
def test_closed_loop_is_the_same(name: str) -> None:
    case = CASES[name]
    arms = both_forms(case)
    # Nothing is initialized yet: the joints' state passes through.
    assert_the_same(*arms)
    start = everything(arms[1])
    for step in (1, 2, 3, STEPS):
        advance(arms, step * 1e-3)
        assert_the_same(*arms)
    # Something has happened: the arm was pushed, and moves.
    end = everything(arms[1])
    assert largest_difference(start, end) > 1e-2
    assert np.abs(end["peak_effort"]).max() > 0.01
    assert (np.abs(end["null_space_error"]).max() > 1e-6) == (case.joints > 6)
    assert (end["task_value"][0] != 0.0) == (case.joints > 6)
    if damping := case.redundancy.get("damping"):
        assert end["smallest_singular_value"][0] < 0.5 * damping.threshold


@pytest.mark.parametrize("name", ["six, differenced", "seven, differenced", "target"])
def test_initialization_forgets_readings_and_start_posture(name: str) -> None:
    case = CASES[name]
    arms = both_forms(case)
    advance(arms, 0.02)
    posture, v = POSTURES[case.joints] + 0.1, np.linspace(0.2, -0.3, case.joints)
    for arm in arms:
        arm.set_state(posture, v)
        arm.simulator.Initialize()
    assert_the_same(*arms)
    # Not a difference of postures, which would be 100 rad/s.
    assert np.abs(arms[0].read("measured_motion")[7:13]).max() < 2.0
    if case.joints > 6:
        assert np.abs(arms[0].read("null_space_error")).max() < 2.0
    np.testing.assert_allclose(
        arms[0].read("measured_motion")[7:13], arms[0].arm_state().V_WE, atol=SAME
    )
    for time in (0.021, 0.022, 0.05):
        advance(arms, time)
        assert_the_same(*arms)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("velocity", ["measured", "differenced"])
def test_readings_are_sampled_and_held(velocity: str, form: str) -> None:
    loop = fed(Case(6, velocity), form)
    q, v = loop.system.GetInputPort("estimated_state").Eval(loop.context).reshape(2, -1).copy()
    seen = []
    for step in range(4):
        # At 0.0, 1.0, 2.0 … ms a reading is taken; what is given in between is not seen.
        loop.give("estimated_state", np.append(q + step * 1e-3, v))
        loop.simulator.AdvanceTo((step + 0.4) * 1e-3)
        seen.append(loop.read("measured_motion"))
        loop.give("estimated_state", np.append(q + 0.5, v - 3.0))
        loop.simulator.AdvanceTo((step + 0.6) * 1e-3)
        np.testing.assert_array_equal(loop.read("measured_motion"), seen[-1])
    model = ControlModel.of_arm(*arm_of(make_arm_plant()))
    for step, motion in enumerate(seen):
        # The first reading knows no difference.
        differenced = velocity == "differenced" and step
        arm = arm_state_at(model, q + step * 1e-3, np.ones(6) if differenced else v)
        np.testing.assert_allclose(motion[4:13], [*arm.p_WE, *arm.V_WE], atol=SAME)


def test_time_alone_moves_the_target() -> None:
    loops = [fed(CASES["target"], form) for form in FORMS]
    before = ports(loops[0].system, loops[0].context)
    for loop in loops:
        loop.context.SetTime(0.02)
    after, expected = (ports(loop.system, loop.context) for loop in loops)
    assert largest_difference(after, expected) < SAME
    assert after["task_value"] > before["task_value"] + 1e-4
    assert np.abs(after["actuation"] - before["actuation"]).max() > 1e-3


def test_target_starts_anew_where_the_arm_is_then() -> None:
    arm = CASES["target"].arm("compiled")
    arm.simulator.AdvanceTo(0.01)
    value = arm.read("task_value")
    arm.set_state(POSTURES[7] + 0.2, np.zeros(7))
    arm.simulator.AdvanceTo(0.012)
    without = arm.read("task_value")
    arm.simulator.Initialize()
    # The trajectory has gone a part of its way, from the new start.
    assert without > 0.01
    assert arm.read("task_value") < 0.01
    assert value < 0.01


def test_clones_of_a_context_do_not_know_of_each_other() -> None:
    """Of a task that positions the scratch context, turn by turn."""
    loop = fed(CASES["plane"])
    loop.simulator.Initialize()
    alone = ports(loop.system, loop.context)
    other = loop.context.Clone()
    state = np.append(POSTURES[7] + 0.3, np.full(7, -0.2))
    loop.system.GetInputPort("estimated_state").FixValue(other, state)
    Simulator(loop.system, other).Initialize()
    there = ports(loop.system, other)
    assert largest_difference(alone, there) > 0.1
    for k in range(3):
        for context, expected in ((loop.context, alone), (other, there)):
            # Another wrench makes the law run again.
            for h in (np.full(6, k + 0.5), np.arange(1.0, 7.0)):
                loop.system.GetInputPort("wrench").FixValue(context, h)
                again = ports(loop.system, context)
            for port, value in expected.items():
                np.testing.assert_array_equal(again[port], value, err_msg=port)


BAD = {
    "estimated_state": [(3, np.nan, r"3: nan"), (9, -np.inf, r"9: -inf")],
    "reference_motion": [(8, np.nan, r"8: nan"), (18, np.inf, r"18: inf"), (0, 1.2, r"norm is 1")],
    "wrench": [(0, np.nan, r"0: nan"), (5, np.inf, r"5: inf")],
}


@pytest.mark.parametrize("joints", [6, 7])
@pytest.mark.parametrize("port", BAD)
def test_a_value_that_cannot_be_is_refused_by_port_and_number(port: str, joints: int) -> None:
    for index, bad, message in BAD[port]:
        loop = fed(Case(joints))
        assert np.isfinite(loop.read("actuation")).all()
        value = loop.system.GetInputPort(port).Eval(loop.context).copy()
        value[index] = bad
        loop.give(port, value)
        expected = rf"loop:{port}.*{message}"
        with pytest.raises(SignalError, match=expected):
            loop.read("actuation")
        with pytest.raises(SignalError, match=expected):
            loop.simulator.AdvanceTo(0.002)


@pytest.mark.parametrize("port", ["measured_motion", "smallest_singular_value"])
def test_outputs_of_the_joints_refuse_a_reading_that_cannot_be(port: str) -> None:
    loop = fed(Case(6))
    loop.give("estimated_state", np.full(12, np.nan))
    with pytest.raises(SignalError, match=r"loop:estimated_state.*0: nan"):
        loop.read(port)


def test_a_reading_that_stops_to_be_finite_is_refused_by_port_and_number() -> None:
    loop = fed(Case(6, "differenced"))
    loop.simulator.AdvanceTo(0.003)
    state = loop.system.GetInputPort("estimated_state").Eval(loop.context).copy()
    state[4] = np.nan
    loop.give("estimated_state", state)
    with pytest.raises(SignalError, match=r"loop:estimated_state.*4: nan"):
        loop.simulator.AdvanceTo(0.006)


@pytest.mark.parametrize("form", FORMS)
def test_a_singular_posture_of_six_joints_has_a_named_error(form: str) -> None:
    loop = Fed.of(parallel_axes(), Case(6), form).give_all(np.zeros(12))
    with pytest.raises(SingularityError, match="singular"):
        loop.read("actuation")
    # How near it is can be read all the same.
    assert loop.read("smallest_singular_value")[0] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_array_equal(loop.read("null_space_error"), np.zeros(6))


def messages(case: Case, form: str, caplog: pytest.LogCaptureFixture) -> list[str]:
    """Returns what is said of torques, without the names of the systems."""
    caplog.clear()
    with caplog.at_level(logging.WARNING, logger="drake"):
        case.arm(form).simulator.AdvanceTo(0.02)
    return [message.split(":", 1)[1] for message in caplog.messages]


def test_saturation_is_said_once_for_each_joint(caplog) -> None:
    case = Case(options={"effort": 20.0, "actuator_order": SHUFFLED[6]}, limited=False)
    ours = messages(case, "compiled", caplog)
    assert ours == messages(case, "blocks", caplog)
    joints = [message.split("'")[1] for message in ours]
    assert "joint3" in joints
    assert len(set(joints)) == len(joints)
    assert all("±20" in message for message in ours)


def test_uncompiled_the_compiled_form_is_the_same_and_says_that_it_is_slower(
    monkeypatch, caplog
) -> None:
    arms = both_forms(CASES["six"])
    monkeypatch.setenv(SWITCH, "0")
    forms.warn_uncompiled.cache_clear()
    with caplog.at_level(logging.WARNING, logger="drake"):
        arm = CASES["six"].arm("compiled")
        CASES["six"].arm("compiled")
    assert [message for message in caplog.messages if "slower" in message] == caplog.messages[:1]
    for each in (arm, *arms):
        each.simulator.AdvanceTo(0.01)
    assert largest_difference(everything(arm), everything(arms[1])) < SAME


def test_ports_of_both_forms_are_the_same() -> None:
    one, other = (fed(Case(7), form) for form in FORMS)
    for loop in (one, other):
        inputs = map(loop.system.get_input_port, range(loop.system.num_input_ports()))
        assert [port.get_name() for port in inputs] == list(BAD)
    assert list(ports(one.system, one.context)) == list(ports(other.system, other.context))
