"""Linearizes a closed loop about a state, by AutoDiff through plant and blocks."""

from collections.abc import Iterator

import numpy as np
from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, Diagram, InputPort, OutputPort, System
from pydrake.systems.primitives import LinearSystem

from geoimp_drake.errors import ConversionError, drake_errors

__all__ = ["linearize"]


def linearize(
    system: System,
    context: Context,
    input_port: InputPort | None = None,
    output_port: OutputPort | None = None,
) -> LinearSystem:
    """Returns A, B, C, D of ẋ = f(x, u), y = h(x, u) about a context.

    Drake's own `Linearize` refuses systems that have discrete state beside the continuous one.
    Blocks have such state for their memory from step to step. Here it is held constant.

    Args:
        system: a continuous diagram or system, of blocks and of Drake's own.
        context: its context; ports that are not `input_port` are connected or fixed.
        input_port: u, of vectors, fixed in the context; none by default.
        output_port: y, of vectors; none by default.

    Raises:
        ConversionError: a part of it samples, is discrete or hydroelastic, or exists for float
            only.
    """
    for part in _leaves(system):
        _check(part)
    raised = (RuntimeError, TypeError)
    with drake_errors(ConversionError, f"'{system.get_name()}' cannot be linearized", raised):
        converted = system.ToAutoDiffXd()
        at = converted.CreateDefaultContext()
        at.SetTimeStateAndParametersFrom(context)
        converted.FixInputPortsFrom(system, context, at)
        x = context.get_continuous_state_vector().CopyToVector()
        u = np.zeros(0) if input_port is None else input_port.Eval(context)
        variables = InitializeAutoDiff(np.concatenate((x, u))).ravel()
        at.SetContinuousState(variables[: len(x)])
        if input_port is not None:
            converted.get_input_port(input_port.get_index()).FixValue(at, variables[len(x) :])
        values = [converted.EvalTimeDerivatives(at).CopyToVector()]
        if output_port is not None:
            values.append(converted.get_output_port(output_port.get_index()).Eval(at))
    n = len(x)
    gradient = np.zeros((sum(map(len, values)), len(variables)))
    found = ExtractGradient(np.concatenate(values).reshape(-1, 1))
    gradient[:, : found.shape[1]] = found
    return LinearSystem(gradient[:n, :n], gradient[:n, n:], gradient[n:, :n], gradient[n:, n:])


def _leaves(system: System) -> Iterator[System]:
    if not isinstance(system, Diagram):
        yield system
        return
    for part in system.GetSystems():
        yield from _leaves(part)


def _check(system: System) -> None:
    """Raises ConversionError if a plant is discrete, or a geometry hydroelastic."""
    if isinstance(system, SceneGraph):
        inspector = system.model_inspector()
        for geometry in inspector.GetAllGeometryIds():
            properties = inspector.GetProximityProperties(geometry)
            if properties is not None and properties.HasProperty("hydroelastic", "compliance_type"):
                raise ConversionError(f"'{inspector.GetName(geometry)}' is hydroelastic")
    if isinstance(system, MultibodyPlant) and system.time_step() > 0.0:
        raise ConversionError(
            f"'{system.get_name()}' is a discrete plant, with steps of {system.time_step():g} s"
        )
