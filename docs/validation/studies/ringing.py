"""Compares the dampings at which a pressed hand begins to ring: by the sampled loop, and simulated.

python docs/validation/studies/ringing.py
"""

import logging
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from pydrake.geometry import AddContactMaterial, HalfSpace, ProximityProperties, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    CoulombFriction,
    DiscreteContactApproximation,
    MultibodyPlant,
)
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput

from geoimp_drake.analysis.ringing import critical_damping
from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.start_posture import find_start_posture
from geoimp_drake.controllers.config import ImpedanceControllerConfig, SamplingConfig
from geoimp_drake.controllers.impedance_controller import make_impedance_controller
from geoimp_drake.controllers.sensor_checks import sampled_loop
from geoimp_drake.controllers.wrist_sensor import connect_wrist_sensors, wrist_sensor_at
from geoimp_drake.laws.prediction.modes import modes_of
from geoimp_drake.laws.prediction.sampled_loop import SampledLoop
from geoimp_drake.models import model_path
from geoimp_drake.parts.wrist_sensor_config import WristSensorConfig
from geoimp_drake.robot_files.loading import LoadedRobot, load_robot
from geoimp_drake.simulation.style import figure_style, make_logarithmic
from geoimp_drake.systems.frame_motion import frame_motion_at_rest

Array = NDArray[np.float64]

STEP = 1e-3  # [s]
FORCE, OFFSET = 20.0, 1e-6  # at rest [N], of the wall from where the hand rests on it [m]
RADIUS = 0.02  # of the tip [m]
STIFFNESS = 700.0  # of the impedance [N/m]
NORMAL = 5  # the wall is below the hand


@dataclass(frozen=True)
class Point:
    """One contact: mass [kg], stiffness of the wall [N/m], delay of the wrench [s]."""

    mass: float
    wall: float
    delay: float

    def config(self, damping: float) -> ImpedanceControllerConfig:
        """Returns the controller's configuration with a damping of translation [Ns/m]."""
        config = ImpedanceControllerConfig(form="compiled", limits=None)
        config.sampling = SamplingConfig(velocity="differenced")
        translation, rotation = config.impedance.translation, config.impedance.rotation
        translation.mass, translation.damping = np.array(self.mass), np.array(damping)
        translation.stiffness, rotation.stiffness = np.array(STIFFNESS), np.array(20.0)
        return config

    @property
    def steps(self) -> int:
        """How long it takes until what rings is alone."""
        return 1500 if self.delay < 4e-3 else 4500

    def sensor(self) -> WristSensorConfig:
        """Returns that of the sensor."""
        return WristSensorConfig(delay=self.delay)


POINTS = [
    Point(*point)
    for point in (
        (1.0, 1e5, 1e-3),
        (1.0, 1e6, 1e-3),
        (2.0, 1e5, 2e-3),
        (2.0, 1e6, 2e-3),
        (1.0, 3e5, 2e-3),
        (2.0, 1e4, 4e-3),
        (2.0, 3e5, 4e-3),
        (9.0, 1e4, 4e-3),
        (4.0, 1e4, 9e-3),
        (9.0, 3e4, 9e-3),
        (2.0, 1e4, 19e-3),
        (9.0, 1e4, 19e-3),
    )
]


