"""Gains that change give out no more energy than was stored and is in the tank."""

import numpy as np
import pytest
from impedance_rig import K_O, K_P, M_O, M_P, X_WD
from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput
from signal_sources import Source, fixed_step

from geoimp_drake.compilation.compiled import compiled, is_available
from geoimp_drake.controllers.impedance_config import ImpedanceConfig
from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.laws.impedance.compliant_motion import compliant_motion, frame_state_rate
from geoimp_drake.laws.impedance.families import FAMILIES, make_family
from geoimp_drake.parts.energy_tank import TankConfig
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.impedance_energy import ImpedanceEnergy
from geoimp_drake.parts.part_loop import PartLoop
from geoimp_drake.parts.passive_gains import PassiveGains
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems import passive_gains
from geoimp_drake.systems.frame_motion import VELOCITY, frame_motion_at_rest
from geoimp_drake.systems.impedance_integrator import ImpedanceIntegrator

TICK, SUBSTEPS, TICKS = 2e-3, 4, 7
START = 0.2  # of the tank [J]
needs_numba = pytest.mark.skipif(not is_available(), reason="numba is not installed")


def springs(family: str = "quaternion", axes: str = "desired") -> Impedance:
    rotation = make_family(family, M_O, 5.0 * np.eye(3), K_O)
    return Impedance(M_P, 150.0 * np.eye(3), K_P, rotation, translation_axes=axes)


class Trajectory:
    """C under gains that change at random; what it stores and what the wrench has supplied."""

    def __init__(self, impedance: Impedance, config: TankConfig, rng: np.random.Generator):
        self.impedance, self.rng = impedance, rng
        self._law = compiled(compliant_motion(impedance.rotation.law))
        self._rate = compiled(frame_state_rate)
        self._loop = PartLoop(PassiveGains(impedance, config), "gains")
        self.D = frame_motion_at_rest(X_WD)
        self.C, self.work = self.D[:13].copy(), 0.0
        self.C[4:13] += 0.1 * rng.normal(size=9)
        self.wrench = rng.normal(size=6) * np.repeat([3.0, 40.0], 3)
        self._loop.reset(self._wanted() | {"desired_motion": self.D, "compliant_motion": self.at()})

    def at(self) -> np.ndarray:
        return np.concatenate((self.C, np.zeros(6)))

    def _wanted(self) -> dict[str, np.ndarray]:
        """Any stiffness and any damping, also none in some directions, with couplings."""
        scale = np.repeat([3.0, 20.0], 3)
        gains = {}
        for name, size in (("stiffness", 1.5), ("damping", 0.7)):
            rank = self.rng.integers(1, 7)
            size *= self.rng.uniform(0.0, 2.0)
            root = size * scale[:, None] * self.rng.normal(size=(6, rank))
            gains[name] = (root @ root.T / 3).ravel()
        return gains

    def tick(self) -> float:
        """Moves on; returns what is stored and in the tank, less what was supplied [J]."""
        gains = self.gains()
        h = TICK / SUBSTEPS
        for _ in range(SUBSTEPS):
            s = np.append(self.C, self.work)
            a = self._rates(s, gains)
            b = self._rates(s + h / 2 * a, gains)
            c = self._rates(s + h / 2 * b, gains)
            d = self._rates(s + h * c, gains)
            s = s + h / 6 * (a + 2 * b + 2 * c + d)
            self.C, self.work = s[:13], s[13]
            self.C[:4] /= np.linalg.norm(self.C[:4])
        before = self.stored()
        targets = {"desired_motion": self.D, "compliant_motion": self.at()}
        self._loop.step(self._wanted(), targets, TICK)
        self.injected = self.stored() - before
        return self.balance()

    def gains(self):
        K, D = (self._loop.output(name).copy() for name in ("stiffness", "damping"))
        return self.impedance.changing_gains.of(K, D)

    def _rates(self, s: np.ndarray, gains) -> np.ndarray:
        motion, rates = np.zeros(19), np.empty(14)
        assert self._law(s[:13], self.D, self.wrench, *gains, motion)
        self._rate(motion, rates[:13])
        rates[13] = self.wrench @ (self.D[VELOCITY] - motion[VELOCITY])
        return rates

    def stored(self) -> float:
        energy = self.impedance.energies.evaluate(self.D, self.at(), self.wrench, self.gains())
        view = ImpedanceEnergy(energy)
        kinetic = view.translational_kinetic + view.rotational_kinetic
        potential = view.translational_potential + view.rotational_potential
        return float(kinetic + potential + view.coupling_potential)

    def balance(self) -> float:
        return self.stored() + float(self._loop.output("tank")[0]) - self.work


