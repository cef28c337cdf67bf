"""Two arms and their object as one system: what it can be, and what it says of which arm."""

import logging
from collections.abc import Callable, Mapping, Sequence
from functools import cache

import numpy as np
import pytest
from geoimp_drake.systems.arm.arm_control import ArmControl
from geoimp_drake.systems.cooperation.cooperative_control import CooperativeControl
from geoimp_drake.systems.cooperation.object_control import ObjectControl
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Diagram, System
from signal_sources import Rig, Signal
from two_arms import ControlledPair, add_arms, make_controlled_pair

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.compilation.compiled import SWITCH, is_available
from geoimp_drake.controllers.cooperative_config import CooperativeControllerConfig
from geoimp_drake.controllers.inner_loop import arm_blocks
from geoimp_drake.controllers.object_loop import object_blocks
from geoimp_drake.errors import SignalError
from geoimp_drake.systems.cooperation.reference_hold import AFTER_HOLD, ReferenceHoldConfig
from geoimp_drake.systems.frame_motion import POSITION, frame_motion_at_rest, pose_of

pytestmark = pytest.mark.skipif(not is_available(), reason="numba is not installed")

Change = Callable[[CooperativeControllerConfig], None]
STEPS = 20
SAME = 1e-11  # relative to the largest entry of a port


def other_family(config: CooperativeControllerConfig) -> None:
    config.impedance.orientation = "angle-axis-sin"


def other_tracking(config: CooperativeControllerConfig) -> None:
    config.motion.orientation = "angle-axis-sin"


def pushed(t: float) -> np.ndarray:
    return np.array([0.5, -0.3, 0.4, 6.0, -8.0, 5.0]) * np.sin(40.0 * t + 1.0)


@cache
def start() -> RigidTransform:
    """Returns the object's pose at the start."""
    at_rest = frame_motion_at_rest(RigidTransform())
    return pose_of(make_controlled_pair(lambda t: at_rest).read("object_motion"))


def desired(t: float) -> np.ndarray:
    motion = frame_motion_at_rest(start())
    motion[POSITION] += 0.05 * t
    return motion


def let_go(t: float) -> np.ndarray:
    """Returns the wrench of a hand that carries until it opens."""
    return np.array([0.5, 0.2, -0.3, 2.0, -1.0, 64.0]) * (t < 0.0095)


def pair_of(change: Change, fused: bool = True, second: Signal = pushed) -> ControlledPair:
    config = CooperativeControllerConfig(form="compiled" if fused else "blocks")
    change(config)
    return make_controlled_pair(desired, config, (pushed, second))


def assert_the_same(pairs: Sequence[ControlledPair]) -> None:
    controller = pairs[0].controller
    ports = map(controller.get_output_port, range(controller.num_output_ports()))
    for name in [port.get_name() for port in ports]:
        ours, others = (pair.read(name) for pair in pairs)
        assert np.abs(ours - others).max() < SAME * max(np.abs(others).max(), 1e-2), name


def kinds(pair: ControlledPair) -> dict[str, type[System]]:
    assert isinstance(pair.controller, Diagram)
    return {system.get_name(): type(system) for system in pair.controller.GetSystems()}


THREE: dict[str, type[System]] = {"arm_1": Diagram, "arm_2": Diagram, "object": Diagram}
MIXED = [
    (other_family, {**THREE, "arm_1": ArmControl, "arm_2": ArmControl}),
    (other_tracking, {**THREE, "object": ObjectControl}),
]


@pytest.mark.parametrize(("change", "expected"), MIXED)
def test_what_can_be_one_system_is(change: Change, expected: dict) -> None:
    assert kinds(pair_of(change)) == expected


def test_it_is_one_system_unless_told_otherwise_or_not_compiled(monkeypatch) -> None:
    assert isinstance(pair_of(lambda config: None).controller, CooperativeControl)
    assert kinds(pair_of(lambda config: None, fused=False)) == THREE
    monkeypatch.setenv(SWITCH, "0")
    assert kinds(pair_of(lambda config: None)) == THREE


@pytest.mark.parametrize("change", [change for change, _ in MIXED])
def test_the_mixed_forms_say_the_same_as_the_blocks(change: Change) -> None:
    pairs = [pair_of(change, fused) for fused in (True, False)]
    for pair in pairs:
        pair.simulator.AdvanceTo(STEPS * 1e-3)
    assert_the_same(pairs)


