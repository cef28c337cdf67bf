"""A scenario as Drake objects, ready to be simulated."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant
from pydrake.systems.framework import Diagram, DiagramBuilder

from geoimp_drake.laws.prediction.sampled_loop import SampledLoop
from geoimp_drake.simulation.recorder import Recorder
from geoimp_drake.simulation.run import Event

__all__ = ["Setup"]


@dataclass
class Setup:
    """A set-up that is built.

    Attributes:
        scenario: with its open fields (start postures, duration) filled in.
        diagram: to be simulated.
        plant: in the diagram.
        recorder: of the log.
        add_models: fills another plant like this one.
        events: what happens to the diagram from outside during the run.
        loop: of the compliant hand at the start, with the surface as its environment; None if the
            scheme has no such loop.
    """

    scenario: Any
    diagram: Diagram
    plant: MultibodyPlant
    recorder: Recorder
    add_models: Callable[[MultibodyPlant], object]
    events: list[Event] = field(default_factory=list, kw_only=True)
    loop: SampledLoop | None = field(default=None, kw_only=True)

    def add_plant(self, builder: DiagramBuilder) -> MultibodyPlant:
        """Adds the plant of this set-up alone to another builder, and returns it."""
        plant, _ = AddMultibodyPlant(self.scenario.plant, builder)
        self.add_models(plant)
        return plant
