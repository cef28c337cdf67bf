"""Who holds an arm's weight, in a finished diagram: once is right, twice or not at all is not."""

from collections import defaultdict
from collections.abc import Iterator

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import Diagram, InputPortIndex, OutputPortIndex, System

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.systems.hand_over import HandOver
from geoimp_drake.systems.part_system import PartSystem
from geoimp_drake.systems.supervisor import Supervisor

__all__ = ["check_gravity"]

# The path of a system that is no diagram, and the number of one of its ports.
_Port = tuple[str, int]

# Drake's systems whose torques hold the weight.
_HOLDING = {"InverseDynamics", "InverseDynamicsController", "JointStiffnessController"}

# Drake's systems that let torques through: later, within limits or in another order.
_PASSING = {
    "Demultiplexer",
    "DiscreteTimeDelay",
    "FirstOrderLowPassFilter",
    "MatrixGain",
    "Multiplexer",
    "PassThrough",
    "PortSwitch",
    "Saturation",
    "SparseMatrixGain",
    "ZeroOrderHold",
}


def check_gravity(diagram: Diagram) -> None:
    """Checks that an arm under a controller of this library has its weight held exactly once.

    It follows the torques from the controllers' `actuation` to the plants that they drive. The path
    may lead through diagrams in the diagram, and through systems that hold, limit, order or switch
    the torques. On the path Drake's `InverseDynamics` may be added, as `SimIiwaDriver` and
    `MakeHardwareStation` do. Torques that go through other systems, or to which others are added,
    are not judged.

    Args:
        diagram: finished.

    Raises:
        ConfigurationError: a weight is held twice, or not at all.
    """
    wires = _Wires(diagram)
    for port, model in wires.controllers():
        holds = bool(model.plant.gravity_field().gravity_vector().any())
        for arm, helper in wires.driven(port):
            if holds == bool(helper):
                raise ConfigurationError(_contradiction(port[0], arm, helper))


def _contradiction(controller: str, arm: str, helper: str) -> str:
    where = f"'{controller}' drives '{arm}'"
    if helper:
        return (
            f"Gravity would be compensated twice: {where} through '{helper}', which holds its "
            f"weight, and was made with gravity='controller'. Make it with gravity='robot'."
        )
    return (
        f"Gravity would not be compensated: {where}, which has weight, and was made with "
        f"gravity='robot'. Make it with gravity='controller'."
    )


class _Wires:
    """The connections between systems; diagrams within the diagram are taken apart."""

    def __init__(self, diagram: Diagram):
        self._systems: dict[str, System] = {}
        self._targets: dict[_Port, list[_Port]] = defaultdict(list)
        self._sources: dict[_Port, _Port] = {}
        self._take_apart(diagram)

    def controllers(self) -> Iterator[tuple[_Port, ControlModel]]:
        """Returns where this library's controllers give torques, each with its model of the arm."""
        for path, system in self._systems.items():
            models = getattr(system.part, "models", []) if isinstance(system, PartSystem) else []
            for k, model in enumerate(models):
                name = "actuation" if len(models) == 1 else f"actuation_{k + 1}"
                yield (path, int(system.GetOutputPort(name).get_index())), model

    def driven(self, source: _Port) -> Iterator[tuple[str, str]]:
        """Returns the arms with weight that torques drive, each with what holds it on the path."""
        found, seen = [(source, "")], set()
        while found:
            port, helper = found.pop()
            for target in self._targets[port]:
                if (target, helper) not in seen:
                    seen.add((target, helper))
                    yield from ((arm, helper) for arm in self._arms(*target, helper))
                    found += self._beyond(*target, helper)

    def _beyond(self, path: str, port: int, helper: str) -> list[tuple[_Port, str]]:
        """Returns where torques come out again, and what holds the weight by then."""
        system = self._systems[path]
        if _type(system) == "Adder":
            helper = helper or self._holder(path, set())
            passes = bool(helper)  # else it adds what nobody knows
        else:
            passes = _passes(system, port)
        return [((path, k), helper) for k in range(system.num_output_ports()) if passes]

    def _arms(self, path: str, port: int, helper: str) -> list[str]:
        """Returns the arms with weight that torques drive, if the port is a plant's actuation.

        With other forces on the joints, and no holder on the path, there are none: these forces may
        hold the weight.
        """
        plant = self._systems[path]
        if not isinstance(plant, MultibodyPlant):
            return []
        forces = int(plant.get_applied_generalized_force_input_port().get_index())
        if not helper and (path, forces) in self._sources:
            return []
        return _arms_with_weight(plant, port)

    def _holder(self, path: str, seen: set[str]) -> str:
        """Returns which of the sources of a system holds the weight, empty for none."""
        seen.add(path)
        for k in range(self._systems[path].num_input_ports()):
            source = self._sources.get((path, k), ("", 0))[0]
            if source and source not in seen:
                system = self._systems[source]
                if _type(system) in _HOLDING:
                    return source
                if _type(system) in _PASSING and (holder := self._holder(source, seen)):
                    return holder
        return ""

    def _take_apart(self, diagram: Diagram) -> None:
        for system in diagram.GetSystems():
            if isinstance(system, Diagram):
                self._take_apart(system)
            else:
                self._systems[_path(system)] = system
        for (to, k), (of, out) in diagram.connection_map().items():
            source = _source(of, int(out))
            for target in _targets(to, int(k)):
                self._targets[source].append(target)
                self._sources[target] = source


def _source(system: System, port: int) -> _Port:
    """Returns where an output comes from, inside the diagrams that export it."""
    while isinstance(system, Diagram):
        system, index = system.get_output_port_locator(OutputPortIndex(port))
        port = int(index)
    return _path(system), port


def _targets(system: System, port: int) -> list[_Port]:
    """Returns where an input leads to, likewise."""
    if not isinstance(system, Diagram):
        return [(_path(system), port)]
    inner = system.GetInputPortLocators(InputPortIndex(port))
    return [target for to, k in inner for target in _targets(to, int(k))]


def _path(system: System) -> str:
    return str(system.GetSystemPathname()).partition("::")[2]


def _type(system: System) -> str:
    """Returns a class name of Drake's; `isinstance` depends on what has been imported."""
    return str(system.GetSystemType()).partition("<")[0].rpartition("::")[2]


def _passes(system: System, port: int) -> bool:
    """Whether what comes in by a port of a system goes out as torques."""
    if isinstance(system, HandOver | Supervisor):
        return system.get_input_port(port).get_name().startswith("torque")
    return _type(system) in _PASSING


def _arms_with_weight(plant: MultibodyPlant, port: int) -> list[str]:
    """Returns the names of the instances with weight that an actuation port drives."""
    if not plant.gravity_field().gravity_vector().any():
        return []
    every = plant.get_actuation_input_port().get_index()
    return [
        str(plant.GetModelInstanceName(instance))
        for instance in map(ModelInstanceIndex, range(plant.num_model_instances()))
        if plant.num_actuators(instance) and plant.is_gravity_enabled(instance)
        if port in (every, plant.get_actuation_input_port(instance).get_index())
    ]
