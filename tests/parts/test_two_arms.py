"""Two arms and their object as one part do what the blocks do, and say of which arm."""

import logging
from collections.abc import Callable, Mapping, Sequence
from functools import cache

import numpy as np
import pytest
from port_values import largest_difference
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from signal_sources import Rig, Signal
from two_arms import FORMS, ControlledPair, add_arms, make_controlled_pair

from geoimp_drake.compilation.compiled import SWITCH
from geoimp_drake.controllers import forms
from geoimp_drake.controllers.cooperative_config import CooperativeControllerConfig
from geoimp_drake.errors import OutOfDomainError, SignalError, SingularityError
from geoimp_drake.laws.impedance.families import FAMILIES
from geoimp_drake.laws.motion_control.orientation_control import ORIENTATION_LAWS
from geoimp_drake.parts.reference_hold import AFTER_HOLD, ReferenceHoldConfig
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.frame_motion import (
    POSITION,
    QUATERNION,
    frame_motion_at_rest,
    pose_of,
)

Change = Callable[[CooperativeControllerConfig], None]
STEPS = 20
SAME = 1e-11  # relative to the largest entry of a port


def nothing(config: CooperativeControllerConfig) -> None:
    """Leaves the defaults."""


def family(name: str) -> Change:
    """Returns what chooses the orientation family of the object's impedance."""

    def change(config: CooperativeControllerConfig) -> None:
        config.impedance.orientation = name

    return change


def tracking(name: str) -> Change:
    """Returns what chooses the orientation law of the inner loops."""

    def change(config: CooperativeControllerConfig) -> None:
        config.motion.orientation = name

    return change


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
    turn = quaternion.exp(np.array([8.0, -6.0, 10.0]) * t)
    motion[QUATERNION] = quaternion.product(turn, motion[QUATERNION])
    return motion


def let_go(t: float) -> np.ndarray:
    """Returns the wrench of a hand that carries until it opens."""
    return np.array([0.5, 0.2, -0.3, 2.0, -1.0, 64.0]) * (t < 0.0095)


def pair_of(change: Change, form: str = "compiled", second: Signal = pushed) -> ControlledPair:
    config = CooperativeControllerConfig(form=form)
    change(config)
    return make_controlled_pair(desired, config, (pushed, second))


def assert_the_same(pairs: Sequence[ControlledPair]) -> None:
    controller = pairs[0].controller
    outputs = map(controller.get_output_port, range(controller.num_output_ports()))
    names = [port.get_name() for port in outputs]
    ours, others = ({name: pair.read(name) for name in names} for pair in pairs)
    assert largest_difference(ours, others) < SAME


def weak(config: CooperativeControllerConfig) -> None:
    """Lets the arms use so little of their efforts that they cannot follow."""
    assert config.limits is not None
    config.limits.effort = 0.1


def said_after(steps: int, change: Change, form: str = "compiled") -> dict[str, np.ndarray]:
    """Returns what some ports say after a number of steps."""
    pair = pair_of(change, form)
    pair.simulator.AdvanceTo(steps * 1e-3)
    ports = "compliant_motion", "displacement", "energy", "actuation_1", "actuation_2"
    return {port: pair.read(port) for port in ports}


@pytest.mark.parametrize(
    "change",
    [pytest.param(family(name), id=f"impedance {name}") for name in FAMILIES]
    + [pytest.param(tracking(name), id=f"tracking {name}") for name in ORIENTATION_LAWS]
    + [pytest.param(weak, id="at its efforts")],
)
def test_closed_loop_is_the_same_with_every_orientation_law(change: Change) -> None:
    pairs = [pair_of(change, form) for form in FORMS]
    for pair in pairs:
        pair.simulator.AdvanceTo(STEPS * 1e-3)
    assert_the_same(pairs)


@pytest.mark.parametrize(
    ("chosen", "names", "port"),
    [(family, FAMILIES, "displacement"), (tracking, ORIENTATION_LAWS, "actuation_2")],
)
def test_orientation_laws_differ(
    chosen: Callable[[str], Change], names: Sequence[str], port: str
) -> None:
    """Of the comparison: which law is chosen shows in 20 steps.

    That of f = sin(ϑ/2) is the quaternion's.
    """
    seen = [said_after(STEPS, chosen(name))[port] for name in set(names) - {"angle-axis-sin-half"}]
    for k, ours in enumerate(seen):
        for others in seen[:k]:
            assert np.abs(ours - others).max() > 1e-7 * np.abs(others).max()


