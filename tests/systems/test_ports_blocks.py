"""What a docstring says about ports is what the system has: names, order and sizes."""

import importlib
import inspect
import pkgutil
import re
from collections.abc import Callable

import numpy as np
import pytest
from impedance_rig import make_impedance
from internal_gains import bar_internal
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointIndex
from pydrake.systems.framework import LeafSystem, PortDataType, System

import geoimp_drake
from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.kinematic_tree import path_to
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.cooperative_config import CooperativeControllerConfig
from geoimp_drake.controllers.cooperative_controller import make_cooperative_controller
from geoimp_drake.controllers.impedance_controller import make_impedance_controller
from geoimp_drake.diagrams.scene.cell import END_EFFECTOR, FLANGE, SIX, add_cell
from geoimp_drake.diagrams.scene.colliding_body import ContactForce
from geoimp_drake.diagrams.scene.turning_hand import HandConfig, TurningHand
from geoimp_drake.diagrams.setups.insertion_end import InsertionEnd, InsertionWatch
from geoimp_drake.diagrams.setups.joint_errors import VectorFunction
from geoimp_drake.models import package_map
from geoimp_drake.parts import remedies as remedies_part
from geoimp_drake.parts.motion_control import MotionControl
from geoimp_drake.parts.remedies_config import IntegralConfig, RemediesConfig
from geoimp_drake.parts.wrist_sensor_config import (
    SensorMounting,
    ToolLoad,
    WristSensor,
    WristSensorConfig,
)
from geoimp_drake.simulation.live import PushButton, StiffnessSliders
from geoimp_drake.simulation.visualization import FrameTriads, WrenchArrow
from geoimp_drake.systems.adaptive_damping import AdaptiveDamping
from geoimp_drake.systems.arm.arm_model import ArmModel
from geoimp_drake.systems.arm.constrained_acceleration import ConstrainedAcceleration
from geoimp_drake.systems.arm.industrial_controller import (
    IndustrialController,
    make_industrial_controller,
)
from geoimp_drake.systems.arm.inverse_dynamics_inner_loop import InverseDynamicsInnerLoop
from geoimp_drake.systems.arm.inverse_kinematics import InverseKinematics
from geoimp_drake.systems.arm.joint_readings import JointReadings
from geoimp_drake.systems.arm.motion_controller import MotionController
from geoimp_drake.systems.arm.redundancy_resolver import RedundancyResolver
from geoimp_drake.systems.arm.remedies import Remedies
from geoimp_drake.systems.cooperation.cooperative_kinematics import CooperativeKinematics
from geoimp_drake.systems.cooperation.cooperative_reference_generator import (
    CooperativeReferenceGenerator,
)
from geoimp_drake.systems.cooperation.grasp_monitor import GraspMonitor
from geoimp_drake.systems.cooperation.internal_impedance import InternalImpedance
from geoimp_drake.systems.cooperation.reference_hold import ReferenceHold
from geoimp_drake.systems.direct_impedance import DirectImpedance
from geoimp_drake.systems.hand_over import HandOver
from geoimp_drake.systems.impedance_integrator import ImpedanceIntegrator
from geoimp_drake.systems.last_motion import LastMotion
from geoimp_drake.systems.natural_impedance import NaturalImpedance
from geoimp_drake.systems.part_system import Block, FlowingPartSystem, PartSystem
from geoimp_drake.systems.passive_gains import PassiveGains
from geoimp_drake.systems.passivity_observer import PassivityObserver
from geoimp_drake.systems.safety_limits import SafetyConfig, SafetyLimits
from geoimp_drake.systems.sensing.force_torque_sensor import ForceTorqueSensor, ForceTorqueSensors
from geoimp_drake.systems.sensing.frame_motion_sensor import FrameMotionSensor
from geoimp_drake.systems.sensing.momentum_observer import MomentumObserver
from geoimp_drake.systems.sources.desired_motion import DesiredMotion
from geoimp_drake.systems.sources.external_wrench import ExternalWrench, WrenchRamp
from geoimp_drake.systems.sources.smooth_target import SmoothTarget
from geoimp_drake.systems.supervisor import Supervisor

Port = tuple[str, str, str | None]  # direction, name, size as printed

_DECLARATION = re.compile(r"^\s*(input|output) (\w+): (.*)$")
_SIZE = re.compile(r"\((\d*n|\d+)\)")


def six_joint_plant() -> tuple:
    plant = MultibodyPlant(1e-3)
    add_cell(plant, "single_arm")
    plant.Finalize()
    tool = plant.GetModelInstanceByName(f"{SIX}_tool")
    return plant, plant.GetModelInstanceByName(SIX), plant.GetFrameByName(END_EFFECTOR, tool)


