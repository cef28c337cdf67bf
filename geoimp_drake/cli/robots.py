"""The output of `geoimp init --robot` and `geoimp check`."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from geoimp_drake.diagrams.setups.own_robot import (
    WITH_SHAPES,
    OwnRobot,
    describe,
    propose_scenario,
    said_of,
)
from geoimp_drake.diagrams.setups.single_arm import build_single_arm
from geoimp_drake.scenario.template import check_new, write_template

__all__ = ["check_robot", "check_scenario", "init_robot"]


def init_robot(
    robot: Path, end_effector: str | None, packages: Mapping[str, Path], file: Path
) -> None:
    """Writes a scenario for a robot; its first lines repeat what is printed about the robot."""
    check_new(file)
    own = propose_scenario(robot, end_effector, packages=packages)
    says = describe(own)
    _print([says, ""], _warnings(own))
    own.robot.file = _seen_from(file, robot)
    own.robot.packages = {name: _seen_from(file, found) for name, found in packages.items()}
    write_template(file, own.scenario, says)


def check_robot(file: Path, end_effector: str | None, packages: Mapping[str, Path]) -> None:
    """Prints the contents of a robot's file, with warnings, all shapes included."""
    own = propose_scenario(file, end_effector, WITH_SHAPES, packages)
    _print([describe(own), ""], _warnings(own))


def check_scenario(experiment: Any, scenario: Any) -> None:
    """Prints reports and warnings while a scenario is built."""
    _print(*said_of(experiment.build, scenario))


def _warnings(own: OwnRobot) -> list[str]:
    _, warnings = said_of(build_single_arm, own.scenario)
    return [*own.problems, *warnings]


def _print(reports: list[str], warnings: list[str]) -> None:
    said = [*reports, *(f"warning: {text}" for text in warnings)]
    print("\n".join(said if warnings else [*said, "nothing to warn of"]))


def _seen_from(scenario: Path, file: Path) -> str:
    """Returns the path of a file as a scenario names it: from its folder, if the file is below."""
    folder, file = scenario.absolute().parent.resolve(), file.resolve()
    return str(file.relative_to(folder) if file.is_relative_to(folder) else file)
