"""The impedance as the closed loop of E itself, with its own mass or with the arm's."""

from collections.abc import Iterator

import numpy as np
import pytest
from arms import make_arm_plant

from geoimp_drake.arm.state import ArmState, evaluate_arm
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.controllers.impedance_controller import make_impedance_controller
from geoimp_drake.controllers.wrist_sensor import wrist_sensor_at
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.frame_motion import ACCELERATION, POSITION, QUATERNION, VELOCITY
from geoimp_drake.parts.wrist_sensor_config import WristSensorConfig
from geoimp_drake.rotations import quaternion

K_p, K_o = np.diag([400.0, 900.0, 1500.0]), np.diag([4.0, 10.0, 2.5])
K_c = np.array([[0.0, 8.0, -3.0], [5.0, 0.0, 2.0], [-6.0, 1.0, 0.0]])
SMALL = 1e-5  # of a displacement [rad, m]


def loop_of(
    joints: int,
    inertia: str | None,
    coupling: np.ndarray | None = None,
    zeta: float | None = None,
) -> ControlLoop:
    rig = make_arm_plant(joints=joints)
    config = ImpedanceControllerConfig(scheme="direct", inertia=inertia, limits=None)
    config.damping_ratio = zeta
    config.impedance.translation.stiffness, config.impedance.rotation.stiffness = K_p, K_o
    config.impedance.coupling = coupling
    return ControlLoop(rig.plant, rig.arm, rig.E, config)


def postures(loop: ControlLoop, count: int) -> Iterator[ArmState]:
    """Yields states at rest away from singularities."""
    random, n = np.random.default_rng(7), loop.model.num_joints
    scratch = loop.model.plant.CreateDefaultContext()
    while count:
        x = np.concatenate((random.uniform(-2.0, 2.0, n), np.zeros(n)))
        arm = evaluate_arm(loop.model, scratch, x)
        if np.linalg.svd(arm.Jv_V_WE, compute_uv=False)[-1] > 0.05:
            count -= 1
            yield arm


def at(arm: ArmState) -> np.ndarray:
    """Returns E's pose as a motion of D at rest."""
    D = np.zeros(19)
    D[QUATERNION], D[POSITION] = arm.Q_WE, arm.p_WE
    return D


@pytest.mark.parametrize("joints", [6, 7])
@pytest.mark.parametrize("inertia", [None, "natural"], ids=["desired", "natural"])
def test_at_rest_the_hand_bears_the_springs_wrench_on_each_axis(joints, inertia):
    """An arm under h = KΔ, with D displaced along an axis, is asked for no acceleration."""
    loop, K = loop_of(joints, inertia), np.block([[K_o, 0 * K_p], [0 * K_p, K_p]])
    for arm in postures(loop, 20):
        for axis in range(6):
            step, D = SMALL * np.eye(6)[axis], at(arm)
            turn = quaternion.from_rotation(arm.R_WE @ _small_rotation(step[:3]))
            D[QUATERNION], D[POSITION] = turn, arm.p_WE + step[3:]
            h = K @ step
            h[:3] = arm.R_WE @ h[:3]  # K_o is in E
            torque = loop.reset(arm.q, arm.v, h, D) - arm.g
            found = np.linalg.lstsq(arm.Jv_V_WE.T, torque, rcond=None)[0]
            np.testing.assert_allclose(found, h, rtol=0, atol=0.01 * np.abs(h).max())


@pytest.mark.parametrize("joints", [6, 7])
def test_the_acceleration_is_that_of_the_law_as_printed(joints):
    """(3.1) and (3.30) hold for what E is asked for, in motion and under a wrench."""
    loop, random = loop_of(joints, None), np.random.default_rng(joints)
    (M_o, D_o, _), (M_p, D_p, _) = map(loop.config.impedance.gains, ("rotation", "translation"))
    for arm in postures(loop, 20):
        D, h, v = at(arm), random.normal(size=6), random.normal(size=joints)
        D[QUATERNION] = quaternion.from_rotation(
            arm.R_WE @ quaternion.to_rotation(quaternion.exp(random.normal(size=3)))
        )
        D[POSITION.start :] += 0.3 * random.normal(size=15)
        loop.reset(arm.q, v, h, D)
        a, V_WE = (loop.output("compliant_motion")[part] for part in (ACCELERATION, VELOCITY))
        np.testing.assert_allclose(V_WE, arm.Jv_V_WE @ v, rtol=0, atol=1e-9)
        da, dV = D[ACCELERATION] - a, D[VELOCITY] - V_WE
        force = M_p @ da[3:] + D_p @ dV[3:] + K_p @ (D[POSITION] - arm.p_WE)
        np.testing.assert_allclose(force, h[3:], rtol=0, atol=1e-9)
        Q_ED, R_EW = quaternion.relative(arm.Q_WE, D[QUATERNION]), arm.R_WE.T
        dw_rate = R_EW @ (da[:3] - np.cross(V_WE[:3], dV[:3]))  # of Δᶜω_dc, in C
        moment = M_o @ dw_rate + D_o @ R_EW @ dV[:3] + 2.0 * quaternion.E(Q_ED).T @ K_o @ Q_ED[1:]
        np.testing.assert_allclose(moment, R_EW @ h[:3], rtol=0, atol=1e-9)


