"""The audit of an impedance's energy from a log: what it says, and that it balances."""

import numpy as np
import pytest
from runs import run

from geoimp_drake.parts.impedance_energy import ImpedanceEnergy
from geoimp_drake.simulation.energy_audit import audit_figure, audit_of, audited

QUICK = "segments=[{duration: 2.0, displacement: [0.0, 0.0, -0.24]}, {duration: 1.5}]"
T = np.linspace(0.0, 4.0, 401)


def pulled(mass: float = 2.0, damping: float = 3.0, stiffness: float = 20.0) -> dict:
    """A log of C that swings freely along x about a D at rest, without a wrench; exact."""
    poles = np.roots([mass, damping, stiffness])
    A, B = np.linalg.solve([[1.0, 1.0], poles], [0.1, 0.0])
    x = np.real(A * np.exp(poles[0] * T) + B * np.exp(poles[1] * T))
    v = np.real(A * poles[0] * np.exp(poles[0] * T) + B * poles[1] * np.exp(poles[1] * T))
    energy, C = np.zeros((len(T), 9)), np.zeros((len(T), 19))
    view = ImpedanceEnergy(energy.T)
    view.translational_kinetic, view.translational_potential = mass * v**2 / 2, stiffness * x**2 / 2
    view.translational_dissipated_power = damping * v**2
    C[:, 10] = v
    return {"t": T, "arm/energy": energy, "arm/motion_C": C, "arm/wrench": np.zeros((len(T), 6))}


def test_what_was_stored_is_dissipated() -> None:
    audit = audit_of(pulled(), "arm")
    assert audit.stored[0] == pytest.approx(0.5 * 20.0 * 0.1**2)
    assert audit.dissipated[-1] == pytest.approx(audit.stored[0] - audit.stored[-1], rel=1e-3)
    assert audit.relative_error < 1e-3
    np.testing.assert_array_equal(audit.given_out, 0.0)


@pytest.mark.parametrize("column", ["translational_kinetic", "translational_dissipated_power"])
def test_an_energy_that_is_five_percent_wrong_is_in_the_error(column: str) -> None:
    log = pulled()
    log["arm/energy"][:, ImpedanceEnergy.get_fields().index(column)] *= 1.05
    assert audit_of(log, "arm").relative_error > 0.02


def test_what_D_brings_in_is_given_out_where_C_follows_it() -> None:
    """A force on a C that moves with D does the same work on both."""
    log = pulled()
    log["arm/energy"][:], log["arm/wrench"][:, 3] = 0.0, 10.0
    log["arm/motion_C"][:, 10] = 0.2
    audit = audit_of(log, "arm")
    assert audit.given_out[-1] == pytest.approx(10.0 * 0.2 * T[-1])
    np.testing.assert_array_equal(audit.energy_in, audit.given_out)


def test_a_pressed_hand_balances_and_has_its_figure() -> None:
    log, _, _ = run("plexiglas", QUICK, "form=compiled")
    assert audited(log) == ["six"]
    audit = audit_of(log, "six")
    assert audit.relative_error < 2e-3
    assert audit.energy_in[-1] > audit.dissipated[-1] > audit.stored[-1] > 0.1
    _, right = audit_figure(log).axes
    assert right.get_title() == f"balance error, at most {100 * audit.relative_error:.2g} %"


def test_a_log_whose_energies_are_not_known_has_no_audit() -> None:
    log = pulled()
    log["arm/energy"][3, 2] = np.nan
    assert audited(log) == []
