"""The object's part as one part does what its blocks do: same numbers, same errors."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest
from internal_gains import bar_internal
from object_alone import ObjectAlone, object_of_blocks
from port_values import largest_difference, ports
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.framework import Diagram
from signal_sources import Rig, Signal
from two_arms import FORMS, ControlledPair, make_controlled_pair

from geoimp_drake.controllers.cooperative_config import CooperativeControllerConfig
from geoimp_drake.controllers.object_loop import ObjectParts
from geoimp_drake.errors import OutOfDomainError, SignalError, SingularityError
from geoimp_drake.laws.impedance.families import FAMILIES
from geoimp_drake.parts.grasp import MutualPose
from geoimp_drake.parts.object_load import ObjectLoad
from geoimp_drake.parts.reference_hold import AFTER_HOLD, ReferenceHoldConfig
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.frame_motion import (
    POSITION,
    QUATERNION,
    frame_motion_at_rest,
    frame_motion_vector,
    pose_of,
)
from geoimp_drake.systems.part_system import PartSystem, system_of
from geoimp_drake.systems.sources.desired_motion import DesiredMotion, MotionSegment

G = np.array([0.0, 0.0, -9.81])
STEPS = 50
SAME = 1e-11  # relative to the largest entry of a port

Change = Callable[[CooperativeControllerConfig], None]


@dataclass
class Case:
    """How the controller differs from its defaults."""

    change: Change = lambda config: None
    scale: np.ndarray | None = None
    options: dict = field(default_factory=dict)

    def config(self, form: str) -> CooperativeControllerConfig:
        config = CooperativeControllerConfig()
        # Quicker than the defaults, so that something happens in some steps.
        config.impedance.translation.damping = np.array(300.0)
        self.change(config)
        config.form = form
        return config


def constant_mutual_pose(config: CooperativeControllerConfig) -> None:
    config.internal.enabled = False


def only_translation_between_hands(config: CooperativeControllerConfig) -> None:
    config.internal.axes = "translation"


def printed(config: CooperativeControllerConfig) -> None:
    config.wrench = "printed"


def prescribed(config: CooperativeControllerConfig) -> None:
    Q = RollPitchYaw(0.01, -0.02, 0.015).ToQuaternion().wxyz()
    config.mutual_pose = MutualPose(Q, np.array([0.003, 0.7, -0.002]))


def constant_prescribed(config: CooperativeControllerConfig) -> None:
    constant_mutual_pose(config)
    prescribed(config)


def load(config: CooperativeControllerConfig, inertial_load: str = "compliant") -> None:
    config.load = ObjectLoad(
        3.0, np.array([0.1, -0.05, 0.02]), np.diag([0.3, 0.2, 0.4]), inertial_load
    )


def weight(config: CooperativeControllerConfig) -> None:
    load(config, "none")


def coupled(config: CooperativeControllerConfig) -> None:
    config.impedance.coupling = 5.0 * np.arange(9.0).reshape(3, 3) / 8.0


def only_translation(config: CooperativeControllerConfig) -> None:
    config.impedance.axes = "translation"


CASES = {
    "default": Case(),
    "constant mutual pose": Case(constant_mutual_pose),
    "translation between hands": Case(only_translation_between_hands),
    "printed": Case(printed),
    "prescribed": Case(prescribed),
    "prescribed, constant": Case(constant_prescribed),
    "load": Case(load),
    "weight": Case(weight),
    "scaled": Case(scale=np.array([2.5, 0.4])),
    "coupled": Case(coupled),
    "translation": Case(only_translation),
    "facing": Case(options={"parallel": False}),
    "facing, constant": Case(constant_mutual_pose, options={"parallel": False}),
}
every_case = pytest.mark.parametrize("name", CASES)


def pretended(sign: float) -> Signal:
    """Returns a wrench that swings, of one hand or the other."""

    def wrench(t: float) -> np.ndarray:
        swing = np.sin(40.0 * t + sign * np.arange(1.0, 7.0))
        return sign * np.array([0.5, -0.3, 0.4, 6.0, -8.0, 5.0]) * swing + 0.2 * np.arange(6.0)

    return wrench


# Two arms.


def everything(pair: ControlledPair) -> dict[str, np.ndarray]:
    """Returns the plant's state and what every port of the controller says."""
    root = pair.simulator.get_context()
    plant = pair.pair.plant
    state = plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(root))
    return {"state": state, **ports(pair.controller, pair.controller.GetMyContextFromRoot(root))}