def _small_rotation(angles: np.ndarray) -> np.ndarray:
    x, y, z = angles
    return np.eye(3) + np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


@pytest.mark.parametrize("coupling", [None, K_c], ids=["block", "coupled"])
@pytest.mark.parametrize("zeta", [0.4, 1.0])
def test_every_mode_has_the_damping_ratio_that_was_asked_for(zeta, coupling):
    """Poles of what the controller asks for where D is displaced a little, or moves."""
    loop = loop_of(7, "natural", coupling, zeta)
    for arm in postures(loop, 100):
        poles = np.linalg.eigvals(
            np.block([[np.zeros((6, 6)), np.eye(6)], [-x for x in asked(loop, arm)]])
        )
        np.testing.assert_allclose(-poles.real / np.abs(poles), zeta, rtol=0, atol=0.05)


def asked(loop: ControlLoop, arm: ArmState) -> tuple[np.ndarray, np.ndarray]:
    """Returns the acceleration of E that a displacement, and a velocity, of D asks for (6, 6)."""
    columns: tuple[list, list] = [], []
    for step in SMALL * np.eye(6):
        D = at(arm)
        D[QUATERNION] = quaternion.from_rotation(_small_rotation(step[:3]) @ arm.R_WE)
        D[POSITION] += step[3:]
        moving = at(arm)
        moving[VELOCITY] = step
        for column, desired in zip(columns, (D, moving), strict=True):
            loop.reset(arm.q, arm.v, None, desired)
            column.append(loop.output("compliant_motion")[ACCELERATION] / SMALL)
    return np.column_stack(columns[0]), np.column_stack(columns[1])


def test_the_springs_do_no_work_round_a_closed_loop_of_orientations():
    """The arm turns its hand round both ways; a law of its kind that is none gives out joules."""
    loop = loop_of(6, "natural")
    (first,) = postures(loop, 1)
    scratch, D = loop.model.plant.CreateDefaultContext(), at(first)
    rest = evaluate_arm(loop.model, scratch, np.concatenate((first.q, np.zeros(6))))
    spring, contrast = [], []
    for t in np.linspace(0.0, 2.0 * np.pi, 2000, endpoint=False):
        q = rest.q.copy()
        q[3:] += 0.6 * np.array([np.sin(t), np.cos(t) - 1.0, np.sin(2.0 * t + 0.3)])
        v = np.zeros(6)
        v[3:] = 0.6 * np.array([np.cos(t), -np.sin(t), 2.0 * np.cos(2.0 * t + 0.3)])
        arm = evaluate_arm(loop.model, scratch, np.concatenate((q, v)))
        # What is asked for beside damping, as a wrench: Λ(a - Λ⁻¹DΔv).
        loop.reset(q, np.zeros(6), None, D)
        a = loop.output("compliant_motion")[ACCELERATION]
        wrench = np.linalg.solve(arm.Jv_V_WE @ np.linalg.solve(arm.B, arm.Jv_V_WE.T), a)
        spring.append(wrench @ arm.V_WE)
        error = quaternion.relative(arm.Q_WE, D[QUATERNION])[1:]
        moment = np.concatenate((arm.R_WE @ (2.0 * K_o @ error), wrench[3:]))
        contrast.append(moment @ arm.V_WE)
    step = 2.0 * np.pi / 2000
    assert abs(np.sum(spring)) <= 1e-6 * np.sum(np.abs(spring))
    assert abs(np.sum(contrast) * step) > 0.05


def test_a_tools_load_is_not_removed_for_an_acceleration_that_a_contact_takes_away():
    rig = make_arm_plant()
    config = ImpedanceControllerConfig(scheme="direct", inertia="natural")
    for load in ("plant", "reference"):
        sensor = wrist_sensor_at(rig.plant, rig.wrist, rig.E, WristSensorConfig(inertial_load=load))
        if load == "plant":
            make_impedance_controller(rig.plant, rig.arm, rig.E, config, sensor=sensor)
            continue
        with pytest.raises(ConfigurationError, match=r"inertial_load is 'reference'.*plant"):
            make_impedance_controller(rig.plant, rig.arm, rig.E, config, sensor=sensor)


@pytest.mark.parametrize("form", ["blocks", "compiled"])
@pytest.mark.parametrize(
    ("scheme", "load", "warnings"),
    [("direct", "reference", 1), ("direct", "plant", 0), ("inner-loop", "reference", 0)],
)
def test_a_load_removed_for_the_acceleration_of_the_law_is_warned_of(
    caplog, form, scheme, load, warnings
):
    rig = make_arm_plant()
    config = ImpedanceControllerConfig(scheme=scheme, form=form)
    sensor = wrist_sensor_at(rig.plant, rig.wrist, rig.E, WristSensorConfig(inertial_load=load))
    caplog.clear()
    with caplog.at_level("WARNING", logger="drake"):
        make_impedance_controller(rig.plant, rig.arm, rig.E, config, sensor=sensor)
    said = [record.message for record in caplog.records if "the law asks of E" in record.message]
    assert len(said) == warnings
