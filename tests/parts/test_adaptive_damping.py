"""Contacts that ring because the wrench comes late: what is observed of them, and how they end."""

import numpy as np
import pytest
from ringing_contact import Rung, press

from geoimp_drake.compilation.compiled import is_available
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.parts.adaptive_damping import AdaptiveDamping, AdaptiveDampingConfig
from geoimp_drake.parts.part_loop import PartLoop
from geoimp_drake.parts.passivity import PassivityConfig
from geoimp_drake.parts.passivity_observer import ObserverConfig, PassivityObserver
from geoimp_drake.systems.frame_motion import FRAME_MOTION_SIZE

needs_numba = pytest.mark.skipif(not is_available(), reason="numba is not installed")

# Mass [kg], damping [Ns/m], stiffness of the wall [N/m], delay of the wrench [ms].
CONTACTS = [(2.0, 61.5, 3e4, 4), (2.0, 61.5, 7e3, 19), (9.0, 434.0, 1e5, 19)]
every_contact = pytest.mark.parametrize("contact", CONTACTS, ids=str)


def config(contact, damping: AdaptiveDampingConfig | None = None, form: str = "compiled"):
    made = ImpedanceControllerConfig(form=form, passivity=PassivityConfig(damping=damping))
    translation = made.impedance.translation
    translation.mass, translation.damping = np.array(contact[0]), np.array(contact[1])
    made.impedance.rotation.stiffness = np.array(20.0)
    return made


def adaptive(delay: int, most: float = 5.0) -> AdaptiveDampingConfig:
    return AdaptiveDampingConfig(most=most, observer=ObserverConfig(delay=delay))


def observed(contact, delay: int) -> Rung:
    """A contact that rings, on a wall that dissipates some energy; nothing is done about it."""
    _, _, stiffness, late = contact
    return press(config(contact, adaptive(delay, most=1.0)), stiffness, late, 1.5, 1e-3 * stiffness)


@needs_numba
@every_contact
def test_a_contact_that_rings_comes_to_rest(contact) -> None:
    _, _, stiffness, late = contact
    free = press(config(contact), stiffness, late, 2.5)
    damped = press(config(contact, adaptive(late)), stiffness, late, 2.5)
    assert 100.0 < free.swing(2.0) < 160.0
    assert damped.swing(2.0) < 1e-3
    assert damped.force[-1] > 5.0  # it still presses
    scale = damped.outputs["damping_scale"]
    assert scale[0] == 1.0
    assert 1.5 < scale.max() <= 5.0


@needs_numba
@every_contact
def test_the_work_is_that_on_the_wall_if_wrench_and_way_are_of_one_step(contact) -> None:
    late = contact[3]
    paired, naive = observed(contact, late), observed(contact, 0)
    assert paired.swing(1.0) > 50.0
    begin, end = np.searchsorted(paired.t, [0.8, 1.4])
    # It is known when the wrench has come and the readings have: late + 1 samples afterwards.
    seen = paired.outputs["given_out"][late + 1 :]
    given_out = paired.work[end] - paired.work[begin]
    assert given_out > 0.01
    assert seen[end] - seen[begin] == pytest.approx(given_out, rel=1e-3)
    # The wrench of then and the way of now would say that the hand takes energy up.
    seen = naive.outputs["given_out"]
    assert seen[end] - seen[begin] < -0.1


@needs_numba
def test_both_forms_damp_alike() -> None:
    contact = CONTACTS[0]
    rungs = [
        press(config(contact, adaptive(contact[3]), form), contact[2], contact[3], 0.5)
        for form in ("compiled", "blocks")
    ]
    assert rungs[0].outputs["damping_scale"][-1] > 1.5
    np.testing.assert_allclose(rungs[1].force, rungs[0].force, atol=1e-6)
    for name, values in rungs[0].outputs.items():
        np.testing.assert_allclose(rungs[1].outputs[name], values, atol=1e-6)