def object_pose(options: dict) -> RigidTransform:
    at_rest = frame_motion_at_rest(RigidTransform())
    return pose_of(make_controlled_pair(lambda t: at_rest, **options).read("object_motion"))


def controlled_pair(case: Case, form: str) -> ControlledPair:
    move = MotionSegment(0.2, np.array([0.01, -0.02, 0.015]), np.array([0.01, 0.02, -0.01]))
    desired = DesiredMotion(object_pose(case.options), [move])
    wrenches = pretended(1.0), pretended(-1.0)
    pair = make_controlled_pair(desired.evaluate, case.config(form), wrenches, **case.options)
    if case.scale is not None:
        context = pair.controller.GetMyMutableContextFromRoot(pair.simulator.get_mutable_context())
        pair.controller.GetInputPort("stiffness_scale").FixValue(context, case.scale)
    return pair


def both_forms(case: Case) -> tuple[ControlledPair, ControlledPair]:
    compiled, blocks = (controlled_pair(case, form) for form in ("compiled", "blocks"))
    assert isinstance(compiled.controller, PartSystem)
    assert isinstance(blocks.controller, Diagram)
    return compiled, blocks


def assert_the_same(compiled: ControlledPair, blocks: ControlledPair) -> None:
    assert largest_difference(everything(compiled), everything(blocks)) < SAME


@every_case
def test_closed_loop_is_the_same(name: str) -> None:
    pairs = both_forms(CASES[name])
    # Nothing is initialized yet.
    assert_the_same(*pairs)
    start = everything(pairs[1])
    for step in (1, 2, 3, STEPS):
        for pair in pairs:
            pair.simulator.AdvanceTo(step * 1e-3)
        assert_the_same(*pairs)
    end = everything(pairs[1])
    for port in ("compliant_motion", "object_motion", "object_wrench", "mutual_motion", "energy"):
        assert np.abs(end[port] - start[port]).max() > 1e-4, port


def test_cases_differ() -> None:
    """Of the comparison: what is configured shows in 20 steps."""
    seen: list[dict[str, np.ndarray]] = []
    for name in ("default", "constant mutual pose", "printed", "load", "weight", "scaled"):
        pair = controlled_pair(CASES[name], "compiled")
        pair.simulator.AdvanceTo(0.02)
        seen.append(everything(pair))
    for k, ours in enumerate(seen):
        for others in seen[:k]:
            assert largest_difference(ours, others) > 1e-4


@pytest.mark.parametrize("name", ["default", "constant mutual pose", "load"])
def test_initialization_takes_the_grasp_anew(name: str) -> None:
    pairs = both_forms(CASES[name])
    taken = []
    for pair in pairs:
        pair.simulator.AdvanceTo(0.02)
        plant, (arm, _) = pair.pair.plant, pair.pair.arms
        context = plant.GetMyMutableContextFromRoot(pair.simulator.get_mutable_context())
        plant.SetPositions(context, arm, pair.pair.postures[0] + 0.02)
        before = pair.read("mutual_reference")
        pair.simulator.Initialize()
        taken.append(pair.read("mutual_reference"))
        assert np.abs(taken[-1] - before).max() > 1e-3
        # The references start on the hands.
        for k in (1, 2):
            hand, reference = pair.read(f"measured_motion_{k}"), pair.read(f"reference_motion_{k}")
            np.testing.assert_allclose(hand[POSITION], reference[POSITION], atol=1e-9)
    assert_the_same(*pairs)
    for time in (0.021, 0.022, 0.04):
        for pair in pairs:
            pair.simulator.AdvanceTo(time)
        assert_the_same(*pairs)
    np.testing.assert_allclose(pairs[0].read("mutual_reference"), taken[0], atol=1e-12)


