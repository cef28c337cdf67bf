"""The energy balance of an impedance, from the log of a run."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from geoimp_drake.parts.impedance_energy import (
    ImpedanceEnergy,
    dissipated_power,
    stored_energy,
)
from geoimp_drake.simulation.style import figure_style, keep_noise_small
from geoimp_drake.systems.frame_motion import VELOCITY
from geoimp_drake.typing import Array

__all__ = ["AUDIT", "AUDIT_TEXT", "EnergyAudit", "audit_figure", "audit_of", "audited"]

# The name of the figure's files, and a description of the figure.
AUDIT = "energy_audit"
AUDIT_TEXT = "Energy that comes in, is given out, stored and dissipated, and the balance's error."


@dataclass(frozen=True)
class EnergyAudit:
    """Energies over time, from zero at the start (N,) [J].

    Energy that D's motion brings in is given out, stored or dissipated, except for the error.

    Attributes:
        energy_in: work of the wrench on D's motion.
        given_out: work of the wrench on C's motion, to the environment; negative if taken from it.
        stored: kinetic and potential energy of the impedance; it need not start at zero.
        dissipated: energy dissipated by its damping.
    """

    energy_in: Array
    given_out: Array
    stored: Array
    dissipated: Array

    @property
    def error(self) -> Array:
        """The error of the balance (N,) [J]."""
        kept = self.stored - self.stored[0] + self.dissipated
        error: Array = self.energy_in - self.given_out - kept
        return error

    @property
    def relative_error(self) -> float:
        """The largest error divided by the largest energy; zero where nothing happens."""
        parts = self.energy_in, self.given_out, self.stored, self.dissipated
        largest = max(float(np.abs(part).max()) for part in parts)
        return float(np.abs(self.error).max()) / largest if largest else 0.0


def audited(log: Mapping[str, Array]) -> list[str]:
    """Returns the arms, or the object, whose energies and motions a log has."""
    return [
        key.removesuffix("/energy")
        for key in log
        if key.endswith("/energy") and len(log["t"]) > 1 and np.isfinite(log[key]).all()
    ]


def audit_of(log: Mapping[str, Array], body: str) -> EnergyAudit:
    """Returns the audit of an arm, or of the object.

    Powers are interpolated linearly between two rows; the error includes that of the interpolation.

    Args:
        log: of a run.
        body: its name in the log.
    """
    energy, view = log[f"{body}/energy"], ImpedanceEnergy(log[f"{body}/energy"].T)
    supplied = view.translational_supplied_power + view.rotational_supplied_power
    given_out = np.sum(log[f"{body}/wrench"] * log[f"{body}/motion_C"][:, VELOCITY], axis=1)
    t = log["t"]
    return EnergyAudit(
        _integral(t, supplied + given_out),
        _integral(t, given_out),
        view.translational_kinetic + view.rotational_kinetic + stored_energy(energy.T),
        _integral(t, dissipated_power(energy.T)),
    )


def _integral(t: Array, power: Array) -> Array:
    steps = 0.5 * (power[1:] + power[:-1]) * np.diff(t)
    return np.concatenate(([0.0], np.cumsum(steps)))


def audit_figure(log: Mapping[str, Array]) -> Figure:
    """Returns the energies of each audited body over time, and the error of their balance."""
    bodies = audited(log)
    with figure_style():
        figure = Figure(figsize=(9, 3.4 * len(bodies)))
        for (left, right), body in zip(
            figure.subplots(len(bodies), 2, squeeze=False), bodies, strict=True
        ):
            audit = audit_of(log, body)
            for values, label, style in (
                (audit.energy_in, "in, by the motion of D", "-"),
                (audit.given_out, "given out to the environment", "--"),
                (audit.stored, "stored", "-."),
                (audit.dissipated, "dissipated", ":"),
            ):
                left.plot(log["t"], values, style, label=label)
            left.set(title=f"energies of {body}", ylabel="energy [J]", xlabel="time [s]")
            right.plot(log["t"], 1e3 * audit.error, color="#555555")
            right.set(
                title=f"balance error, at most {100.0 * audit.relative_error:.2g} %",
                ylabel="in − out − kept [mJ]",
                xlabel="time [s]",
            )
            for axes in (left, right):
                axes.set_xlim(log["t"][0], log["t"][-1])
                keep_noise_small(axes)
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=4)
        figure.suptitle("audit of the impedance's energy")
    return figure