@pytest.mark.parametrize("after", AFTER_HOLD)
def test_a_grasp_that_opens_is_the_same_as_with_the_blocks(after: str) -> None:
    def quick(config: CooperativeControllerConfig) -> None:
        config.opened = ReferenceHoldConfig(after, 0.01, 0.005, 0.05, 0.02)

    pairs = [pair_of(quick, fused, let_go) for fused in (True, False)]
    for time in (0.015, 0.025, 0.06):
        for pair in pairs:
            pair.simulator.AdvanceTo(time)
        assert_the_same(pairs)
    np.testing.assert_array_equal(pairs[0].read("opened")[:2], [0.0, 1.0])
    np.testing.assert_array_equal(pairs[0].read("release"), [float(after == "release"), 0.0])


def test_ports_of_all_forms_are_the_same() -> None:
    def names(pair: ControlledPair) -> list[str]:
        system = pair.controller
        inputs = map(system.get_input_port, range(system.num_input_ports()))
        outputs = map(system.get_output_port, range(system.num_output_ports()))
        return [port.get_name() for port in (*inputs, *outputs)]

    changes: list[Change] = [lambda config: None, other_family, other_tracking]
    forms = [names(pair_of(change)) for change in changes]
    forms.append(names(pair_of(lambda config: None, fused=False)))
    assert all(form == forms[0] for form in forms)


def alone(changes: Mapping[str, Callable]) -> Rig:
    """Returns the system between sources, some of them changed."""
    plant = MultibodyPlant(1e-3)
    pair, config = add_arms(plant), CooperativeControllerConfig()
    settings = config.motion, config.sampling, config.redundancy_1
    arms = [
        arm_blocks(ControlModel.of_arm(plant, arm, E), *settings)
        for arm, E in zip(pair.arms, pair.frames, strict=True)
    ]
    signals: dict[str, Signal | np.ndarray] = {
        "desired_motion": desired,
        "wrench_1": pushed,
        "wrench_2": pushed,
    }
    for k, q in enumerate(pair.postures, 1):
        signals[f"estimated_state_{k}"] = np.concatenate((q, np.zeros_like(q)))
    given = {name: change(signals[name]) for name, change in changes.items()}
    return Rig(CooperativeControl(object_blocks(config, np.zeros(3)), arms), {**signals, **given})


def breaking(index: int, bad: float, after: float) -> Callable:
    """Returns what makes a signal break down after a time."""

    def broken(good: Signal | np.ndarray) -> Signal:
        def signal(t: float) -> np.ndarray:
            value = np.array(good(t) if callable(good) else good)
            if t > after:
                value[index] = bad
            return value

        return signal

    return broken


@pytest.mark.parametrize("port", ["estimated_state_1", "estimated_state_2", "wrench_1", "wrench_2"])
def test_a_value_that_cannot_be_is_refused_by_port_and_number(port: str) -> None:
    rig = alone({port: breaking(4, np.nan, 0.0035)}).advance(0.003)
    with pytest.raises(SignalError, match=rf"system:{port}'.*4: nan"):
        rig.advance(0.006)
    with pytest.raises(SignalError, match=rf"system:{port}'.*4: nan"):
        alone({port: breaking(4, np.nan, -1.0)}).simulator.Initialize()


@pytest.mark.parametrize("k", [1, 2])
def test_before_the_first_reading_the_port_passes_through(k: int) -> None:
    rig = alone({})
    before = rig.read(f"measured_motion_{k}")
    rig.simulator.Initialize()
    np.testing.assert_array_equal(rig.read(f"measured_motion_{k}"), before)
    assert before[0] != 0.0
    bad = alone({f"estimated_state_{k}": breaking(4, np.inf, -1.0)})
    for port in ("compliant_motion", "mutual_reference", f"actuation_{k}", f"measured_motion_{k}"):
        with pytest.raises(SignalError, match=rf"system:estimated_state_{k}'.*4: inf"):
            bad.read(port)


@pytest.mark.parametrize("k", [1, 2])
def test_saturation_is_said_of_the_arm(k: int, caplog) -> None:
    def fast(good: np.ndarray) -> Signal:
        """Returns a state whose joints turn fast, so that stopping them takes much torque."""
        positions = good[: len(good) // 2]
        return lambda t: np.concatenate((positions, np.full_like(positions, 9.0)))

    with caplog.at_level(logging.WARNING, logger="drake"):
        alone({f"estimated_state_{k}": fast}).advance(0.0005)
    said = [message for message in caplog.messages if "saturates" in message]
    assert said
    assert all(message.startswith(f"system, arm {k}: joint '") for message in said)
