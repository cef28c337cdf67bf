"""A scenario for a robot from a file, and the warnings before a run."""

import contextlib
import copy
import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.diagrams.setups.posture import StartConfig
from geoimp_drake.diagrams.setups.setup import Setup
from geoimp_drake.diagrams.setups.single_arm_scenario import OWN_ARM, SingleArmScenario
from geoimp_drake.errors import ConfigurationError, GeoimpError, ModelError
from geoimp_drake.robot_files.config import RobotConfig
from geoimp_drake.robot_files.loading import LoadedRobot
from geoimp_drake.robot_files.messages import silent
from geoimp_drake.robot_files.parsing import trial_plant
from geoimp_drake.robot_files.proposal import Proposal, propose
from geoimp_drake.robot_files.survey import RobotSurvey, survey_robot
from geoimp_drake.simulation.experiment import cannot_start
from geoimp_drake.simulation.run import simulate
from geoimp_drake.systems.sources.desired_motion import MotionSegment, length_of
from geoimp_drake.systems.sources.external_wrench import WrenchRamp

__all__ = ["WITH_SHAPES", "OwnRobot", "describe", "propose_scenario", "said_of"]

_log = logging.getLogger("drake")

# Durations of the motion out and back, of the push, and before it [s].
_OUT, _BACK, _PUSHED, _BEFORE_PUSH = 2.0, 2.0, 5.0, 0.5
# Shapes of every kind, so that contact between links is seen; and none, if they cannot be read.
WITH_SHAPES, _WITHOUT, _REPAIR = "convert", "leave-out", "repair"
_UNITS = {"translation": ("kg", "Ns/m", "N/m"), "rotation": ("kg m²", "Nms/rad", "Nm/rad")}


@dataclass
class OwnRobot:
    """A robot from a file, and a scenario for its first run.

    Attributes:
        survey: the contents of the file.
        scenario: for the chosen end effector.
        robot: that of the scenario.
        joints: names of its joints, from the base to the end effector.
        mass: of the moving links [kg].
        changes: the changes that were necessary to use the robot.
        problems: why its geometry was left out and inertias were repaired, if so.
    """

    survey: RobotSurvey
    scenario: SingleArmScenario
    robot: RobotConfig
    joints: tuple[str, ...]
    mass: float
    changes: tuple[str, ...]
    problems: list[str] = field(default_factory=list)


def propose_scenario(
    file: Path,
    end_effector: str | None = None,
    geometry: str | None = None,
    packages: Mapping[str, Path] | None = None,
) -> OwnRobot:
    """Returns a scenario that a robot runs at once: it moves, comes back and is pushed.

    Args:
        file: of the robot.
        end_effector: a link, frame or site; by default that of the longest arm.
        geometry: how the scenario treats the robot's shapes, its default unless given; shapes that
            cannot be read are left out.
        packages: folders of `package://` names.

    Raises:
        ConfigurationError: the file cannot be read.
        ModelError: it has no arm of six joints or no such frame, or as `load_robot`.
    """
    survey = survey_robot(file, packages)
    config = RobotConfig(str(file), end_effector or survey.arms[0].end_effector)
    config.packages = {name: str(found) for name, found in (packages or {}).items()}
    config.geometry = geometry or config.geometry
    scenario = SingleArmScenario(experiment="custom", arm=OWN_ARM, robot=config)
    problems: list[str] = []
    with silent():
        plant, scene_graph, robot = _load_anyhow(config, WITH_SHAPES, problems)
        arm, E = robot.model_instance, robot.end_effector_frame
        model = ControlModel.of_arm(plant, arm, E)
        proposal = propose(plant, arm, E, scene_graph, scenario.sampling.period)
    _fill_in(scenario, proposal)
    mass = float(model.plant.CalcTotalMass(model.plant.CreateDefaultContext()))
    return OwnRobot(survey, scenario, config, model.joint_names, mass, robot.changes, problems)


def _load_anyhow(
    config: RobotConfig, geometry: str, problems: list[str]
) -> tuple[MultibodyPlant, SceneGraph, LoadedRobot]:
    """Loads a robot, if need be with repaired inertias and without shapes.

    The configuration then says so, and the problems say why.
    """
    problem: GeoimpError
    try:
        return _load(config, geometry)
    except ConfigurationError as error:
        if geometry == _WITHOUT:
            raise
        found = _load_anyhow(config, _WITHOUT, problems)
        config.geometry, problem = _WITHOUT, error
    except ModelError as error:
        if config.inertia == _REPAIR:
            raise
        config.inertia, problem = _REPAIR, error
        found = _load_anyhow(config, geometry, problems)
    problems.insert(0, str(problem))
    return found