# The object's part alone, between hands that move as told.


def hand(k: int, angle: float = 0.0) -> np.ndarray:
    """Returns the motion of a hand at rest, the second turned about the first's x axis."""
    motion = frame_motion_vector().value().copy()
    motion[POSITION] = [0.1, 0.7 * k, 0.2]
    if k:
        motion[QUATERNION] = quaternion.exp(np.array([angle, 0.0, 0.0]))
    return motion


GOOD: dict[str, Signal | np.ndarray] = {
    "desired_motion": frame_motion_at_rest(RigidTransform([0.1, 0.35, 0.2])),
    "wrench_1": pretended(1.0),
    "wrench_2": pretended(-1.0),
    "measured_motion_1": hand(0),
    "measured_motion_2": hand(1, 0.3),
}


def fed(case: Case, form: str = "compiled", **signals: Signal | np.ndarray) -> Rig:
    config = case.config(form)
    internal = None
    if config.internal.enabled:
        internal = bar_internal(axes=config.internal.axes).make()
    parts = ObjectParts.of(config, G, internal)
    if form == "blocks":
        return Rig(object_of_blocks(parts), {**GOOD, **signals})
    part = ObjectAlone(parts.held_object(), config.sampling.period)
    return Rig(system_of(part), {**GOOD, **signals})


def moving_hand(k: int) -> Signal:
    def motion(t: float) -> np.ndarray:
        moved = hand(k, 0.3 + 2.0 * t)
        moved[POSITION] += np.array([0.3, -0.2, 0.1 + k]) * t
        moved[7:13] = [2.0 * k, 0.0, 0.0, 0.3, -0.2, 0.1 + k]
        return moved

    return motion


@every_case
def test_alone_it_is_the_same(name: str) -> None:
    hands = {f"measured_motion_{k + 1}": moving_hand(k) for k in range(2)}
    rigs = [fed(CASES[name], form, **hands) for form in FORMS]
    for time in (0.0, 0.001, 0.002, 0.05):
        said = []
        for rig in rigs:
            if time:
                rig.advance(time)
            own = rig.system.GetMyContextFromRoot(rig.simulator.get_context())
            said.append(ports(rig.system, own))
        assert largest_difference(*said) < SAME


def test_a_stiffness_that_changes_on_the_way_is_followed() -> None:
    rigs = [
        fed(Case(), form, stiffness_scale=lambda t: np.array([1.0 + 90.0 * t, 1.0 - 9.0 * t]))
        for form in FORMS
    ]
    energies = []
    for rig in rigs:
        rig.advance(0.05)
        energies.append({port: rig.read(port) for port in ("compliant_motion", "energy")})
    constant = fed(Case()).advance(0.05)
    assert largest_difference(*energies) < SAME
    assert np.abs(constant.read("compliant_motion") - energies[0]["compliant_motion"]).max() > 1e-4


def let_go(t: float) -> np.ndarray:
    """Returns the wrench of a hand that carries until it opens at 20 ms."""
    return np.array([0.5, 0.2, -0.3, 2.0, -1.0, 64.0]) * (t < 0.0195)


