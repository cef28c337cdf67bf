"""Whole controllers whose gains change through a tank: both forms, every scheme, a loop by hand."""

from functools import cache

import numpy as np
import pytest
from limited_arm import POSTURES, arm_plant, pose_at
from rigs import make_controlled_arm, quick_config

from geoimp_drake.compilation.compiled import is_available
from geoimp_drake.controllers.admittance_controller import AdmittanceLoop
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.parts.energy_tank import TankConfig
from geoimp_drake.parts.passivity import PassivityConfig
from geoimp_drake.systems.frame_motion import frame_motion_at_rest

pytestmark = pytest.mark.skipif(not is_available(), reason="numba is not installed")

FORMS = ("compiled", "blocks")
PUSH = np.array([30.0, -20.0, 12.0]), np.array([0.8, -1.2, 0.5])  # [N], [Nm]
STEPS = 60
PORTS = ("actuation", "compliant_motion", "displacement", "energy")


def config(form: str, scheme: str = "inner-loop", *, tank: bool = True):
    made = quick_config()
    made.form, made.scheme = form, scheme
    made.passivity = PassivityConfig(gains=TankConfig(start=0.01, cap=0.05) if tank else None)
    return made


def run(made: ImpedanceControllerConfig, times: float = 1.0) -> np.ndarray:
    """Returns what ports say of an arm under a push whose stiffness is multiplied on the way."""
    arm = make_controlled_arm(6, made)
    arm.push(*PUSH)
    rows = []
    ports = [*PORTS, "tank"] if made.passivity.is_on else PORTS
    for step in range(STEPS):
        if made.passivity.is_on and step in (20, 21):
            K = np.zeros((6, 6))
            gains = made.impedance.gains
            K[:3, :3], K[3:, 3:] = gains("rotation")[2], gains("translation")[2]
            context = arm.controller.GetMyMutableContextFromRoot(arm.context)
            arm.controller.GetInputPort("stiffness").FixValue(context, times * K.ravel())
        arm.simulator.AdvanceTo(1e-3 * (step + 1))
        rows.append(np.concatenate([arm.read(port) for port in ports]))
    return np.array(rows)


@cache
def raised(form: str, scheme: str = "inner-loop") -> np.ndarray:
    return run(config(form, scheme), 4000.0)


@pytest.mark.parametrize("scheme", ["inner-loop", "direct"])
def test_both_forms_change_their_gains_alike(scheme: str) -> None:
    compiled, blocks = raised("compiled", scheme), raised("blocks", scheme)
    np.testing.assert_allclose(blocks, compiled, atol=1e-9 * np.abs(compiled).max())
    # The tank let some of the change through, and was empty then.
    assert compiled[:20, -1].min() > 0.005
    assert (compiled[20:, -1] == 0.0).any()


@pytest.mark.parametrize("form", FORMS)
def test_with_constant_gains_a_tank_changes_nothing_to_the_bit(form: str) -> None:
    kept, free = run(config(form)), run(config(form, tank=False))
    np.testing.assert_array_equal(kept[:, :-1], free)


def loop_and_pose(made: ImpedanceControllerConfig):
    plant = arm_plant()
    E = plant.GetFrameByName("flange")
    kind = AdmittanceLoop if made.scheme == "admittance" else ControlLoop
    loop = kind(plant, E.model_instance(), E, made)
    return loop, frame_motion_at_rest(pose_at(plant, POSTURES[6]))


@pytest.mark.parametrize("scheme", ["inner-loop", "admittance"])
def test_a_loop_by_hand_asks_for_gains_that_the_tank_lets_through(scheme: str) -> None:
    q, v = POSTURES[6], np.zeros(6)
    made = config("compiled")
    made.scheme = scheme
    made.passivity.gains = TankConfig(cap=50.0)
    loop, still = loop_and_pose(made)
    push = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 20.0])
    loop.reset(q, v, push)
    for _ in range(100):
        loop.step(q, v, push, still)
    level = loop.output("tank")[0]
    loop.change(stiffness=2.0 * np.eye(6))
    loop.step(q, v, push, still)
    # Softer: what the spring gives back is in the tank.
    assert loop.output("tank")[0] > level
    loop.change(stiffness=1e5 * np.eye(6), damping=30.0 * np.eye(6))
    loop.step(q, v, push, still)
    assert loop.output("tank")[0] == 0.0
    loop.change(stiffness=-np.eye(6))
    with pytest.raises(SignalError, match=r"stiffness' got a matrix whose smallest eigenvalue"):
        loop.step(q, v, push, still)


def test_gains_that_may_not_change_are_refused() -> None:
    loop, _ = loop_and_pose(quick_config())
    with pytest.raises(ConfigurationError, match=r"passivity\.gains"):
        loop.change(stiffness=np.eye(6))


def test_natural_inertia_has_no_tank() -> None:
    made = ImpedanceControllerConfig(scheme="direct", inertia="natural")
    made.passivity.gains = TankConfig()
    with pytest.raises(ConfigurationError, match=r"passivity\.gains is given, but natural inertia"):
        loop_and_pose(made)


def test_a_tank_is_checked_with_the_rest() -> None:
    made = config("compiled")
    made.passivity.gains = TankConfig(start=5.0)
    with pytest.raises(
        ConfigurationError, match=r"passivity\.gains\.start is 5 J, more than the 2"
    ):
        loop_and_pose(made)
