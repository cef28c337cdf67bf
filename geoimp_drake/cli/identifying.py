"""The command `geoimp identify`."""

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geoimp_drake.cli.commands import SUCCESS, named_in
from geoimp_drake.errors import ConfigurationError

if TYPE_CHECKING:
    from geoimp_drake.analysis.identification import Estimate, Reading

__all__ = ["add_identify", "identify"]

_UNITS = {
    "translation": {"mass": "kg", "damping": "Ns/m", "stiffness": "N/m"},
    "rotation": {"mass": "kg m²", "damping": "Nms/rad", "stiffness": "Nm/rad"},
}


def add_identify(subparsers: Any) -> None:
    """Adds the command to the parser."""
    parser = subparsers.add_parser(
        "identify",
        help="tell which M, D and K the log of a run shows, beside those asked for",
        description="Least squares on the logged motion and wrench, on C (what the controller "
        "computed) and on E (what the arm did). What the motion does not excite is named, without "
        "a number.",
    )
    parser.add_argument("log", type=Path, metavar="LOG", help="folder of a run, or its log.npz")
    parser.add_argument(
        "--friction",
        action="store_true",
        help="tell Coulomb and viscous friction of each joint instead, with the lines for "
        "remedies.friction; every joint has to move both ways in free space",
    )
    parser.add_argument("--frame", choices=("C", "E"), help="one of the two only")
    parser.add_argument(
        "--scenario", type=Path, metavar="FILE", help="of the run (scenario.yaml beside the log)"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all of it to FILE")
    parser.set_defaults(command=identify)


def identify(options: argparse.Namespace) -> int:
    """Prints the impedance that a log shows, beside the configured one. Returns the exit status."""
    from geoimp_drake.analysis.identification import FRAMES, identify, moving
    from geoimp_drake.output_folder import check_file, write_file
    from geoimp_drake.simulation.log_data import read_log

    if options.json is not None:
        check_file(options.json)
    file = options.log / "log.npz" if options.log.is_dir() else options.log
    log, scenario = read_log(file), _asked(options.scenario or file.with_name("scenario.yaml"))
    if options.friction:
        return _tell_friction(log, scenario, options.json)
    impedance = _impedance(scenario)
    readings = {
        hand: [
            reading
            for frame in ([options.frame] if options.frame else FRAMES)
            for reading in identify(log, impedance, hand, frame)
        ]
        for hand in moving(log)
    }
    for hand, read in readings.items():
        print("\n\n".join(_text(hand, reading) for reading in read))
    if options.json is not None:
        told = {hand: [_plain(reading) for reading in read] for hand, read in readings.items()}
        write_file(options.json, json.dumps(told, indent=2) + "\n")
    return SUCCESS


def _asked(file: Path) -> Any:
    from geoimp_drake.diagrams.experiments.catalogue import get_experiment
    from geoimp_drake.scenario.loading import read_layer

    if not file.exists():
        raise ConfigurationError(
            f"{file} is missing; it holds the impedance that was asked for. Give the scenario "
            "with --scenario."
        )
    return get_experiment(named_in(file)).scenario((read_layer(file),))


def _impedance(scenario: Any) -> Any:
    if getattr(scenario, "inertia", None) == "natural":
        raise ConfigurationError(
            "The scenario has inertia: natural: the mass is the arm's own and changes with its "
            "posture, which one M, D, K cannot show. Identify a run with inertia: desired."
        )
    return scenario.impedance


def _tell_friction(log: Any, scenario: Any, json_file: Path | None) -> int:
    """Prints the friction of each joint that a log shows. Returns the exit status."""
    from geoimp_drake.analysis.friction import friction_from_log
    from geoimp_drake.diagrams.setups.single_arm import model_of_single_arm
    from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
    from geoimp_drake.output_folder import write_file

    if not isinstance(scenario, SingleArmScenario):
        raise ConfigurationError(
            "The scenario has two arms, but friction is identified for one arm only. Give the log "
            "of a run with one arm."
        )
    found = friction_from_log(log, scenario.arm, model_of_single_arm(scenario))
    rows: list[tuple[str, ...]] = [("joint", "Coulomb [Nm, N]", "± 95 %", "viscous*", "± 95 %")]
    for joint in found:
        values = [
            (_number(value), f"{width:.2g}")
            for value, width in zip((joint.coulomb, joint.viscous), joint.half_widths, strict=True)
        ]
        rows.append((joint.name, *values[0], *values[1]))
    print(_table(rows))
    print("* beyond the model's [Nms/rad, Ns/m]\nfor the scenario, 0 for what is not seen:")
    coulomb, viscous = (
        ", ".join(f"{getattr(joint, name) or 0.0:.4g}" for joint in found)
        for name in ("coulomb", "viscous")
    )
    print(f"remedies:\n  friction: {{ coulomb: [{coulomb}], viscous: [{viscous}] }}")
    if json_file is not None:
        told = [{**asdict(joint), "half_widths": _finite(joint.half_widths)} for joint in found]
        write_file(json_file, json.dumps(told, indent=2) + "\n")
    return SUCCESS


def _number(value: float | None) -> str:
    return "not seen" if value is None else f"{value:.4g}"


def _finite(values: tuple[float, ...]) -> list[float | None]:
    """Returns numbers for JSON; infinity becomes null."""
    return [None if value == float("inf") else value for value in values]


def _table(rows: list[tuple[str, ...]]) -> str:
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )


def _plain(reading: "Reading") -> dict[str, Any]:
    """Returns a reading for JSON; infinity becomes null."""
    told = asdict(reading)
    told["mean_error"] = reading.mean_error
    for row in (told, *told["estimates"]):
        row |= {key: None for key, value in row.items() if value == float("inf")}
    return told


def _text(hand: str, reading: "Reading") -> str:
    rows: list[tuple[str, ...]] = [("", "axis", "asked", "found", "± 95 %", "error")]
    rows += [_row(estimate) for estimate in reading.estimates]
    error = "nothing found" if (e := reading.mean_error) is None else f"mean error {100 * e:.2g} %"
    return "\n".join(
        [
            f"{hand}, {reading.part} of {reading.frame}: {error}, "
            f"condition {reading.condition:.3g}, misfit {100 * reading.misfit:.2g} %",
            _table(rows),
        ]
    )


def _row(estimate: "Estimate") -> tuple[str, ...]:
    unit = _UNITS[estimate.part][estimate.gain]
    name = f"{estimate.gain} [{unit}]", estimate.axis, f"{estimate.asked:.4g}"
    if estimate.error is None:
        return (*name, "not excited", f"{estimate.half_width:.2g}", "")
    return (
        *name,
        f"{estimate.found:.4g}",
        f"{estimate.half_width:.2g}",
        f"{round(100 * estimate.error, 2) + 0.0:.2f} %",
    )