class Trial:
    """The six-joint arm of the library, whose hand presses on a wall in Drake's own contact."""

    def __init__(self) -> None:
        plant = MultibodyPlant(STEP)
        robot = _arm(plant)
        plant.Finalize()
        model = ControlModel.of_arm(plant, robot.model_instance, robot.end_effector_frame)
        self.q = model.in_plant_order(np.array(find_start_posture(model)))
        context = plant.CreateDefaultContext()
        plant.SetPositions(context, robot.model_instance, self.q)
        self.X_WE = robot.end_effector_frame.CalcPoseInWorld(context)
        plant.SetDefaultPositions(robot.model_instance, self.q)
        sensor = wrist_sensor_at(plant, robot.sensor_joint, robot.end_effector_frame)
        assert sensor.inertia is not None
        self.seen = sensor.inertia

    def loop(self, point: Point, damping: float) -> SampledLoop:
        """Returns the loop as Drake's plants have the wall."""
        config = point.config(damping)
        own = config.impedance, config.motion, config.sampling, point.sensor()
        wall = np.zeros((6, 6))
        wall[NORMAL, NORMAL] = point.wall
        return replace(sampled_loop(self.seen, *own), environment=wall)

    def predicted(self, point: Point) -> float:
        """Returns the smallest damping that does not ring [Ns/m]."""
        start = 4.0 * np.sqrt(point.mass * point.wall)
        low, _ = critical_damping(self.loop(point, start), slice(3, 6), either=False)
        return low * start

    def simulated(self, point: Point, near: float) -> float:
        """Returns the same by bisection of runs, to 0.2 %."""
        low, high = 0.9 * near, 1.1 * near
        while high > 1.002 * low:
            middle = np.sqrt(low * high)
            grows, _ = self.ring(point, middle)
            low, high = (middle, high) if grows > 1.0 else (low, middle)
        return float(np.sqrt(low * high))

    def ring(self, point: Point, damping: float) -> tuple[float, float]:
        """Returns by what the ringing grows in a step, and its frequency [Hz]."""
        force = self._run(point, damping)
        fifths = np.split(force[: point.steps], 5)
        early, late = _swinging(fifths[1]), _swinging(fifths[4])
        growth = float((np.ptp(late) / np.ptp(early)) ** (5.0 / (3.0 * point.steps)))
        if np.ptp(late) > FORCE:  # it has left the wall, and bounces
            growth = np.inf
        long = _swinging(force[2 * len(late) :])  # in a fifth there are hardly four swings
        crossings = np.flatnonzero((long[:-1] < 0.0) & (long[1:] >= 0.0))
        exact = crossings - long[crossings] / (long[crossings + 1] - long[crossings])
        frequency = (len(exact) - 1) / ((exact[-1] - exact[0]) * STEP) if len(exact) > 1 else 0.0
        return growth, frequency

    def _run(self, point: Point, damping: float) -> Array:
        """Returns the measured force along the wall's normal at each step."""
        builder = DiagramBuilder()
        plant, _ = AddMultibodyPlantSceneGraph(builder, STEP)
        plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
        robot = _arm(plant)
        arm, E = robot.model_instance, robot.end_effector_frame
        tip = E.GetFixedPoseInBodyFrame()
        plant.RegisterCollisionGeometry(E.body(), tip, Sphere(RADIUS), "tip", _touch(point.wall))
        height = self.X_WE.translation()[2] - RADIUS + FORCE / point.wall + OFFSET
        ground = RigidTransform([0.0, 0.0, height])
        rigid = _touch(1e6 * point.wall)
        plant.RegisterCollisionGeometry(plant.world_body(), ground, HalfSpace(), "wall", rigid)
        plant.Finalize()
        plant.SetDefaultPositions(arm, self.q)
        rest = np.array([0.0, 0.0, 0.0, 0.0, 0.0, -FORCE])
        sensor = wrist_sensor_at(plant, robot.sensor_joint, E, point.sensor(), initial_wrench=rest)
        controller = builder.AddSystem(
            make_impedance_controller(plant, arm, E, point.config(damping), sensor=sensor)
        )
        connect_wrist_sensors(builder, plant, controller)
        X_WD = RigidTransform(
            self.X_WE.rotation(), self.X_WE.translation() - [0.0, 0.0, FORCE / STIFFNESS]
        )
        D = builder.AddSystem(ConstantVectorSource(frame_motion_at_rest(X_WD)))
        builder.Connect(D.get_output_port(), controller.GetInputPort("desired_motion"))
        builder.Connect(
            plant.get_state_output_port(arm), controller.GetInputPort("estimated_state")
        )
        builder.Connect(controller.GetOutputPort("actuation"), plant.get_actuation_input_port(arm))
        log = LogVectorOutput(controller.GetOutputPort("wrench"), builder, STEP)
        simulator = Simulator(builder.Build())
        ApplySimulatorConfig(
            SimulatorConfig(
                integration_scheme="explicit_euler", max_step_size=STEP, use_error_control=False
            ),
            simulator,
        )
        simulator.AdvanceTo(point.steps * STEP)
        force: Array = log.FindLog(simulator.get_context()).data()[NORMAL]
        return force


def _arm(plant: MultibodyPlant) -> LoadedRobot:
    path = model_path("six_joint_arm")
    return load_robot(path, plant, end_effector="flange", geometry="leave-out")


def _swinging(force: Array) -> Array:
    """Returns what is left of a force beside its slow settling."""
    x = np.linspace(-1.0, 1.0, len(force))
    return force - np.polynomial.Chebyshev.fit(x, force, 5)(x)


def _touch(stiffness: float) -> ProximityProperties:
    """Returns the properties of a spring without damping and friction."""
    touch, none = ProximityProperties(), CoulombFriction(0.0, 0.0)
    AddContactMaterial(0.0, stiffness, none, touch)
    touch.AddProperty("material", "relaxation_time", 0.0)
    return touch


def frequency_of(loop: SampledLoop) -> float:
    """Returns that of what rings [Hz]."""
    modes = [mode for mode in modes_of(loop.poles()) if mode.ringing > 0.0]
    return modes[0].ringing / (2.0 * np.pi)


def main(out: Path) -> None:
    """Runs everything, prints the table and writes the figure."""
    logging.getLogger("drake").setLevel(logging.ERROR)
    trial = Trial()
    print("| M [kg] | wall [N/m] | delay [ms] | D: loop, simulated | Hz: loop, simulated |")
    said, seen = [], []
    for point in POINTS:
        said.append(trial.predicted(point))
        seen.append(trial.simulated(point, said[-1]))
        _, frequency = trial.ring(point, 0.99 * seen[-1])
        print(
            f"| {point.mass:g} | {point.wall:g} | {1e3 * point.delay:g} | {said[-1]:.4g}, "
            f"{seen[-1]:.4g} | {frequency_of(trial.loop(point, said[-1])):.4g}, {frequency:.4g} |"
        )
    with figure_style():
        figure = Figure(figsize=(5, 4.5), layout="constrained")
        axes = figure.subplots()
        ends = [0.8 * min(said), 1.25 * max(said)]
        axes.plot(ends, ends, color="#00000060", label="equal")
        axes.plot(said, seen, "o", color="#0072B2", label="12 contacts")
        make_logarithmic(axes, "x", "y")
        axes.set(xlabel="D by the sampled loop [Ns/m]", ylabel="D by the simulation [Ns/m]")
        axes.legend()
        figure.savefig(out)


if __name__ == "__main__":
    main(Path(__file__).resolve().parents[1] / "ringing.png")
