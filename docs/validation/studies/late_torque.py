"""Maps where an impedance on a momentum observer is stable if torques act a tick late.

python docs/validation/studies/late_torque.py
"""

import logging
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from numpy.typing import NDArray
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.start_posture import find_start_posture
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.controllers.observer_checks import observed_loop
from geoimp_drake.errors import GeoimpError
from geoimp_drake.models import model_path
from geoimp_drake.parts.momentum_observer import MomentumObserver, MomentumObserverConfig
from geoimp_drake.parts.part_loop import PartLoop
from geoimp_drake.robot_files.loading import load_robot
from geoimp_drake.robots.plant_arm import PlantArm
from geoimp_drake.simulation.style import figure_style
from geoimp_drake.systems.frame_motion import frame_motion_at_rest

MODELS = ("six_joint_arm", "seven_joint_arm")
GAINS = np.geomspace(25.0, 800.0, 11)  # of the observer [1/s]
MASSES = np.geomspace(1.0, 100.0, 17)  # [kg]; a hundredth of each in kg m²
TICKS, TICK = 300, 1e-3
STEP = RigidTransform([1e-5, -1e-5, 2e-5])  # of D at the start [m]
DIVERGED = 100.0  # [N, Nm]: it began with less than 0.1
# What of the motion tells growth from decay: a tenth at the end, and one before it.
EARLY, LATE = slice(-120, -90), slice(-30, None)


@dataclass(frozen=True)
class Impedance:
    """Masses of C; it is damped at 20/s and 10/s and has its springs at 5 and 3 rad/s."""

    mass: float  # [kg]
    inertia: float  # [kg m²]

    def config(self) -> ImpedanceControllerConfig:
        """Returns the controller's configuration."""
        config = ImpedanceControllerConfig()
        config.limits = None  # which would end the growth that is to be seen
        translation, rotation = config.impedance.translation, config.impedance.rotation
        for gains, mass, rate in ((translation, self.mass, 20.0), (rotation, self.inertia, 10.0)):
            gains.mass, gains.damping = np.array(mass), np.array(rate * mass)
            gains.stiffness = np.array(rate * mass)
        return config


class Trial:
    """An arm that rests in a posture, whose D is moved by 0.02 mm.

    Args:
        path: of the robot's file.
        frame: E.
    """

    def __init__(self, path: Path | str, frame: str):
        builder = DiagramBuilder()
        self.plant, _ = AddMultibodyPlantSceneGraph(builder, TICK)
        robot = load_robot(path, self.plant, end_effector=frame, geometry="leave-out")
        self.plant.Finalize()
        self.arm, self.E = robot.model_instance, robot.end_effector_frame
        self.model = ControlModel.of_arm(self.plant, self.arm, self.E, gravity=False)
        self.q = np.array(find_start_posture(self.model))
        self.plant.SetDefaultPositions(self.arm, self.model.in_plant_order(self.q))
        self.diagram = builder.Build()

    def predicted(self, impedance: Impedance, gain: float, **late: bool) -> float:
        """Returns the growth in a tick by the linear model; see `ObservedLoop.growth`."""
        observer = MomentumObserverConfig(gain=gain)
        return observed_loop(self.model, self.q, impedance.config(), observer).growth(**late)

    def simulated(
        self, impedance: Impedance, gain: float, acts_late: bool = True, believed_late: bool = False
    ) -> float:
        """Returns the same as the observed wrench shows it; infinite if that diverges."""
        wrench = self._run(impedance, gain, acts_late, believed_late)
        if wrench[-1] > DIVERGED:
            return np.inf
        return float((wrench[LATE].max() / wrench[EARLY].max()) ** (1.0 / 90.0))

    def _run(
        self, impedance: Impedance, gain: float, acts_late: bool, believed_late: bool
    ) -> NDArray[np.float64]:
        """Returns the largest component of the observed wrench over the ticks."""
        robot = PlantArm(self.diagram, self.plant, self.arm, gravity="robot")
        own, joints = (self.plant, self.arm, self.E, impedance.config()), robot.joints
        loop = ControlLoop(*own, gravity="robot", joints=joints)
        part = MomentumObserver(loop.model, MomentumObserverConfig(gain=gain), TICK)
        observer, status = PartLoop(part, "observer"), robot.connect()
        desired = frame_motion_at_rest(loop.pose(status.q) @ STEP)
        loop.reset(status.q, status.v, None, desired)
        last = before = np.zeros(len(joints))
        robot.write(last)
        observer.reset(_seen(loop, status, last))
        wrench: list[float] = []
        while len(wrench) < TICKS and (not wrench or wrench[-1] < DIVERGED):
            status = robot.read()
            observer.step(_seen(loop, status, before if believed_late else last), {}, TICK)
            h = observer.output("wrench")
            wrench.append(float(np.abs(h).max()))
            try:
                torque = loop.step(status.q, status.v, h, desired).copy()
            except GeoimpError:  # C has diverged
                return np.array([np.inf])
            last, before = torque, last
            robot.write(before if acts_late else last)
        return np.array(wrench)


