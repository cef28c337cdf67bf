"""Maps the smallest damping with which an admittance is stable on a wall.

python docs/validation/studies/admittance_stability.py
"""

import logging
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ExternallyAppliedSpatialForce
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.start_posture import find_start_posture
from geoimp_drake.arm.state import evaluate_arm
from geoimp_drake.controllers.admittance_controller import AdmittanceLoop, JointReference
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.errors import GeoimpError
from geoimp_drake.models import model_path
from geoimp_drake.parts.inverse_kinematics import ReferenceConfig
from geoimp_drake.robot_files.loading import load_robot
from geoimp_drake.simulation.style import figure_style
from geoimp_drake.systems.arm.industrial_controller import (
    IndustrialControllerConfig,
    make_industrial_controller,
)
from geoimp_drake.systems.frame_motion import frame_motion_at_rest

Array = NDArray[np.float64]

STEP = 1e-3  # of the plant [s]
K, DEPTH = 1000.0, 0.01  # of the impedance [N/m], of D in the wall [m]
D_O, K_O = 20.0, 40.0  # [Nms/rad, Nm/rad]
NORMAL = 5  # the wall is below the hand: along Z of a spatial vector
WALLS = np.geomspace(1e3, 1e5, 5)  # [N/m]
PERIODS = (1e-3, 2e-3, 4e-3, 8e-3)  # [s]
LOOK_AHEADS = (0.0, 10e-3, 30e-3)  # [s]
DAMPINGS = 25.0 * 2.0 ** np.arange(0.0, 11.01, 0.25)  # [Ns/m]


@dataclass(frozen=True)
class Point:
    """One contact.

    With a look-ahead the robot follows the first-order lag of what is streamed, one period late.
    """

    damping: float  # D [Ns/m]; M = 2 D Δt
    wall: float  # K_e [N/m]
    period: float  # Δt of references and servos [s]
    look_ahead: float = 0.0  # [s]

    @property
    def mass(self) -> float:
        """M [kg]."""
        return 2.0 * self.damping * self.period

    @property
    def inertia(self) -> float:
        """M_o [kg m²]."""
        return max(0.4, 2.0 * D_O * self.period)

    @property
    def share(self) -> float:
        """What the robot takes up of a reference in a period."""
        return 1.0 - np.exp(-self.period / self.look_ahead) if self.look_ahead else 1.0

    def config(self) -> ImpedanceControllerConfig:
        """Returns the controller's configuration."""
        config = ImpedanceControllerConfig(scheme="admittance")
        config.sampling.period = self.period
        translation, rotation = config.impedance.translation, config.impedance.rotation
        translation.mass, rotation.mass = np.array(self.mass), np.array(self.inertia)
        translation.damping, rotation.damping = np.array(self.damping), np.array(D_O)
        translation.stiffness, rotation.stiffness = np.array(K), np.array(K_O)
        return config


class Wall(LeafSystem):
    """Pushes E back along Z of W with K_e times its depth below a height."""

    def __init__(self, trial: "Trial", wall: float):
        super().__init__()
        self._trial, self._wall = trial, wall
        self.DeclareVectorInputPort("state", trial.plant.num_multibody_states())
        self.DeclareAbstractOutputPort(
            "forces", lambda: AbstractValue.Make([ExternallyAppliedSpatialForce()]), self._calc
        )

    def _calc(self, context: Context, output: Any) -> None:
        state = self.get_input_port().Eval(context)
        push, E = ExternallyAppliedSpatialForce(), self._trial.E
        push.body_index = E.body().index()
        push.p_BoBq_B = E.GetFixedPoseInBodyFrame().translation()
        push.F_Bq_W = SpatialForce(np.zeros(3), [0.0, 0.0, -self._trial.force(state, self._wall)])
        output.set_value([push])