@needs_numba
def test_a_thousand_random_gains_give_out_no_more_than_was_stored_and_in_the_tank() -> None:
    """To 1e-6 J, between any two ticks; stored and tank are never negative."""
    rng, held_up, gained = np.random.default_rng(0), 0, 0.0
    impedance = springs()
    for _ in range(1000):
        trajectory = Trajectory(impedance, TankConfig(start=START), rng)
        before = trajectory.balance()
        for _ in range(TICKS):
            after = trajectory.tick()
            assert after <= before + 1e-6
            level = float(trajectory._loop.output("tank")[0])
            assert 0.0 <= level <= 2.0
            assert trajectory.stored() >= -1e-9
            held_up += level == 0.0
            gained = max(gained, trajectory.injected)
            before = after
    # It was put to the test: the tank was empty now and then, and it let much energy pass.
    assert held_up > 500
    assert gained > 1.0


@needs_numba
def test_without_a_tank_that_ends_more_would_come_out() -> None:
    """The contrast: an endless tank lets every change take place at once."""
    rng = np.random.default_rng(0)
    endless = TankConfig(start=1e9, cap=1e9)
    impedance = springs()
    injected = []
    for _ in range(50):
        trajectory = Trajectory(impedance, endless, rng)
        for _ in range(TICKS):
            trajectory.tick()
            injected.append(trajectory.injected)
    assert max(injected) > 5.0
    assert sum(np.array(injected) > START) > 50


# A stiffness that is raised while it bears a force.


class Raised:
    """K_p = 700 N/m under 40 N, times five within 0.1 s from 3 s on, with a tank or without."""

    def __init__(self, config: TankConfig | None, times: float = 5.0):
        gains = ImpedanceConfig()
        gains.translation.damping = np.array(160.0)
        springs, builder = gains.make(), DiagramBuilder()
        impedance = builder.AddSystem(ImpedanceIntegrator.of(springs))
        rest = frame_motion_at_rest(RigidTransform())
        factor = (times - 1.0) * 10.0
        signals = {
            "desired_motion": lambda t: rest,
            "measured_motion": lambda t: rest,
            "wrench": lambda t: np.array([0, 0, 0, 0, 0, 40.0]),
            "stiffness_scale": lambda t: np.array([1 + factor * np.clip(t - 3.0, 0, 0.1), 1.0]),
        }
        ports = {name: builder.AddSystem(Source(signal)) for name, signal in signals.items()}
        targets = dict.fromkeys(signals, impedance)
        if config is not None:
            tank = builder.AddSystem(passive_gains.PassiveGains(springs, config))
            targets["stiffness_scale"] = tank
            builder.Connect(
                ports["desired_motion"].get_output_port(), tank.GetInputPort("desired_motion")
            )
            name = "compliant_motion"
            builder.Connect(impedance.GetOutputPort(name), tank.GetInputPort(name))
            for name in ("stiffness", "damping"):
                builder.Connect(tank.GetOutputPort(name), impedance.GetInputPort(name))
            stiffness = LogVectorOutput(tank.GetOutputPort("stiffness"), builder, 1e-3)
        for name, system in targets.items():
            builder.Connect(ports[name].get_output_port(), system.GetInputPort(name))
        logged = [
            LogVectorOutput(impedance.GetOutputPort(name), builder, 1e-3)
            for name in ("energy", "compliant_motion")
        ]
        simulator = fixed_step(builder.Build())
        simulator.AdvanceTo(5.0)
        context = simulator.get_context()
        self.energy, self.C = (log.FindLog(context).data() for log in logged)
        self.t = logged[0].FindLog(context).sample_times()
        if config is not None:
            self.K_z = stiffness.FindLog(context).data()[35]
            self.level = tank.GetOutputPort("tank").Eval(tank.GetMyContextFromRoot(context))[0]

    def given_out(self) -> tuple[float, float]:
        """Returns what was stored as the stiffness began to rise, and the most given out since."""
        k = np.searchsorted(self.t, 3.0 - 1e-9)
        power = self.energy[2, k:]
        work = np.cumsum(0.5 * (power[1:] + power[:-1])) * 1e-3
        return float(self.energy[0, k] + self.energy[1, k]), float(-work.min())