def _seen(loop: ControlLoop, status: Any, torque: NDArray[np.float64]) -> dict[str, Any]:
    reading = loop.joints.reading(status.q, status.v)
    return {"estimated_state": reading, "torque": loop.joints.actuation(torque)}


def border(growth: Any, low: float, high: float) -> float:
    """Returns at which size `growth` passes one on its way down, to half a percent."""
    while high > 1.005 * low:
        middle = np.sqrt(low * high)
        low, high = (middle, high) if growth(middle) > 1.0 else (low, middle)
    return float(np.sqrt(low * high))


def main(out: Path) -> None:
    """Runs everything, prints the table and writes the figure."""
    logging.getLogger("drake").setLevel(logging.ERROR)  # torques of what diverges saturate
    with figure_style():
        figure = Figure(figsize=(9, 7.2), layout="constrained")
        for row, name in zip(figure.subplots(2, 2), MODELS, strict=True):
            trial = Trial(model_path(name), "flange")
            apparent = np.linalg.inv(_mobility(trial))
            print(f"\n{name}: Λ has the eigenvalues {np.linalg.eigvalsh(apparent).round(3)}")
            draw(row[0], trial, f"{name}, M_o = 4 kg m²", "mass", "M [kg]", 1.0)
            draw(row[1], trial, f"{name}, M = 100 kg", "inertia", "M_o [kg m²]", 1e-2)
        figure.legend(*row[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
        figure.savefig(out)


def _mobility(trial: Trial) -> NDArray[np.float64]:
    loop = observed_loop(
        trial.model, trial.q, ImpedanceControllerConfig(), MomentumObserverConfig()
    )
    return loop.mobility


def draw(axes: Any, trial: Trial, title: str, varied: str, label: str, scale: float) -> None:
    """Draws points of the simulation and the border of the model; prints how they agree."""
    others = Impedance(100.0, 4.0)
    gains, sizes = (grid.ravel() for grid in np.meshgrid(GAINS, scale * MASSES))
    at = [replace(others, **{varied: float(size)}) for size in sizes]
    said = np.array([trial.predicted(p, g) for p, g in zip(at, gains, strict=True)])
    seen = np.array([trial.simulated(p, g) for p, g in zip(at, gains, strict=True)])
    agree = (said > 1.0) == (seen > 1.0)
    print(f"{title}: {agree.sum()} of {len(agree)} points agree")
    stable = seen <= 1.0
    axes.loglog(gains[stable], sizes[stable], "o", color="#0072B2", label="comes to rest")
    axes.loglog(gains[~stable], sizes[~stable], "x", color="#D55E00", label="diverges")
    ends, line = (0.1 * sizes.min(), 10.0 * sizes.max()), []
    for gain in GAINS:
        both = [
            border(lambda m, f=f, g=gain: f(replace(others, **{varied: float(m)}), g), *ends)
            for f in (trial.predicted, trial.simulated)
        ]
        line.append(both[0])
        print(f"| {gain:.0f} | {both[0]:.3g} | {both[1]:.3g} | {both[0] / both[1] - 1.0:+.1%} |")
    axes.loglog(GAINS, line, "-", color="#666666", label="border of the linear model")
    axes.set_ylim(0.8 * sizes.min(), 1.25 * sizes.max())
    # The figures' style writes no formulas, powers of ten included.
    for axis, ticks in (
        (axes.xaxis, GAINS[::2]),
        (axes.yaxis, scale * np.array([1, 3, 10, 30, 100])),
    ):
        axis.set_ticks(ticks, labels=[f"{tick:.3g}" for tick in ticks])
        axis.set_minor_locator(NullLocator())
    axes.set_title(title)
    axes.set_xlabel("observer gain [1/s]")
    axes.set_ylabel(label)


if __name__ == "__main__":
    main(Path(__file__).parents[1] / "late_torque.png")