def six_joint_model() -> ControlModel:
    return ControlModel.of_arm(*six_joint_plant())


def held_mounting() -> SensorMounting:
    identity = RigidTransform()
    # The tool is welded to the world of a plant of one joint.
    path = np.array([[*identity.GetAsMatrix34().ravel(), *np.zeros(6)]])
    return SensorMounting(JointIndex(0), 1, identity, identity, np.zeros(3), 1.0, path, 2)


def held_sensor() -> ForceTorqueSensor:
    return ForceTorqueSensor(held_mounting(), ToolLoad(), WristSensorConfig())


def held_sensors() -> ForceTorqueSensors:
    sensor = WristSensor(held_mounting(), ToolLoad(), WristSensorConfig())
    return ForceTorqueSensors([sensor, sensor])


def frame_motion_sensor() -> FrameMotionSensor:
    plant, _, E = six_joint_plant()
    return FrameMotionSensor(E, path_to(plant, E))


def safety_limits() -> SafetyLimits:
    config = SafetyConfig(force=150.0, source="this test", contact_stiffness=1e4)
    return SafetyLimits(six_joint_model(), (np.eye(3),) * 3, config)


def remedies() -> Remedies:
    config = RemediesConfig(integral=IntegralConfig())
    return Remedies(remedies_part.Remedies(six_joint_model(), config, MotionControl(), 1e-3))


def industrial_controller() -> IndustrialController:
    return make_industrial_controller(*six_joint_plant(), None)


# How to make each system, and its n.
CASES: dict[type[LeafSystem], tuple[Callable[[], System], int]] = {
    AdaptiveDamping: (AdaptiveDamping, 0),
    ArmModel: (lambda: ArmModel(six_joint_model()), 6),
    ConstrainedAcceleration: (lambda: ConstrainedAcceleration(six_joint_model()), 6),
    CooperativeKinematics: (CooperativeKinematics, 0),
    CooperativeReferenceGenerator: (CooperativeReferenceGenerator, 0),
    DirectImpedance: (lambda: DirectImpedance(make_impedance().part), 0),
    DesiredMotion: (lambda: DesiredMotion(RigidTransform()), 0),
    ExternalWrench: (lambda: ExternalWrench(six_joint_plant()[2], WrenchRamp()), 0),
    ForceTorqueSensor: (held_sensor, 1),
    ForceTorqueSensors: (held_sensors, 1),
    FrameMotionSensor: (frame_motion_sensor, 6),
    GraspMonitor: (GraspMonitor, 0),
    ImpedanceIntegrator: (make_impedance, 0),
    IndustrialController: (industrial_controller, 6),
    InverseKinematics: (lambda: InverseKinematics(six_joint_model(), 1e-3), 6),
    InternalImpedance: (lambda: InternalImpedance.of(bar_internal().make()), 0),
    InverseDynamicsInnerLoop: (lambda: InverseDynamicsInnerLoop(six_joint_model()), 6),
    MotionController: (MotionController, 0),
    LastMotion: (LastMotion, 0),
    NaturalImpedance: (lambda: NaturalImpedance(make_impedance().part), 0),
    PassivityObserver: (PassivityObserver, 0),
    PassiveGains: (lambda: PassiveGains(make_impedance().part), 0),
    ReferenceHold: (ReferenceHold, 0),
    RedundancyResolver: (lambda: RedundancyResolver(six_joint_model()), 6),
    HandOver: (lambda: HandOver(7), 7),
    JointReadings: (lambda: JointReadings(9), 9),
    MomentumObserver: (lambda: MomentumObserver(six_joint_model()), 6),
    ContactForce: (ContactForce, 0),
    TurningHand: (
        lambda: TurningHand(six_joint_plant()[2], HandConfig(), np.array([1.0, 0.0, 0.0, 0.0])),
        0,
    ),
    SafetyLimits: (safety_limits, 6),
    Remedies: (remedies, 6),
    Supervisor: (lambda: Supervisor(np.ones(7)), 7),
    PushButton: (lambda: PushButton(Meshcat(), six_joint_plant()[2]), 0),
    SmoothTarget: (lambda: SmoothTarget(RigidTransform()), 0),
    InsertionWatch: (lambda: InsertionWatch(InsertionEnd(), 0.01), 0),
    VectorFunction: (lambda: VectorFunction(np.sin, 3), 3),
    StiffnessSliders: (lambda: StiffnessSliders(Meshcat()), 0),
    FrameTriads: (lambda: FrameTriads(Meshcat(), ("NAME",)), 0),
    WrenchArrow: (lambda: WrenchArrow(Meshcat()), 0),
}


def modules() -> list[str]:
    """Returns the names of the package's modules."""
    found = pkgutil.walk_packages(geoimp_drake.__path__, "geoimp_drake.")
    return [module.name for module in found if not module.name.endswith("__main__")]


