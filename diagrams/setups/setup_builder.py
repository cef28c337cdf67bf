"""The common parts of all set-ups: cell, desired motion, external wrench, log and views."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Generic, TypeVar

from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex
from pydrake.systems.framework import DiagramBuilder, OutputPort, System

from geoimp_drake.analysis.report import ringing_warning
from geoimp_drake.controllers.gravity_check import check_gravity
from geoimp_drake.diagrams.scene.surface import surface_plane
from geoimp_drake.diagrams.scene.surface_placement import SurfacePlacement
from geoimp_drake.diagrams.setups.run_settings import RunSettings
from geoimp_drake.diagrams.setups.setup import Setup
from geoimp_drake.diagrams.setups.true_plant import TruePlant
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.prediction.sampled_loop import SampledLoop
from geoimp_drake.robot_files.collision_filters import filter_neighbours
from geoimp_drake.robot_files.preflight import warn_before_run
from geoimp_drake.simulation.live import add_live_controls
from geoimp_drake.simulation.recorder import Recorder
from geoimp_drake.simulation.run import Event
from geoimp_drake.simulation.visualization import add_visualization, frame_models
from geoimp_drake.systems.sources.desired_motion import DesiredMotion, MotionSegment
from geoimp_drake.systems.sources.external_wrench import ExternalWrench, WrenchRamp
from geoimp_drake.typing import Array
from geoimp_drake.validation import check

__all__ = ["SetupBuilder"]

_log = logging.getLogger("drake")

Models = TypeVar("Models")


class SetupBuilder(Generic[Models]):
    """A set-up under construction; its diagram begins with the plant and ends with the log.

    Args:
        scenario: is checked; its open fields are filled in.
        add_models: fills a plant with the contents of the cell and finalizes it.
        meshcat: draws the run; None for no drawing.
        live: add sliders there.
        logged: whether to add the log. Without it, for a loop that is timed, the parts that only
            log and Meshcat need are missing, too. With Meshcat there is always a log.

    Attributes:
        builder: of the diagram.
        plant: the diagram's, finalized.
        models: the result of `add_models` for the plant.
        true_plant: the same plant, as changed by the scenario's world.
        recorder: of the log.
        is_logged: whether signals are to be recorded.
        is_another_world: whether the plant differs from the controller's model.

    Raises:
        ConfigurationError: the scenario cannot be used; the message says why.
    """

    def __init__(
        self,
        scenario: RunSettings,
        add_models: Callable[[MultibodyPlant], Models],
        meshcat: Meshcat | None,
        *,
        live: bool,
        logged: bool,
    ):
        check(scenario)
        if scenario.engine != "drake":
            raise ConfigurationError(
                f"engine is '{scenario.engine}', which only geoimp run and geoimp compare "
                f"use; leave it out here."
            )
        self._scenario, self._add_models = scenario, add_models
        self._meshcat, self._live, self._pushes = meshcat, live, False
        self.builder = DiagramBuilder()
        self.plant, self._scene_graph = AddMultibodyPlant(scenario.plant, self.builder)
        self.models = add_models(self.plant)
        self.true_plant = TruePlant(self.plant, self.builder, scenario.world, scenario.seed)
        filter_neighbours(self.plant, self._scene_graph)
        self.recorder = Recorder(self.builder, scenario.log_period)
        self.is_logged = logged or meshcat is not None
        self.is_another_world = not scenario.world.is_none()

    def warn_of_start(self, arm: ModelInstanceIndex, E: Frame) -> None:
        """Warns of problems of an arm at its default positions, see `warn_before_run`."""
        warn_before_run(self.plant, arm, E, self._scene_graph)

    def add_desired_motion(
        self, X_WD: RigidTransform, segments: Sequence[MotionSegment] = ()
    ) -> OutputPort:
        """Adds the desired motion, which gives the run its length unless the scenario does."""
        desired = self.builder.AddNamedSystem("desired_motion", DesiredMotion(X_WD, segments))
        if self._scenario.duration is None:
            self._scenario.duration = desired.duration()
        return desired.GetOutputPort("motion")

    def add_external_wrench(
        self, frame: Frame, R_WF: RotationMatrix, ramp: WrenchRamp | None
    ) -> None:
        """Adds the external wrench on a frame F, with axes R_WF at the start; None adds nothing."""
        if ramp is None:
            return
        wrench = self.builder.AddNamedSystem(
            "external_wrench", ExternalWrench(frame, ramp, R_WF.matrix())
        )
        self.push(wrench.get_output_port())

    def push(self, wrench: OutputPort) -> None:
        """Applies the only wrench on the plant: a list of ExternallyAppliedSpatialForce."""
        self.builder.Connect(wrench, self.plant.get_applied_spatial_force_input_port())
        self._pushes = True

    def record_surface(self, surface: SurfacePlacement | None, disk: Array) -> None:
        """Puts a surface into the log, and the disk's centre in the frame whose motion is D (3)."""
        if surface is not None:
            self.recorder.constant("surface/plane", surface_plane(surface.pose()))
            self.recorder.constant("surface/disk", disk)

    def add_views(
        self, name: str, frames: str, wrench: OutputPort, controller: System, pushed: Frame
    ) -> None:
        """Adds the views of Meshcat and, if the run is live, its controls.

        Args:
            name: the one under which the motions of the frames are logged.
            frames: those to draw, a letter each; the wrench is drawn at the last.
            wrench: [moment; force] on the environment in W (6).
            controller: the one whose stiffness can be changed.
            pushed: frame at whose origin the hand can be pushed, unless an external wrench does.
        """
        if self._meshcat is None:
            return
        step = self._scenario.plant.time_step or self._scenario.log_period
        add_visualization(
            self.builder,
            self._scene_graph,
            self._meshcat,
            self.plant,
            frames={frame: self.recorder.port(f"{name}/motion_{frame}") for frame in frames},
            wrench=wrench,
            at=frames[-1],
            step=step,
        )
        if self._live:
            push = not self._pushes
            add_live_controls(
                self.builder, self._meshcat, self.plant, controller, pushed, push=push, step=step
            )

    def frame_models(self, E: Frame) -> None:
        """Points Meshcat's camera at the models instead of where the cell's arm would be."""
        if self._meshcat is not None:
            frame_models(self._meshcat, self.plant, self._scene_graph, E)

    def build(
        self,
        events: Sequence[Event] = (),
        loop: SampledLoop | None = None,
        surface: SurfacePlacement | None = None,
        hands: int = 1,
    ) -> Setup:
        """Returns the set-up; warns if the loop rings on its surface.

        Args:
            events: happen to its diagram from outside during the run.
            loop: of the compliant hand, in free space.
            surface: the one that it touches.
            hands: number of hands that press on it together.
        """
        if loop is not None and surface is not None:
            K_e, D_e = (value / hands for value in surface.resistance())
            loop = replace(loop, environment=K_e, environment_damping=D_e)
            if warning := ringing_warning(loop):
                _log.warning(f"{self._scenario.experiment}: {warning}")
        if self.is_another_world:
            self.true_plant.record(self.recorder)
            events = [Event(0.0, self.true_plant.apply), *events]
        diagram = self.recorder.build()
        check_gravity(diagram)
        return Setup(
            self._scenario,
            diagram,
            self.plant,
            self.recorder,
            self._add_models,
            events=list(events),
            loop=loop,
        )