def _load(config: RobotConfig, geometry: str) -> tuple[MultibodyPlant, SceneGraph, LoadedRobot]:
    """Returns a plant with the robot alone, and the scene graph with its shapes."""
    plant, scene_graph = trial_plant()
    robot = replace(config, geometry=geometry).load(plant)
    plant.Finalize()
    return plant, scene_graph, robot


def _fill_in(scenario: SingleArmScenario, proposal: Proposal) -> None:
    """Puts a proposal into a scenario."""
    scenario.start = StartConfig(posture=proposal.posture.tolist())
    scenario.impedance = proposal.impedance
    there = proposal.displacement
    if there.any():
        scenario.segments = [
            MotionSegment(_OUT, there, name="out"),
            MotionSegment(_BACK, 0.0 - there, name="back"),
        ]
    if proposal.push.any():
        begin = _BEFORE_PUSH + length_of(scenario.segments)
        scenario.external = WrenchRamp(force=proposal.push, start=begin)
    scenario.segments.append(MotionSegment(_PUSHED, name="pushed"))


def describe(own: OwnRobot) -> str:
    """Returns a readable description of a robot's file and of the proposal."""
    arms, chosen = own.survey.arms, own.robot.end_effector
    others = [name for arm in arms for name in (arm.end_effector, *arm.others) if name != chosen]
    lines = [
        f"{own.survey.file.name}: {own.mass:.3g} kg move on {len(own.joints)} joints, "
        f"{_list(own.joints)}",
        f"frames: {_list(own.survey.frames)}",
        f"end effector: {chosen}; six joints also move: {_list(others)}",
        f"changed: {'; '.join(own.changes) or 'nothing'}",
    ]
    if len(arms) > 1:
        ends = [f"{arm.end_effector} ({len(arm.joints)} joints)" for arm in arms]
        lines.insert(2, f"arms by their end effectors: {_list(ends)}")
    move, push = own.scenario.segments[0].displacement, own.scenario.external
    pushed = (
        f"pushed down by {-push.force[2]:g} N" if push is not None else "no push that it could bear"
    )
    lines.append(f"motion: by {move.tolist()} m and back, then {pushed}")
    for part, units in _UNITS.items():
        names = ("mass", "damping", "stiffness")
        gains = zip(names, own.scenario.impedance.gains(part), units, strict=True)
        lines.append(f"{part}: " + ", ".join(f"{n} {K[0, 0]:g} {unit}" for n, K, unit in gains))
    return "\n".join(lines)


def _list(names: Sequence[str]) -> str:
    return ", ".join(names) or "none"


def said_of(build: Callable[[Any], Setup], scenario: Any) -> tuple[list[str], list[str]]:
    """Builds a scenario, starts it, and returns the reports and the warnings in Drake's log.

    It simulates one period of the log, since only a first step notices some things.

    Args:
        build: makes the set-up of a scenario, such as an experiment's.
        scenario: the one to build; its open fields stay open.

    Raises:
        GeoimpError: the scenario cannot be used, or its simulation cannot start.
    """
    with _heard() as heard:
        setup = build(copy.deepcopy(scenario))
        outcome = simulate(setup.diagram, scenario.simulator, scenario.log_period)
    if outcome.failure is not None:
        raise cannot_start(outcome.failure)
    return list(heard.reports), list(heard.warnings)


class _Gatherer(logging.Handler):
    """Keeps messages, both reports and warnings, each text once."""

    def __init__(self) -> None:
        super().__init__()
        self.reports: dict[str, None] = {}
        self.warnings: dict[str, None] = {}

    def emit(self, record: logging.LogRecord) -> None:
        """Keeps a record."""
        said = self.warnings if record.levelno >= logging.WARNING else self.reports
        said[record.getMessage()] = None


@contextlib.contextmanager
def _heard() -> Iterator[_Gatherer]:
    """Yields a handler that receives Drake's log instead of all others."""
    gatherer, kept = _Gatherer(), (_log.handlers, _log.propagate)
    _log.handlers, _log.propagate = [gatherer], False
    try:
        yield gatherer
    finally:
        _log.handlers, _log.propagate = kept
