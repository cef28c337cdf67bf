"""The command `geoimp tare`."""

from pathlib import Path
from typing import Any

import numpy as np

from geoimp_drake.cli.driving import single
from geoimp_drake.diagrams.setups.tared_arm import (
    payload_driven,
    payload_logged,
    payload_of,
)
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.sensing.load_identification import IdentifiedLoad
from geoimp_drake.reading import read_text
from geoimp_drake.scenario.yaml_text import parse_yaml
from geoimp_drake.simulation.log_data import read_log
from geoimp_drake.typing import Array
from geoimp_drake.validation import finite_array, whole_number

__all__ = ["tare_robot"]

_COMPONENTS = ("μ_x", "μ_y", "μ_z", "f_x", "f_y", "f_z")

# A lighter load counts as none [kg].
_NO_LOAD = 5e-3

_MOST_POSTURES = 100


def tare_robot(
    scenario: Any, postures: int, drive: Path | None, log: Path | None, *, at_wrist: bool
) -> None:
    """Prints the load on the arm of a scenario beyond its robot's file.

    Args:
        scenario: with one arm.
        postures: their number; a real robot is moved to each by hand.
        drive: file with postures to which it is driven instead; None for none.
        log: file of a logged motion, instead of both; None for none.
        at_wrist: uses the wrench that the robot reports instead of its joints' torques.
    """
    whole_number(postures, "--postures", 2, _MOST_POSTURES)
    if log is not None:
        load, joints = payload_logged(single(scenario), read_log(log), at_wrist=at_wrist)
    elif drive is not None:
        load, joints = payload_driven(single(scenario), _read_postures(drive), at_wrist=at_wrist)
    else:
        load, joints = payload_of(single(scenario), postures, _wait_for_posture, at_wrist=at_wrist)
    _print(load, _COMPONENTS if at_wrist else joints, at_wrist=at_wrist)


def _print(load: IdentifiedLoad, names: tuple[str, ...], *, at_wrist: bool) -> None:
    print(
        f"mass {load.mass:.4f} kg, centre {np.round(1e3 * load.centre_of_mass, 2).tolist()} mm in E"
    )
    biases = ", ".join(f"{name} {b:.3f}" for name, b in zip(names, load.bias, strict=True))
    print(f"bias of the {'wrench in E' if at_wrist else 'joints'} [Nm, N]: {biases}")
    left = " and ".join(
        f"{value:.2g} {unit}" for value, unit in zip(load.left_over, ("Nm", "N"), strict=False)
    )
    print(f"condition {load.condition:.1f}, left over {left}")
    lines = []
    if load.mass > _NO_LOAD:
        centre = _numbers(load.centre_of_mass)
        lines.append(f"  payload: {{ mass: {load.mass:.4f}, centre_of_mass: {centre} }}")
    if at_wrist:
        lines.append(f"  driver: {{ wrench: robot, wrench_bias: {_numbers(load.bias)} }}")
    if lines:
        print("\n".join(("for the scenario:", "robot:", *lines)))


def _numbers(values: Array) -> str:
    return f"[{', '.join(f'{x:.5f}' for x in values)}]"


def _read_postures(file: Path) -> Array:
    """Returns the postures (m, n) of a YAML file, or raises ConfigurationError."""
    data = parse_yaml(read_text(file, "list of postures"), str(file))
    if not isinstance(data, list) or not all(isinstance(row, list) for row in data):
        raise ConfigurationError(
            f"{file} is not a list of postures: give one line '- [q1, q2, …]' [rad, m] for each, "
            "base first."
        )
    whole_number(len(data), f"the number of postures in {file}", 2, _MOST_POSTURES)
    return finite_array(np.array(data, dtype=object), str(file), (len(data), len(data[0])))


def _wait_for_posture(number: int) -> None:
    try:
        input(f"posture {number}: move the arm there by hand, let it rest, press Enter ")
    except EOFError:
        raise ConfigurationError(
            "geoimp tare waits for Enter in each posture; run it in a terminal."
        ) from None