def test_a_stiffness_raised_under_load_is_there_soon_and_gives_out_no_more_than_the_tank_had():
    raised, free = Raised(TankConfig()), Raised(None)
    reached = raised.t[np.flatnonzero(raised.K_z >= 5 * 700.0 * (1 - 1e-12))[0]]
    assert 3.1 < reached < 3.35
    stored, given_out = raised.given_out()
    # Until then damping had put 1.14 J into it.
    assert given_out <= stored + 0.2 + 1.15
    assert given_out > stored + 0.5
    assert free.given_out()[1] > given_out + 0.1


def test_a_small_tank_lets_through_what_it_has_and_no_more() -> None:
    raised = Raised(TankConfig(start=0.05, cap=0.1))
    stored, given_out = raised.given_out()
    assert given_out <= stored + 0.1 + 1e-3
    assert 700.0 < raised.K_z[-1] < 3500.0


def test_while_gains_stay_the_same_nothing_is_changed_to_the_bit() -> None:
    kept, free = Raised(TankConfig(), times=1.0), Raised(None, times=1.0)
    np.testing.assert_array_equal(kept.C, free.C)
    np.testing.assert_array_equal(kept.energy, free.energy)


@pytest.mark.parametrize("family", FAMILIES)
def test_what_a_change_costs_is_the_potential_of_the_family(family: str) -> None:
    """Twice the stiffness takes as much out of the tank as the energy output says is stored."""
    impedance = springs(family)
    D, C = frame_motion_at_rest(X_WD), frame_motion_at_rest(X_WD)
    C[4:7] += [0.01, -0.02, 0.015]
    C[:4] = [np.cos(0.1), *(np.sin(0.1) * np.array([0.6, 0.0, 0.8]))]
    D[:4] = [1.0, 0.0, 0.0, 0.0]
    K, damping = impedance.changing_gains.matrices()
    part = PassiveGains(impedance, TankConfig(start=100.0, cap=100.0))
    loop = PartLoop(part, "gains")
    motions = {"desired_motion": D, "compliant_motion": C}
    loop.reset({"stiffness": K, "damping": damping, **motions})
    loop.step({"stiffness": 2 * K}, motions, 1e-3)
    energy = ImpedanceEnergy(impedance.energies.evaluate(D, C, np.zeros(6), impedance.gains(None)))
    stored = energy.translational_potential + energy.rotational_potential
    assert stored > 0.1
    assert 100.0 - loop.output("tank")[0] == pytest.approx(stored, rel=1e-9)
    np.testing.assert_array_equal(loop.output("stiffness"), 2 * K)


def test_a_stiffness_that_falls_fills_the_tank() -> None:
    impedance = springs()
    D, C = frame_motion_at_rest(X_WD), frame_motion_at_rest(X_WD)
    C[4:7] += [0.01, -0.02, 0.015]
    loop = PartLoop(PassiveGains(impedance, TankConfig()), "gains")
    motions = {"desired_motion": D, "compliant_motion": C}
    K, damping = impedance.changing_gains.matrices()
    loop.reset({"stiffness": K, "damping": damping, **motions})
    loop.step({"stiffness": 0.5 * K}, motions, 1e-3)
    d = X_WD.rotation().inverse() @ (D[4:7] - C[4:7])
    assert loop.output("tank")[0] == pytest.approx(0.2 + 0.25 * d @ K_P @ d)