# The part by hand: E moves along z, and the wrench is along z.


def moved(part: PassivityObserver | AdaptiveDamping, forces, heights, output: str) -> np.ndarray:
    loop, values = PartLoop(part, "observer"), []

    def inputs(force: float, height: float) -> dict[str, np.ndarray]:
        motion = np.zeros(FRAME_MOTION_SIZE)
        motion[[0, 6]] = 1.0, height
        return {"wrench": np.array([0, 0, 0, 0, 0, force]), "measured_motion": motion}

    loop.reset(inputs(forces[0], heights[0]))
    for force, height in zip(forces[1:], heights[1:], strict=True):
        loop.step(inputs(force, height), {}, 1e-3)
        values.append(float(loop.output(output)[0]))
    return np.array(values)


T = 1e-3 * np.arange(1500)


def test_a_wrench_that_is_late_is_paired_with_the_way_of_its_step() -> None:
    heights = 1e-3 * np.cumsum(np.sin(60.0 * T)) + 0.01 * T
    forces = 20.0 * np.sin(60.0 * T + 0.3)
    late = np.concatenate((np.zeros(7), forces[:-7]))
    part = PassivityObserver(config=ObserverConfig(delay=7))
    seen = moved(part, late, heights, "given_out")
    work = np.cumsum(forces[1:] * np.diff(heights))
    np.testing.assert_allclose(seen[7:], work[:-7], atol=1e-9)


def test_pressing_slowly_and_a_single_push_do_not_ring() -> None:
    slow = moved(PassivityObserver(), 40.0 * np.ones_like(T), 0.05 * T, "alternating")
    assert not slow.any()
    bump = np.exp(-(((T - 0.5) / 0.02) ** 2))
    single = moved(PassivityObserver(), 40.0 * bump, 0.01 * bump, "alternating")
    assert not single.any()
    again = bump + np.exp(-(((T - 0.7) / 0.02) ** 2))
    assert moved(PassivityObserver(), 40.0 * again, 0.01 * again, "alternating").max() > 0.05


def test_a_swing_below_a_millijoule_says_nothing() -> None:
    swing = np.sin(60.0 * T)
    ways = 1e-3 * np.cumsum(np.sin(60.0 * T)) / 6.0
    assert moved(PassivityObserver(), 20.0 * swing, ways, "alternating").max() > 1e-3
    assert not moved(PassivityObserver(), 0.1 * swing, 0.1 * ways, "alternating").any()


def test_damping_rises_while_it_rings_and_falls_in_time() -> None:
    rings = T < 0.7
    swing, ways = np.sin(60.0 * T) * rings, np.cumsum(np.sin(60.0 * T) * rings) / 6e3
    part = AdaptiveDamping(config=AdaptiveDampingConfig(most=3.0, fall=0.2))
    scale = moved(part, 20.0 * swing, ways, "damping_scale")
    assert scale.max() == pytest.approx(3.0)
    assert scale[400:690].min() > 2.5
    assert scale[-1] == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (AdaptiveDampingConfig(most=0.5), r"damping\.most is 0\.5"),
        (AdaptiveDampingConfig(rise=0.0), r"damping\.rise is 0 s"),
        (AdaptiveDampingConfig(observer=ObserverConfig(delay=-1)), r"observer\.delay is -1"),
        (AdaptiveDampingConfig(observer=ObserverConfig(least=0.0)), r"observer\.least is 0 J"),
    ],
)
def test_numbers_that_cannot_be_are_refused(made, message) -> None:
    with pytest.raises(ConfigurationError, match=message):
        AdaptiveDamping(config=made)


def test_a_wrench_that_is_not_finite_is_named() -> None:
    with pytest.raises(SignalError, match=r"observer:wrench.*nan"):
        moved(PassivityObserver(), [0.0, np.nan], [0.0, 0.0], "given_out")
