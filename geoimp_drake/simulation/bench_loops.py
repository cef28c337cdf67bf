"""The loops that a bench times: closed ones, and their plants alone or under Drake's controller."""

from collections.abc import Callable, Iterator
from typing import Any

from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.controllers import InverseDynamicsController
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, System
from pydrake.systems.primitives import ConstantVectorSource

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.systems.arm.arm_model import ArmModel
from geoimp_drake.systems.part_system import PartSystem
from geoimp_drake.typing import Array

__all__ = ["bare_plant", "closed_loop", "under_drakes_controller"]


def closed_loop(
    experiment: Any, start: float, form: str, *, logged: bool
) -> tuple[Simulator, Any, Any]:
    """Returns a closed loop, advanced to a time: its simulator, set-up and context.

    Args:
        experiment: of the catalogue.
        start: the time [s].
        form: of the controller.
        logged: with the experiment's own logging.
    """
    setup = experiment.build(experiment.scenario(({"form": form},)), logged=logged)
    simulator = Simulator(setup.diagram)
    ApplySimulatorConfig(setup.scenario.simulator, simulator)
    simulator.AdvanceTo(start)
    return simulator, setup, simulator.get_context()


def bare_plant(setup: Any, context: Context, window: float) -> Callable[[], None]:
    """Returns a function that advances the plant alone by a window [s], from the loop's state."""
    builder = DiagramBuilder()
    plant: MultibodyPlant = setup.add_plant(builder)
    torque: Array = setup.plant.get_net_actuation_output_port().Eval(
        setup.plant.GetMyContextFromRoot(context)
    )
    source = builder.AddNamedSystem("holding_torque", ConstantVectorSource(torque))
    builder.Connect(source.get_output_port(), plant.get_actuation_input_port())
    return _from_state_of(setup, context, builder, plant, window)


def under_drakes_controller(
    setup: Any, context: Context, window: float
) -> Callable[[], None] | None:
    """Returns the same with Drake's inverse dynamics controller for each arm, None if impossible.

    That controller takes the arm's state in its own model's order.
    """
    builder = DiagramBuilder()
    plant: MultibodyPlant = setup.add_plant(builder)
    plant_context = setup.plant.GetMyContextFromRoot(context)
    driven = 0
    for model in _arm_models(setup.diagram):
        n = model.num_joints
        arm = plant.GetModelInstanceByName(
            model.plant.GetModelInstanceName(model.end_effector.model_instance())
        )
        if list(model.state_order) != list(range(2 * n)):
            return None
        driven += n
        controller = builder.AddSystem(
            InverseDynamicsController(model.plant, [100.0] * n, [0.0] * n, [20.0] * n, False)
        )
        desired = setup.plant.GetPositionsAndVelocities(plant_context, arm) * (
            [1.0] * n + [0.0] * n
        )
        source = builder.AddSystem(ConstantVectorSource(desired))
        builder.Connect(source.get_output_port(), controller.get_input_port_desired_state())
        builder.Connect(
            plant.get_state_output_port(arm), controller.get_input_port_estimated_state()
        )
        builder.Connect(controller.get_output_port_control(), plant.get_actuation_input_port(arm))
    if driven != plant.num_actuators():
        return None
    return _from_state_of(setup, context, builder, plant, window)


def _arm_models(diagram: Diagram) -> Iterator[ControlModel]:
    """Yields the control models of the arms anywhere in a diagram."""
    system: System
    for system in diagram.GetSystems():
        if isinstance(system, ArmModel):
            yield system.model
        elif isinstance(system, PartSystem):
            yield from getattr(system.part, "models", ())
        elif isinstance(system, Diagram):
            yield from _arm_models(system)


def _from_state_of(
    setup: Any, context: Context, builder: DiagramBuilder, plant: MultibodyPlant, window: float
) -> Callable[[], None]:
    """Returns a function that advances a diagram by a window, from the closed loop's state."""
    simulator = Simulator(builder.Build())
    plant_context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    state = setup.plant.GetPositionsAndVelocities(setup.plant.GetMyContextFromRoot(context))

    def run() -> None:
        simulator.get_mutable_context().SetTime(0.0)
        plant.SetPositionsAndVelocities(plant_context, state)
        simulator.Initialize()
        simulator.AdvanceTo(window)

    return run
