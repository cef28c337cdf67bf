"""The impedance as a system: its equilibrium, its energy balance, its start and its errors."""

import numpy as np
import pytest
from impedance_rig import (
    D_O,
    D_P,
    K_O,
    K_P,
    M_O,
    M_P,
    X_WD,
    at_rest,
    constant,
    fixed_step,
    impedance_diagram,
    make_impedance,
)
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.systems.analysis import Simulator

from geoimp_drake.errors import ConfigurationError, OutOfDomainError, SignalError
from geoimp_drake.laws.impedance.families import FAMILIES, make_family
from geoimp_drake.parts.impedance_energy import ImpedanceEnergy
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.frame_motion import (
    ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
    VELOCITY,
    frame_motion_at_rest,
)
from geoimp_drake.systems.impedance_integrator import ImpedanceIntegrator
from geoimp_drake.systems.sources.desired_motion import DesiredMotion, MotionSegment

WRENCH = np.array([0.8, -1.2, 0.5, 20.0, -35.0, 15.0])
MOVES = [MotionSegment(1.0, np.array([0.2, -0.1, 0.15]), np.array([0.5, -0.9, 0.7]))]
TWISTED = RigidTransform(RollPitchYaw(2.3, 0.1, -0.7), [0.85, 0.13, 0.72])
DOMAIN = r"increases only below 90°"
PORTS = ("desired_motion", "wrench", "measured_motion")


def read(impedance: ImpedanceIntegrator, simulator: Simulator, port: str) -> np.ndarray:
    context = impedance.GetMyContextFromRoot(simulator.get_context())
    return impedance.GetOutputPort(port).Eval(context).copy()


def run(impedance, desired, wrench, duration: float, X_WE=X_WD) -> Simulator:
    simulator = fixed_step(impedance_diagram(impedance, desired, wrench, X_WE))
    simulator.AdvanceTo(duration)
    return simulator


def energies(family: str, times: np.ndarray) -> np.ndarray:
    """Returns the energy port along a motion of D under a changing wrench: times × parts × 4."""
    impedance = make_impedance(family)

    def wrench(t: float) -> np.ndarray:
        return WRENCH * np.sin(3.0 * t + np.arange(6))

    diagram = impedance_diagram(impedance, DesiredMotion(X_WD, MOVES), wrench)
    simulator = fixed_step(diagram, 5e-4)
    rows = []
    for time in times:
        simulator.AdvanceTo(time)
        rows.append(read(impedance, simulator, "energy")[:8].reshape(2, 4))
    return np.array(rows)