def leaf_systems() -> set[type[LeafSystem]]:
    """Returns every LeafSystem that a module of the package defines."""
    return {
        kind
        for name in modules()
        for _, kind in inspect.getmembers(importlib.import_module(name), inspect.isclass)
        if issubclass(kind, LeafSystem) and kind.__module__ == name
    }


def documented_ports(docstring: str) -> list[Port]:
    """Returns the lines `input NAME: text (size) [unit]` and `output …` of a docstring."""
    ports = []
    for line in inspect.cleandoc(docstring).splitlines():
        if declaration := _DECLARATION.match(line):
            direction, name, text = declaration.groups()
            sizes = _SIZE.findall(text)
            ports.append((direction, name, sizes[-1] if sizes else None))
    return ports


def real_ports(system: System) -> list[tuple[str, str, int | None]]:
    """Returns direction, name and size of a system's ports; no size for abstract ones."""
    ports = []
    for direction, count, get in (
        ("input", system.num_input_ports(), system.get_input_port),
        ("output", system.num_output_ports(), system.get_output_port),
    ):
        for port in map(get, range(count)):
            vector = port.get_data_type() == PortDataType.kVectorValued
            ports.append((direction, port.get_name(), port.size() if vector else None))
    return ports


def with_numbers(ports: list[Port], n: int) -> list[tuple[str, str, int | None]]:
    """Replaces (n), (2n) by what they are for n."""

    def number(size: str | None) -> int | None:
        if size is None or not size.endswith("n"):
            return None if size is None else int(size)
        return int(size[:-1] or 1) * n

    return [(direction, name, number(size)) for direction, name, size in ports]


def test_every_leaf_system_of_the_package_has_a_case_here() -> None:
    names = {kind.__name__ for kind in leaf_systems() - {Block, PartSystem, FlowingPartSystem}}
    assert names == {kind.__name__ for kind in CASES}
    assert "geoimp_drake.simulation.visualization" in modules()


@pytest.mark.parametrize("kind", CASES, ids=lambda kind: kind.__name__)
def test_ports_block_names_the_ports_that_there_are(kind: type[LeafSystem]) -> None:
    make, n = CASES[kind]
    assert kind.__doc__ is not None
    assert "Ports:" in kind.__doc__
    assert with_numbers(documented_ports(kind.__doc__), n) == real_ports(make())


FORMS = ("blocks", "compiled")


@pytest.mark.parametrize("form", FORMS)
def test_ports_of_the_controller_are_those_of_its_docstring(form: str) -> None:
    controller = make_impedance_controller(*six_joint_plant(), ImpedanceControllerConfig(form=form))
    documented = with_numbers(documented_ports(make_impedance_controller.__doc__ or ""), 6)
    assert sorted(documented, key=str) == sorted(real_ports(controller), key=str)


@pytest.mark.parametrize("form", FORMS)
def test_ports_of_the_cooperative_controller_are_those_of_its_docstring(form: str) -> None:
    plant = MultibodyPlant(1e-3)
    arms = []
    for name, x in (("first", 0.0), ("second", 2.0)):
        parser = Parser(plant, name)
        parser.package_map().AddMap(package_map())
        (arm,) = parser.AddModels(url="package://geoimp_models/six_joint_arm.urdf")
        base = plant.GetFrameByName("base", arm)
        plant.WeldFrames(plant.world_frame(), base, RigidTransform([x, 0.0, 0.0]))
        arms.append(arm)
    plant.Finalize()
    hands = [plant.GetFrameByName(FLANGE, arm) for arm in arms]
    config = CooperativeControllerConfig(form=form)
    real = real_ports(make_cooperative_controller(plant, arms, hands, config))
    documented = with_numbers(documented_ports(make_cooperative_controller.__doc__ or ""), 6)
    assert sorted(documented, key=str) == sorted(real, key=str)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("  input state: [q; v] (2n) [rad]", [("input", "state", 18)]),
        ("  output a: of E (3.30) in W (6)", [("output", "a", 6)]),
        ("  output arm: ArmState", [("output", "arm", None)]),
        ("  inputs are two: a and b (3)", []),
    ],
)
def test_reading_of_a_ports_block(text: str, expected: list) -> None:
    assert with_numbers(documented_ports(text), 9) == expected


def test_a_port_that_is_missing_misnamed_or_of_another_size_is_found() -> None:
    right = documented_ports(JointReadings.__doc__ or "")
    real = real_ports(JointReadings(9))
    assert with_numbers(right, 9) == real
    for wrong in (
        right[:-1],
        right[::-1],
        [("input", "states", "2n"), right[1]],
        [("input", "state", "n"), right[1]],
    ):
        assert with_numbers(wrong, 9) != real