def test_uncompiled_it_says_the_same_with_one_warning(monkeypatch, caplog) -> None:
    expected = said_after(3, nothing)
    monkeypatch.setenv(SWITCH, "0")
    forms.warn_uncompiled.cache_clear()
    with caplog.at_level(logging.WARNING, logger="drake"):
        found = said_after(3, nothing)
        pair_of(nothing)
    for port, value in expected.items():
        np.testing.assert_allclose(found[port], value, rtol=SAME, atol=SAME, err_msg=port)
    assert sum("cannot be compiled here" in message for message in caplog.messages) == 1


@pytest.mark.parametrize("after", AFTER_HOLD)
def test_a_grasp_that_opens_is_the_same_as_with_the_blocks(after: str) -> None:
    def quick(config: CooperativeControllerConfig) -> None:
        config.opened = ReferenceHoldConfig(after, 0.01, 0.005, 0.05, 0.02)

    pairs = [pair_of(quick, form, let_go) for form in FORMS]
    for time in (0.015, 0.025, 0.06):
        for pair in pairs:
            pair.simulator.AdvanceTo(time)
        assert_the_same(pairs)
    np.testing.assert_array_equal(pairs[0].read("opened")[:2], [0.0, 1.0])
    np.testing.assert_array_equal(pairs[0].read("release"), [float(after == "release"), 0.0])


def test_ports_of_both_forms_are_the_same() -> None:
    def ports(form: str) -> list[tuple[str, int]]:
        system = pair_of(nothing, form).controller
        inputs = map(system.get_input_port, range(system.num_input_ports()))
        outputs = map(system.get_output_port, range(system.num_output_ports()))
        return [(port.get_name(), port.size()) for port in (*inputs, *outputs)]

    assert ports("compiled") == ports("blocks")


def alone(changes: Mapping[str, Callable], change: Change = nothing) -> Rig:
    """Returns the system between sources, some of them changed."""
    pair, config = add_arms(MultibodyPlant(1e-3)), CooperativeControllerConfig(form="compiled")
    change(config)
    signals: dict[str, Signal | np.ndarray] = {
        "desired_motion": desired,
        "wrench_1": pushed,
        "wrench_2": pushed,
    }
    for k, q in enumerate(pair.postures, 1):
        signals[f"estimated_state_{k}"] = np.concatenate((q, np.zeros_like(q)))
    given = {name: change(signals[name]) for name, change in changes.items()}
    return Rig(pair.controller(config), {**signals, **given})


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


@pytest.mark.parametrize("name", ORIENTATION_LAWS)
def test_a_reference_outside_the_domain_of_the_inner_law_is_refused_by_name(name: str) -> None:
    """C is D here, which turns to a pitch of 90° by half a turn: too far for each but one."""

    def chosen(config: CooperativeControllerConfig) -> None:
        tracking(name)(config)
        config.impedance.axes = "none"

    def turned(good: Signal) -> Signal:
        def signal(t: float) -> np.ndarray:
            motion = good(t)
            if t > 0.0035:
                motion[QUATERNION] = np.array([0.0, 1.0, 0.0, 1.0]) / np.sqrt(2.0)
            return motion

        return signal

    rig = alone({"desired_motion": turned}, chosen).advance(0.003)
    if name == "quaternion":
        rig.advance(0.006)
        return
    row = name.removeprefix("angle-axis-")
    kind = SingularityError if row == name else OutOfDomainError
    with pytest.raises(kind, match=rf"{row}[,:]"):
        rig.advance(0.006)


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
def test_limits_that_act_are_said_of_the_arm(k: int, caplog) -> None:
    def fast(good: np.ndarray) -> Signal:
        """Returns a state whose joints turn fast, so that stopping them takes much torque."""
        positions = good[: len(good) // 2]
        return lambda t: np.concatenate((positions, np.full_like(positions, 9.0)))

    with caplog.at_level(logging.WARNING, logger="drake"):
        alone({f"estimated_state_{k}": fast}).advance(0.0005)
    said = [message for message in caplog.messages if "as asked" in message]
    assert said
    assert all(message.startswith(f"system, arm {k}: at t = 0.000 s") for message in said)