def balance_error(energy: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Returns, for both parts, how far d(energy)/dt is from the powers, over the power's peak."""
    stored = energy[:, :, 0] + energy[:, :, 1]
    power = energy[:, :, 2] - energy[:, :, 3]
    rate = (stored[2:] - stored[:-2]) / (times[2:] - times[:-2])[:, None]
    return np.abs(rate - power[1:-1]).max(axis=0) / np.abs(energy[:, :, 2:]).max(axis=(0, 2))


def test_at_rest_the_wrench_is_stiffness_times_displacement() -> None:
    impedance = make_impedance()
    simulator = run(impedance, at_rest(X_WD), constant(WRENCH), 6.0)
    displacement = read(impedance, simulator, "displacement")
    C = read(impedance, simulator, "compliant_motion")
    np.testing.assert_allclose(K_P @ displacement[3:], WRENCH[3:], rtol=1e-6)
    # (3.31) written out: the moment in C is 2 (ηI + S(ε)) K_o ε.
    Q_CD = quaternion.relative(C[QUATERNION], frame_motion_at_rest(X_WD)[QUATERNION])
    epsilon = displacement[:3]
    np.testing.assert_allclose(epsilon, Q_CD[1:], atol=1e-12)
    moment_C = 2 * (Q_CD[0] * K_O @ epsilon + np.cross(epsilon, K_O @ epsilon))
    R_WC = quaternion.to_rotation(C[QUATERNION])
    np.testing.assert_allclose(R_WC @ moment_C, WRENCH[:3], rtol=1e-6, atol=1e-6)
    assert np.abs(C[VELOCITY]).max() < 1e-6
    assert np.linalg.norm(epsilon) > 0.02


def test_force_on_the_environment_leaves_C_behind_D() -> None:
    impedance = make_impedance()
    simulator = run(impedance, at_rest(X_WD), constant([0, 0, 0, 0, 0, -50.0]), 4.0)
    # Pressing down on something holds C above D.
    C = read(impedance, simulator, "compliant_motion")
    assert C[POSITION][2] > X_WD.translation()[2] + 0.05


@pytest.mark.parametrize("family", FAMILIES)
def test_stored_energy_changes_by_supplied_less_dissipated_power(family: str) -> None:
    times = np.arange(0.0, 0.4, 2e-3)
    energy = energies(family, times)
    assert (np.abs(energy).max(axis=0) > 1e-3).all()
    assert (balance_error(energy, times) < 3e-3).all()


@pytest.mark.parametrize("column", range(4))
def test_power_balance_tells_an_energy_or_power_that_is_five_percent_wrong(column: int) -> None:
    times = np.arange(0.0, 0.4, 2e-3)
    energy = energies("quaternion", times)
    energy[:, :, column] *= 1.05
    assert (balance_error(energy, times) > 3e-3).all()


def test_energies_and_powers_are_those_of_the_state() -> None:
    impedance = make_impedance()
    simulator = run(impedance, DesiredMotion(X_WD, MOVES), constant(WRENCH), 0.4)
    C = read(impedance, simulator, "compliant_motion")
    D = DesiredMotion(X_WD, MOVES).evaluate(0.4)
    dp, dv = D[POSITION] - C[POSITION], D[LINEAR_VELOCITY] - C[LINEAR_VELOCITY]
    R_WC = quaternion.to_rotation(C[QUATERNION])
    dw = R_WC.T @ (D[ANGULAR_VELOCITY] - C[ANGULAR_VELOCITY])
    epsilon = quaternion.relative(C[QUATERNION], D[QUATERNION])[1:]
    energy = ImpedanceEnergy(read(impedance, simulator, "energy"))
    assert energy.translational_kinetic == pytest.approx(0.5 * dv @ M_P @ dv)
    assert energy.translational_potential == pytest.approx(0.5 * dp @ K_P @ dp)
    assert energy.translational_supplied_power == pytest.approx(WRENCH[3:] @ dv)
    assert energy.translational_dissipated_power == pytest.approx(dv @ D_P @ dv)
    assert energy.rotational_potential == pytest.approx(2 * epsilon @ K_O @ epsilon)
    assert energy.rotational_supplied_power == pytest.approx(R_WC.T @ WRENCH[:3] @ dw)
    assert energy.rotational_dissipated_power == pytest.approx(dw @ D_O @ dw)
    assert energy.rotational_kinetic > 0


def test_motion_of_C_is_consistent_with_its_own_derivatives() -> None:
    impedance = make_impedance()
    simulator = fixed_step(
        impedance_diagram(impedance, DesiredMotion(X_WD, MOVES), constant(WRENCH)), 1e-4
    )
    simulator.Initialize()
    rows = []
    for time in np.arange(0.3, 0.3031, 1e-3):
        simulator.AdvanceTo(time)
        rows.append(read(impedance, simulator, "compliant_motion"))
    before, now, after = rows[:3]
    np.testing.assert_allclose((after - before)[POSITION] / 2e-3, now[LINEAR_VELOCITY], atol=1e-4)
    np.testing.assert_allclose((after - before)[VELOCITY] / 2e-3, now[ACCELERATION], atol=2e-3)
    turn = quaternion.product(after[QUATERNION], quaternion.conjugate(before[QUATERNION]))
    np.testing.assert_allclose(quaternion.log(turn) / 2e-3, now[ANGULAR_VELOCITY], atol=1e-4)
    assert np.abs(now[VELOCITY]).max() > 0.1


@pytest.mark.parametrize("initialized", [False, True])
def test_C_starts_at_rest_on_the_measured_pose_of_E(initialized: bool) -> None:
    impedance = make_impedance()
    simulator = fixed_step(impedance_diagram(impedance, at_rest(X_WD), constant(WRENCH), TWISTED))
    if initialized:
        simulator.Initialize()
    C = read(impedance, simulator, "compliant_motion")
    np.testing.assert_allclose(C[:13], frame_motion_at_rest(TWISTED)[:13], atol=1e-14)


def test_C_starts_at_rest_though_E_moves() -> None:
    impedance = make_impedance()
    context = impedance.CreateDefaultContext()
    measured = frame_motion_at_rest(TWISTED)
    measured[VELOCITY] = np.arange(1.0, 7.0)
    fix(impedance, context, measured_motion=measured)
    simulator = Simulator(impedance, context)
    simulator.Initialize()
    C = impedance.GetOutputPort("compliant_motion").Eval(context)
    np.testing.assert_array_equal(C[VELOCITY], np.zeros(6))


def test_another_initialization_puts_C_back_on_E() -> None:
    impedance = make_impedance()
    simulator = run(impedance, at_rest(X_WD), constant(WRENCH), 0.5, TWISTED)
    moved = read(impedance, simulator, "compliant_motion")
    simulator.Initialize()
    C = read(impedance, simulator, "compliant_motion")
    assert np.abs(moved - C)[:7].max() > 1e-3
    np.testing.assert_allclose(C[:13], frame_motion_at_rest(TWISTED)[:13], atol=1e-14)


def test_impedance_closes_the_gap_to_a_D_elsewhere() -> None:
    impedance = make_impedance()
    simulator = run(impedance, at_rest(X_WD), constant(np.zeros(6)), 6.0, TWISTED)
    displacement = read(impedance, simulator, "displacement")
    assert np.abs(displacement).max() < 1e-6


@pytest.mark.parametrize(
    ("axes", "free", "stiff"),
    [
        ("translation", [POSITION, LINEAR_VELOCITY], [QUATERNION, ANGULAR_VELOCITY]),
        ("rotation", [QUATERNION, ANGULAR_VELOCITY], [POSITION, LINEAR_VELOCITY]),
    ],
)
def test_part_without_impedance_is_D_and_the_other_part_as_with_both(axes, free, stiff) -> None:
    moving = DesiredMotion(X_WD, MOVES)
    part, both = make_impedance(axes=axes), make_impedance()
    C = read(part, run(part, moving, constant(WRENCH), 0.5), "compliant_motion")
    full = read(
        both, run(both, DesiredMotion(X_WD, MOVES), constant(WRENCH), 0.5), "compliant_motion"
    )
    D = moving.evaluate(0.5)
    for entries in stiff:
        np.testing.assert_array_equal(C[entries], D[entries])
        assert np.abs(full[entries] - D[entries]).max() > 1e-3
    for entries in free:
        np.testing.assert_allclose(C[entries], full[entries], atol=1e-12)
        assert np.abs(C[entries] - D[entries]).max() > 1e-3


def test_with_impedance_on_nothing_C_is_D_whatever_the_wrench() -> None:
    moving = DesiredMotion(X_WD, MOVES)
    part = make_impedance(axes="none")
    C = read(part, run(part, moving, constant(WRENCH), 0.5), "compliant_motion")
    np.testing.assert_array_equal(C, moving.evaluate(0.5))


def test_displacement_is_zero_without_impedance() -> None:
    part = make_impedance(axes="rotation")
    simulator = run(part, at_rest(X_WD), constant(WRENCH), 0.5)
    np.testing.assert_array_equal(read(part, simulator, "displacement")[3:], np.zeros(3))
    assert np.abs(read(part, simulator, "displacement")[:3]).max() > 1e-3


# What arrives at the ports.


def fix(impedance: ImpedanceIntegrator, context, **values) -> None:
    good = {
        "desired_motion": frame_motion_at_rest(X_WD),
        "wrench": WRENCH,
        "measured_motion": frame_motion_at_rest(X_WD),
    }
    for port, value in {**good, **values}.items():
        impedance.GetInputPort(port).FixValue(context, value)


def corrupted(port: str, index: int, value: float) -> np.ndarray:
    signal = WRENCH.copy() if port == "wrench" else frame_motion_at_rest(X_WD)
    signal[index] = value
    return signal


@pytest.mark.parametrize("port", PORTS)
@pytest.mark.parametrize(("index", "bad"), [(0, np.nan), (5, np.inf), (5, -np.inf)])
def test_a_value_that_is_not_finite_is_refused_by_port_and_number(port, index, bad) -> None:
    impedance = make_impedance()
    context = impedance.CreateDefaultContext()
    fix(impedance, context, **{port: corrupted(port, index, bad)})
    with pytest.raises(SignalError, match=rf"impedance:{port}.*{index}: {bad}"):
        impedance.GetOutputPort("compliant_motion").Eval(context)
    with pytest.raises(SignalError, match=rf"impedance:{port}.*{index}: {bad}"):
        Simulator(impedance, context).AdvanceTo(0.01)


@pytest.mark.parametrize("port", ["desired_motion", "measured_motion"])
@pytest.mark.parametrize("factor", [0.999, 1.001, 0.0])
def test_a_quaternion_that_is_not_unit_is_refused_with_its_norm(port, factor) -> None:
    impedance = make_impedance()
    context = impedance.CreateDefaultContext()
    motion = frame_motion_at_rest(X_WD)
    motion[QUATERNION] *= factor
    fix(impedance, context, **{port: motion})
    with pytest.raises(SignalError, match=rf"impedance:{port}.*norm is {factor:g}"):
        impedance.GetOutputPort("compliant_motion").Eval(context)


def test_a_wrench_that_breaks_down_on_the_way_stops_the_simulation_by_name() -> None:
    impedance = make_impedance()

    def breaking(t: float) -> np.ndarray:
        return WRENCH if t < 0.05 else np.full(6, np.nan)

    simulator = fixed_step(impedance_diagram(impedance, at_rest(X_WD), breaking))
    with pytest.raises(SignalError, match=r"impedance:wrench"):
        simulator.AdvanceTo(0.1)
    assert simulator.get_context().get_time() == pytest.approx(0.05, abs=2e-3)


def test_a_spike_of_the_wrench_is_named_and_not_the_step_size() -> None:
    impedance = make_impedance()

    def spike(t: float) -> np.ndarray:
        return np.array([0.0, 0.0, 0.0, 5.0, -1e9, 0.0]) if 0.05 <= t < 0.051 else np.zeros(6)

    simulator = fixed_step(impedance_diagram(impedance, at_rest(X_WD), spike))
    with pytest.raises(SignalError, match=r"impedance:wrench' got -1e\+09 N \(index 4\)") as error:
        simulator.AdvanceTo(0.2)
    assert "step" not in str(error.value)
    assert simulator.get_context().get_time() == pytest.approx(0.05, abs=2e-3)


def test_a_start_outside_the_familys_domain_is_refused() -> None:
    impedance = make_impedance("angle-axis-sin")
    turned = RigidTransform(RotationMatrix.MakeZRotation(2.0)) @ X_WD
    simulator = fixed_step(impedance_diagram(impedance, at_rest(X_WD), constant(WRENCH), turned))
    with pytest.raises(OutOfDomainError, match=DOMAIN):
        simulator.Initialize()


def test_a_moment_that_turns_C_out_of_the_familys_domain_stops_the_simulation() -> None:
    impedance = make_impedance("angle-axis-sin")
    simulator = fixed_step(
        impedance_diagram(impedance, at_rest(X_WD), constant([0, 0, 40.0, 0, 0, 0]))
    )
    with pytest.raises(OutOfDomainError, match=DOMAIN):
        simulator.AdvanceTo(3.0)
    assert simulator.get_context().get_time() > 0.05


@pytest.mark.parametrize("name", ["M_p", "D_p", "K_p"])
def test_a_gain_that_is_not_positive_definite_is_refused_by_name(name: str) -> None:
    gains = {"M_p": M_P, "D_p": D_P, "K_p": K_P}
    gains[name] = np.diag([1.0, -2.5, 3.0])
    with pytest.raises(ConfigurationError, match=rf"{name} is not positive definite.*-2\.5"):
        ImpedanceIntegrator(**gains, rotation=make_family("quaternion", K_O, K_O, K_O))


def test_unknown_axes_are_refused_with_the_valid_ones() -> None:
    with pytest.raises(ConfigurationError, match=r"'rotations'.*'rotation'.*both"):
        make_impedance(axes="rotations")


def test_motion_has_nineteen_entries_in_every_part_of_the_state() -> None:
    impedance = make_impedance()
    assert impedance.CreateDefaultContext().num_continuous_states() == ACCELERATION.start
    assert impedance.GetOutputPort("compliant_motion").size() == FRAME_MOTION_SIZE


# A stiffness that is changed on the way.

FACTORS = (2.0, 0.5)


@pytest.mark.parametrize("family", ["quaternion", "alternative-euler"])
@pytest.mark.parametrize("port", ["compliant_motion", "energy"])
def test_a_scaled_stiffness_is_that_of_scaled_gains(family: str, port: str) -> None:
    p, o = FACTORS
    given = ImpedanceIntegrator(M_P, D_P, p * K_P, make_family(family, M_O, D_O, o * K_O))
    scaled = make_impedance(family)
    values = []
    for impedance, inputs in ((given, {}), (scaled, {"stiffness_scale": FACTORS})):
        context = impedance.CreateDefaultContext()
        fix(impedance, context, measured_motion=frame_motion_at_rest(TWISTED), **inputs)
        values.append(impedance.GetOutputPort(port).Eval(context).copy())
    np.testing.assert_allclose(values[1], values[0], atol=1e-12)


@pytest.mark.parametrize("factors", [(0.0, 1.0), (1.0, -2.0), (np.nan, 1.0), (np.inf, 1.0)])
def test_a_factor_of_the_stiffness_that_is_not_positive_is_refused(factors) -> None:
    impedance = make_impedance()
    context = impedance.CreateDefaultContext()
    fix(impedance, context, stiffness_scale=factors)
    with pytest.raises(SignalError, match=r"stiffness_scale.*must be positive"):
        impedance.GetOutputPort("compliant_motion").Eval(context)


def test_factors_that_make_a_coupled_stiffness_indefinite_are_refused() -> None:
    coupling = 0.7 * np.sqrt(K_P[0, 0] * K_O[0, 0]) * np.eye(3)[:1].T @ np.eye(3)[:1]
    impedance = ImpedanceIntegrator(
        M_P, D_P, K_P, make_family("quaternion", M_O, D_O, K_O), K_c=coupling
    )
    context = impedance.CreateDefaultContext()
    fix(impedance, context, stiffness_scale=(0.9, 0.95))
    impedance.GetOutputPort("compliant_motion").Eval(context)
    fix(impedance, context, stiffness_scale=(0.6, 0.6))
    with pytest.raises(SignalError, match=r"stiffness_scale.*smallest eigenvalue is -"):
        impedance.GetOutputPort("compliant_motion").Eval(context)
