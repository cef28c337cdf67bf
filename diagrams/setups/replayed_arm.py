"""Draws a drive's log like a run: the scenario's plant goes through the logged positions.

```
 log ──q──▶ plant ──▶ Meshcat ◀── D, C, E, wrench ── log
```
"""

from dataclasses import replace

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Context
from pydrake.systems.primitives import ConstantVectorSource

from geoimp_drake.diagrams.setups.setup_builder import SetupBuilder
from geoimp_drake.diagrams.setups.single_arm import add_single_arm
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.simulation.replay import start_recording
from geoimp_drake.typing import Array

__all__ = ["replay_log"]

_FRAMES = "DCE"


def replay_log(scenario: SingleArmScenario, log: dict[str, Array], meshcat: Meshcat) -> None:
    """Draws and records a log; whatever is unknown at an instant stays where it was.

    Args:
        scenario: the one that was driven.
        log: of the drive, by the keys of a run's log.
        meshcat: draws and records it.
    """
    scenario = replace(scenario, engine="drake")  # its plant is drawn, whatever has moved the arm
    setup = SetupBuilder(
        scenario, lambda plant: add_single_arm(plant, scenario), meshcat, live=False, logged=False
    )
    plant, name, (E, _) = setup.plant, scenario.arm, setup.models
    arm = plant.GetModelInstanceByName(name)
    keys = [*(f"{name}/motion_{frame}" for frame in _FRAMES), f"{name}/wrench"]
    sources = {
        key: setup.builder.AddSystem(ConstantVectorSource(_known(log[key])[0])) for key in keys
    }
    for key, source in sources.items():
        setup.recorder.record(key, source.get_output_port())
    positions = _known(log[f"{name}/q"])
    plant.SetDefaultPositions(arm, positions[0])
    setup.add_views(name, _FRAMES, sources[keys[-1]].get_output_port(), plant, E)
    if scenario.robot is not None:
        setup.frame_models(E)
    diagram = setup.build().diagram

    start_recording(meshcat)
    context = diagram.CreateDefaultContext()
    own = plant.GetMyMutableContextFromRoot(context)
    rows = {key: _known(log[key]) for key in keys}
    for k, time in enumerate(log["t"]):
        context.SetTime(time)
        plant.SetPositions(own, arm, positions[k])
        for key, source in sources.items():
            _show(source, context, rows[key][k])
        diagram.ForcedPublish(context)


def _show(source: ConstantVectorSource, context: Context, value: Array) -> None:
    own = source.GetMyMutableContextFromRoot(context)
    source.get_mutable_source_value(own).SetFromVector(value)


def _known(rows: Array) -> Array:
    """Returns rows; the one before, or the first finite one, replaces each that is not finite."""
    finite = np.isfinite(rows).all(axis=1)
    if not finite.any():
        return np.zeros_like(rows)
    last = np.maximum.accumulate(np.where(finite, np.arange(len(rows)), np.argmax(finite)))
    known: Array = rows[last]
    return known