@needs_numba
def test_a_coupled_damping_takes_its_power_from_both_parts() -> None:
    """Energies of a C that slows down by the whole of D balance, and D is not its blocks."""
    trajectory = Trajectory(springs(), TankConfig(), np.random.default_rng(3))
    K, damping = (gain.reshape(6, 6) for gain in trajectory.impedance.changing_gains.matrices())
    D = damping.copy()
    D[:3, 3:] = [[10.0, 5.0, 0.0], [-4.0, 8.0, 3.0], [0.0, 2.0, 6.0]]
    D[3:, :3] = D[:3, 3:].T
    gains = trajectory.impedance.changing_gains.of(K.ravel(), D.ravel())
    C = trajectory.at()
    power = ImpedanceEnergy(
        trajectory.impedance.energies.evaluate(trajectory.D, C, np.zeros(6), gains)
    )
    R_WC, R_WD = (quaternion.to_rotation(motion[:4]) for motion in (C, trajectory.D))
    V = np.concatenate((-R_WC.T @ C[7:10], -R_WD.T @ C[10:13]))
    dissipated = power.translational_dissipated_power + power.rotational_dissipated_power
    assert dissipated == pytest.approx(V @ D @ V)
    assert abs(V @ D @ V - V @ damping @ V) > 0.1
    # What is accelerated less has that power less.
    motions = np.zeros((2, 19))
    plain = trajectory.impedance.changing_gains.of(K.ravel(), damping.ravel())
    for motion, given in zip(motions, (gains, plain), strict=True):
        assert trajectory._law(C[:13], trajectory.D, np.zeros(6), *given, motion)
    less = motions[0][13:19] - motions[1][13:19]
    lost = C[7:10] @ R_WC @ M_O @ R_WC.T @ less[:3] + C[10:13] @ R_WD @ M_P @ R_WD.T @ less[3:]
    assert lost == pytest.approx(V @ damping @ V - V @ D @ V)


# What is refused.


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"start": 3.0}, r"tank\.start is 3 J, more than the 2 J of tank\.cap"),
        ({"cap": 0.0}, r"tank\.cap is 0 J"),
        ({"start": -1.0}, r"tank\.start is -1 J"),
    ],
)
def test_a_tank_that_cannot_be_is_refused(fields, message) -> None:
    with pytest.raises(ConfigurationError, match=message):
        PassiveGains(springs(), TankConfig(**fields))


COUPLED = np.block([[np.eye(3), 0.1 * np.eye(3)], [0.1 * np.eye(3), np.eye(3)]])
INDEFINITE = np.diag([1.0, 1.0, 1.0, 1.0, -2.5, 1.0])


@pytest.mark.parametrize("port", ["stiffness", "damping"])
@pytest.mark.parametrize(
    ("matrix", "family", "axes", "message"),
    [
        (INDEFINITE, "quaternion", "desired", r"smallest eigenvalue is -2\.5"),
        (np.eye(6) + np.eye(6, k=1), "quaternion", "desired", r"mirror image by 1; give K = Kᵀ"),
        (np.full((6, 6), np.nan), "quaternion", "desired", r"must be finite"),
        (COUPLED, "angle-axis-sin", "desired", r"family 'quaternion'"),
    ],
)
def test_a_matrix_that_is_no_gain_is_refused(port, matrix, family, axes, message) -> None:
    impedance = ImpedanceIntegrator.of(springs(family, axes))
    context = impedance.CreateDefaultContext()
    rest = frame_motion_at_rest(X_WD)
    for name, value in (("desired_motion", rest), ("measured_motion", rest), ("wrench", [0] * 6)):
        impedance.GetInputPort(name).FixValue(context, value)
    impedance.GetInputPort(port).FixValue(context, matrix.ravel())
    with pytest.raises(SignalError, match=rf"{port}.*{message}"):
        impedance.GetOutputPort("compliant_motion").Eval(context)


def test_a_coupling_of_a_stiffness_in_w_is_refused() -> None:
    impedance = PassiveGains(springs(axes="world"))
    rest = frame_motion_at_rest(X_WD)
    inputs = {"desired_motion": rest, "compliant_motion": rest, "stiffness": COUPLED.ravel()}
    with pytest.raises(SignalError, match=r"gains:stiffness.*translation\.axes: desired"):
        PartLoop(impedance, "gains").reset(inputs)