@pytest.mark.parametrize("after", AFTER_HOLD)
def test_a_grasp_that_opens_is_the_same(after: str, caplog) -> None:
    def quick(config: CooperativeControllerConfig) -> None:
        config.opened = ReferenceHoldConfig(after, 0.01, 0.02, 0.05, 0.05)

    hands = {f"measured_motion_{k + 1}": moving_hand(k) for k in range(2)}
    rigs = [fed(Case(quick), form, wrench_2=let_go, **hands) for form in FORMS]
    passed: list[np.ndarray] = []
    for time in (0.03, *np.arange(0.031, 0.04, 1e-3), 0.06, 0.1):
        with caplog.at_level("WARNING", logger="drake"):
            said = [
                ports(rig.system, rig.system.GetMyContextFromRoot(rig.simulator.get_context()))
                for rig in (rig.advance(time) for rig in rigs)
            ]
        assert largest_difference(*said) < SAME
        passed.append(said[0]["reference_motion_2"][POSITION])
    assert len(caplog.records) == 2
    np.testing.assert_array_equal(said[0]["opened"][:2], [0.0, 1.0])
    np.testing.assert_array_equal(said[0]["release"], [float(after == "release"), 0.0])
    assert (np.linalg.norm(passed[-1] - passed[-3]) > 0.04) == (after == "retreat")
    # Initialized again, nothing has opened.
    for rig in rigs:
        rig.simulator.Initialize()
        np.testing.assert_array_equal(rig.read("opened"), [0.0, 0.0, -1.0])
        assert not rig.read("release").any()


def breaking(good: Signal | np.ndarray, index: int, bad: float) -> Signal:
    """Returns a signal that breaks down after 5 ms."""

    def signal(t: float) -> np.ndarray:
        value = np.array(good(t) if callable(good) else good)
        if t > 0.005:
            value[index] = bad
        return value

    return signal


@pytest.mark.parametrize("name", ["default", "constant mutual pose", "prescribed", "load"])
@pytest.mark.parametrize("port", GOOD)
def test_a_value_that_cannot_be_is_refused_by_port_and_number(port: str, name: str) -> None:
    wrong = [(2, np.nan, r"2: nan"), (5, -np.inf, r"5: -inf")]
    if "motion" in port:
        wrong.append((0, 1.7, "norm is 1"))
    for index, bad, message in wrong:
        rig = fed(CASES[name], **{port: breaking(GOOD[port], index, bad)})
        rig.advance(0.004)
        with pytest.raises(SignalError, match=rf"system:{port}.*{message}"):
            rig.advance(0.008)
        first = breaking(GOOD[port], index, bad)(1.0)
        with pytest.raises(SignalError, match=rf"system:{port}.*{message}"):
            fed(CASES[name], **{port: first}).simulator.Initialize()


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_a_factor_that_is_not_positive_is_refused(bad: float) -> None:
    rig = fed(CASES["default"], stiffness_scale=np.array([1.0, bad]))
    with pytest.raises(SignalError, match=rf"system:stiffness_scale.*{bad:g}.*must be positive"):
        rig.read("compliant_motion")


def facing_then_turned(angle: float) -> Signal:
    return lambda t: hand(1, np.pi if t < 0.005 else np.deg2rad(angle))


@pytest.mark.parametrize("name", ["default", "constant mutual pose"])
@pytest.mark.parametrize("form", FORMS)
def test_hands_that_turn_almost_a_whole_turn_are_refused(name: str, form: str) -> None:
    rig = fed(CASES[name], form, measured_motion_2=facing_then_turned(350.0))
    assert rig.advance(0.01).read("mutual_motion")[0] == pytest.approx(np.cos(np.deg2rad(175.0)))
    rig = fed(CASES[name], form, measured_motion_2=facing_then_turned(357.0))
    with pytest.raises(OutOfDomainError, match=r"ϑ_21 = 357\.0°"):
        rig.advance(0.01)


