"""What a controller in an experiment's diagram was given at each tick, and what it returned."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator

from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.scene.cell import END_EFFECTOR
from geoimp_drake.typing import Array


@dataclass(frozen=True)
class Signals:
    """By tick; q, v, wrench and torques for each arm."""

    plant: MultibodyPlant
    scenario: Any
    desired: Array
    q: list[Array]
    v: list[Array]
    wrench: list[Array]
    torques: list[Array]

    def frame(self, arm: str, name: str = END_EFFECTOR) -> Frame:
        """Returns E of an arm."""
        return self.plant.GetFrameByName(name, self.plant.GetModelInstanceByName(f"{arm}_tool"))

    def at(self, k: int) -> tuple[Any, ...]:
        """Returns what two arms are given at a tick."""
        pairs = ([values[k] for values in both] for both in (self.q, self.v, self.wrench))
        return *pairs, self.desired[k]


def record(name: str, *layers: dict[str, Any], arms: Sequence[str] = (), ticks: int) -> Signals:
    """Runs the beginning of an experiment, in one system.

    Args:
        name: of the experiment.
        layers: of its scenario.
        arms: the two arms; that of the scenario by default.
        ticks: how many.
    """
    experiment = get_experiment(name)
    setup = experiment.build(experiment.scenario(({"form": "compiled"}, *layers)), logged=False)
    plant, scenario = setup.plant, setup.scenario
    [controller] = (s for s in setup.diagram.GetSystems() if s.get_name().endswith("_controller"))
    suffixes = [f"_{k}" for k in range(1, len(arms) + 1)] or [""]
    instances = [plant.GetModelInstanceByName(arm) for arm in arms or [scenario.arm]]
    source = setup.diagram.GetSubsystemByName("desired_motion")
    rows: list[list[Array]] = []

    def monitor(context: Any) -> None:
        own = controller.GetMyContextFromRoot(context)
        plant_context = plant.GetMyContextFromRoot(context)
        row = [source.get_output_port().Eval(source.GetMyContextFromRoot(context))]
        for instance, k in zip(instances, suffixes, strict=True):
            row += [
                plant.GetPositions(plant_context, instance),
                plant.GetVelocities(plant_context, instance),
                controller.GetOutputPort(f"wrench{k}").Eval(own),
                controller.GetOutputPort(f"actuation{k}").Eval(own),
            ]
        rows.append([value.copy() for value in row])

    simulator = Simulator(setup.diagram)
    ApplySimulatorConfig(scenario.simulator, simulator)
    simulator.set_monitor(monitor)
    simulator.AdvanceTo(ticks * 1e-3)
    D, *columns = [np.array(column) for column in zip(*rows, strict=True)]
    return Signals(plant, scenario, D, *(columns[k::4] for k in range(4)))