class Trial:
    """The six-joint arm on its servos, whose hand rests on a wall."""

    def __init__(self) -> None:
        self._builder, plant = self._new_plant()
        self.model = ControlModel.of_arm(plant, self.arm, self.E)
        self.q = np.array(find_start_posture(self.model))
        x = np.concatenate((self.q, np.zeros_like(self.q)))
        self.state = evaluate_arm(self.model, self.model.plant.CreateDefaultContext(), x)
        self.servos = IndustrialControllerConfig()

    def _new_plant(self) -> tuple[DiagramBuilder, Any]:
        builder = DiagramBuilder()
        self.plant, _ = AddMultibodyPlantSceneGraph(builder, STEP)
        robot = load_robot(
            model_path("six_joint_arm"), self.plant, end_effector="flange", geometry="leave-out"
        )
        self.plant.Finalize()
        self.arm, self.E = robot.model_instance, robot.end_effector_frame
        self._kinematics = self.plant.CreateDefaultContext()
        return builder, self.plant

    def force(self, state: Array, wall: float) -> float:
        """Returns f by E on the wall along Z of W, at most zero [N]."""
        self.plant.SetPositionsAndVelocities(self._kinematics, state)
        height = self.E.CalcPoseInWorld(self._kinematics).translation()[2]
        return min(0.0, float(wall * (height - self.state.p_WE[2])))

    def predicted(self, point: Point) -> float:
        """Returns the growth in a period: the spectral radius of the loop on the wall."""
        return float(np.abs(np.linalg.eigvals(self._matrix(point))).max())

    def _matrix(self, point: Point) -> Array:
        """Returns what a period does to all deviations from rest, by columns."""
        n, J, B = len(self.q), self.state.Jv_V_WE, self.state.B
        J_pinv, B_inverse = np.linalg.pinv(J), np.linalg.inv(B)
        F, servo = self.model.viscous_friction, self.servos
        kp = np.diag(B) * servo.bandwidth**2
        kd, ki = 2.0 * servo.damping / servo.bandwidth * kp, servo.integral_rate * kp
        wall = np.zeros((6, 6))
        wall[NORMAL, NORMAL] = point.wall
        M, D, k = (np.repeat(pair, 3) for pair in self._gains(point))
        gain, late = ReferenceConfig().gain, bool(point.look_ahead)

        def period(s: Array) -> Array:
            q, v, z, q_d, q_s, v_s, q_f, v_f, x, V = s.reshape(10, n, -1)
            h = wall @ J @ q
            # The reference follows C of before, then C moves on.
            v_d = J_pinv @ (V + gain * (x - J @ q_d))
            q_d = q_d + point.period * v_d
            x, V = (
                x + point.period * V,
                V + point.period * ((-h.T - D * V.T - k * x.T) / M).T,
            )
            new = (q_s, v_s) if late else (q_d, v_d)
            q_f = q_f + point.share * (new[0] - q_f)
            v_f = v_f + point.share * (new[1] - v_f)
            e = q_f - q
            tau = (kp * e.T).T + (kd * (v_f - v).T).T + z
            z = z + point.period * (ki * e.T).T
            for _ in range(round(point.period / STEP)):
                v = v + STEP * B_inverse @ (tau - (F * v.T).T - J.T @ wall @ J @ q)
                q = q + STEP * v
            return np.concatenate((q, v, z, q_d, q_d, v_d, q_f, v_f, x, V))

        return period(np.eye(10 * n))

    def _gains(self, point: Point) -> Array:
        """Returns masses, dampings and stiffnesses of rotation and translation (3, 2)."""
        return np.array([[point.inertia, point.mass], [D_O, point.damping], [K_O, K]])

    def least(self, growth: Callable[[Point], float], **contact: float) -> float:
        """Returns the smallest damping from which on all up to the largest are stable."""
        unstable = [D for D in DAMPINGS if growth(Point(D, **contact)) > 1.0]
        above = DAMPINGS[len(unstable) and list(DAMPINGS).index(unstable[-1]) + 1 :]
        return float(above[0]) if len(above) else np.inf

    def pressed(self, point: Point, duration: float = 3.0) -> Array:
        """Returns the force on the wall at every period, in time [N]; up to where C diverges."""
        builder, plant = self._new_plant()
        plant.SetDefaultPositions(self.arm, self.model.in_plant_order(self.q))
        servos = IndustrialControllerConfig(period=point.period)
        servo = builder.AddSystem(make_industrial_controller(plant, self.arm, self.E, None, servos))
        wall = builder.AddSystem(Wall(self, point.wall))
        state = plant.get_state_output_port()
        builder.Connect(
            plant.get_state_output_port(self.arm), servo.GetInputPort("estimated_state")
        )
        builder.Connect(servo.GetOutputPort("actuation"), plant.get_actuation_input_port(self.arm))
        builder.Connect(state, wall.get_input_port())
        builder.Connect(wall.get_output_port(), plant.get_applied_spatial_force_input_port())
        builder.ExportInput(servo.GetInputPort("joint_reference"), "joint_reference")
        simulator = Simulator(builder.Build())
        return self._press(simulator, point, duration)

    def _press(self, simulator: Simulator, point: Point, duration: float) -> Array:
        loop = AdmittanceLoop(self.plant, self.arm, self.E, point.config())
        context = simulator.get_mutable_context()
        plant_context = self.plant.GetMyContextFromRoot(context)
        port = simulator.get_system().GetInputPort("joint_reference")
        X_WD = RigidTransform([0.0, 0.0, -DEPTH]) @ loop.pose(self.q)
        desired, still = frame_motion_at_rest(X_WD), np.zeros_like(self.q)
        robot = _Robot(point, loop.reset(self.q, still))
        port.FixValue(context, loop.joints.reading(*robot.last))
        simulator.Initialize()
        forces: list[float] = []
        for k in range(round(duration / point.period)):
            state = self.plant.GetPositionsAndVelocities(plant_context)
            forces.append(-self.force(state, point.wall))
            q, v = loop.joints.split(state)
            wrench = np.zeros(6)
            wrench[NORMAL] = -forces[-1]
            try:
                reference = loop.step(q, v, wrench, desired)
                port.FixValue(context, loop.joints.reading(*robot.follow(reference)))
                simulator.AdvanceTo((k + 1) * point.period)
            except (GeoimpError, RuntimeError):
                return np.append(forces, np.inf)
        return np.array(forces)

    def rests(self, point: Point) -> bool:
        """Whether the hand stays on the wall: what is unstable ends in bouncing."""
        force = self.pressed(point)
        last = force[-len(force) // 6 :]
        return bool(np.isfinite(last).all() and last.min() > 0.0)


class _Robot:
    """What a robot makes of streamed references."""

    def __init__(self, point: Point, start: JointReference):
        self._share, self.last = point.share, np.array(start)
        self._queue = deque([self.last] * bool(point.look_ahead))

    def follow(self, reference: JointReference) -> Array:
        """Returns what the servos are given now, [q_d, q̇_d] (2, n)."""
        self._queue.append(np.array(reference))
        self.last = self.last + self._share * (self._queue.popleft() - self.last)
        return self.last


def around(damping: float, contact: dict[str, float]) -> list[Point]:
    """Returns points below and above the border; none below the smallest damping of the map."""
    below = [0.75] if damping > DAMPINGS[0] else []
    return [Point(factor * damping, **contact) for factor in (*below, 1.5)]


def label(axes: Any) -> None:
    """Writes plain numbers at the ticks: the figures' style writes no formulas."""
    for axis, ticks in (
        (axes.xaxis, [(1e3, "10³"), (1e4, "10⁴"), (1e5, "10⁵")]),
        (axes.yaxis, [(D, str(D)) for D in (25, 50, 100, 200, 400)]),
    ):
        axis.set_ticks([at for at, _ in ticks], labels=[text for _, text in ticks])
        axis.set_minor_locator(NullLocator())


def main(out: Path) -> None:
    """Prints the table, checks it by simulation, and draws the figure."""
    logging.getLogger("drake").setLevel(logging.ERROR)
    trial = Trial()
    agree = total = 0
    with figure_style():
        figure = Figure(figsize=(9, 3.8), layout="constrained")
        for axes, look_ahead in zip(figure.subplots(1, 3, sharey=True), LOOK_AHEADS, strict=True):
            axes.set_title(f"look-ahead {1e3 * look_ahead:g} ms")
            axes.set_xlabel("stiffness of the wall [N/m]")
            for period in PERIODS:
                line = []
                for wall in WALLS:
                    contact = {"wall": wall, "period": period, "look_ahead": look_ahead}
                    line.append(trial.least(trial.predicted, **contact))
                    for point in around(line[-1], contact):
                        said, seen = trial.predicted(point) <= 1.0, trial.rests(point)
                        agree, total = agree + (said == seen), total + 1
                        if said != seen:
                            print(f"{point}: predicted {said}, simulated {seen}", flush=True)
                axes.loglog(WALLS, line, "-", label=f"a reference every {1e3 * period:g} ms")
                row = " | ".join(f"{D:.0f}" for D in line)
                print(f"| {1e3 * look_ahead:g} | {1e3 * period:g} | {row} |", flush=True)
        for axes in figure.axes:
            label(axes)
        figure.axes[0].set_ylabel("smallest stable D [Ns/m]")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)
        figure.savefig(out)
    print(f"{agree} of {total} points agree with the simulation")


if __name__ == "__main__":
    main(Path(__file__).parents[1] / "admittance.png")