@pytest.mark.parametrize("form", FORMS)
def test_references_that_turn_almost_a_whole_turn_are_refused(form: str) -> None:
    """By a moment that the internal stiffness cannot hold; the hands do not move."""
    moment = np.array([400.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    hands = {"measured_motion_2": hand(1, np.pi), "wrench_1": -moment, "wrench_2": moment}
    rig = fed(CASES["default"], form, **hands)

    def run(until: float) -> None:
        for time in np.arange(rig.simulator.get_context().get_time(), until, 0.001):
            rig.advance(time).read("reference_motion_1")

    run(0.01)
    with pytest.raises(OutOfDomainError, match="ϑ_21"):
        run(1.0)


# A half turn to a pitch of 90°: in the domain of no family but the quaternion.
TURNED = frame_motion_at_rest(RigidTransform([0.1, 0.35, 0.2]))
TURNED[QUATERNION] = np.array([0.0, 1.0, 0.0, 1.0]) / np.sqrt(2.0)


# Both forms ask the same part; compiled, each family costs seconds: one of each kind of end.
COMPILED = ("quaternion", "classical-euler", "angle-axis-sin-half")
FAMILY_FORMS = [
    *((name, "blocks") for name in FAMILIES),
    *((name, "compiled") for name in COMPILED),
]


@pytest.mark.parametrize(("family", "form"), FAMILY_FORMS)
def test_an_attitude_outside_the_familys_domain_is_refused_by_name(family: str, form: str) -> None:
    def chosen(config: CooperativeControllerConfig) -> None:
        config.impedance.orientation = family

    hands = {"measured_motion_2": hand(1)}
    later = fed(Case(chosen), form, desired_motion=away_after(0.005), **hands).advance(0.004)
    at_once = fed(Case(chosen), form, desired_motion=TURNED, **hands)
    if family == "quaternion":
        later.advance(0.01)
        at_once.advance(0.01)
        return
    row = family.removeprefix("angle-axis-")
    kind = SingularityError if row == family else OutOfDomainError
    with pytest.raises(kind, match=rf"{row}[,:]"):
        later.advance(0.01)
    with pytest.raises(kind, match=rf"{row}[,:]"):
        at_once.simulator.Initialize()
    with pytest.raises(kind, match=rf"{row}[,:]"):
        fed(Case(chosen), form, desired_motion=TURNED, **hands).read("compliant_motion")


def away_after(time: float) -> Signal:
    good = GOOD["desired_motion"]
    return lambda t: TURNED if t > time else good


def test_hands_too_far_from_the_prescribed_grasp_are_refused_whatever_the_family() -> None:
    def chosen(config: CooperativeControllerConfig) -> None:
        config.impedance.orientation = "angle-axis-sin"
        config.mutual_pose = MutualPose(np.array([0.0, 1.0, 0.0, 0.0]))

    turned = hand(1, np.deg2rad(357.0))
    with pytest.raises(OutOfDomainError, match=r"ϑ_21 = 357\.0°"):
        fed(Case(chosen), measured_motion_2=turned).simulator.Initialize()


def too_stiff(config: CooperativeControllerConfig) -> None:
    config.impedance.translation.mass = np.array(0.05)


def test_a_motion_that_diverges_is_refused_with_what_to_do() -> None:
    with pytest.raises(SignalError, match=r"system: the motion of C has diverged.*M/D"):
        fed(Case(too_stiff)).advance(0.1)


@pytest.mark.parametrize("form", FORMS)
def test_a_wrench_that_no_arm_meets_is_refused_by_its_port(form) -> None:
    with pytest.raises(SignalError, match=r"wrench(_2)?' got -?\S+ N"):
        fed(Case(printed), form, wrench_2=np.full(6, -1e12)).advance(0.1)


def test_contexts_do_not_meet() -> None:
    """What the law writes is kept in the context, one for each."""
    rig = fed(Case()).advance(0.01)
    before, copy = rig.read("reference_motion_1"), rig.simulator.get_context().Clone()
    x = copy.get_mutable_continuous_state_vector()
    x.SetFromVector(x.CopyToVector() + 0.01)
    assert np.abs(rig.read("reference_motion_1", copy) - before).max() > 0.01
    np.testing.assert_array_equal(rig.read("reference_motion_1"), before)
    np.testing.assert_array_equal(
        rig.read("compliant_motion"), fed(Case()).advance(0.01).read("compliant_motion")
    )


def test_inputs_of_both_forms_are_the_same() -> None:
    inputs = []
    for form in FORMS:
        system = fed(Case(), form).system
        all_inputs = map(system.get_input_port, range(system.num_input_ports()))
        inputs.append({(port.get_name(), port.size()) for port in all_inputs})
    assert inputs[0] == inputs[1]
