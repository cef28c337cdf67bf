"""Kinematics and dynamics of an arm at one instant: by compiled laws, or by Drake."""

from typing import Any, Protocol

from pydrake.systems.framework import Context

from geoimp_drake.arm.chain import chain_arrays
from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.derivatives import coriolis_forces, inertia_rate
from geoimp_drake.arm.state import ArmState, evaluate_arm
from geoimp_drake.compilation.compiled import compiled, is_available
from geoimp_drake.laws.compositions.arm_quantities import arm_quantities
from geoimp_drake.laws.dynamics.serial_chain import chain_coriolis
from geoimp_drake.typing import Array

__all__ = ["ArmDynamics", "ChainDynamics", "DrakeDynamics", "Scratch", "arm_dynamics"]


class Scratch:
    """A context of a control model's plant, made when it is first asked for; a copy has its own.

    Args:
        model: the control model.
    """

    def __init__(self, model: ControlModel):
        self._model = model
        self._context: Context | None = None

    def __deepcopy__(self, memo: dict[int, Any]) -> "Scratch":
        return Scratch(self._model)

    @property
    def context(self) -> Context:
        """The context, left anywhere."""
        if self._context is None:
            self._context = self._model.plant.CreateDefaultContext()
        return self._context

    def at(self, x: Array) -> Context:
        """Returns the context at [q; v] (2n,)."""
        self._model.plant.SetPositionsAndVelocities(self.context, x)
        return self.context


class ArmDynamics(Protocol):
    """What evaluates an arm."""

    def evaluate(self, scratch: Scratch, state: Array) -> ArmState:
        """Returns the arm at [q; v] (2n,) in the model's order."""

    def inertia_rate(self, scratch: Scratch, arm: ArmState) -> Array:
        """Returns Ḃ (n, n) along the arm's motion."""

    def coriolis(self, scratch: Scratch, arm: ArmState, v: Array) -> Array:
        """Returns C(q, v)v (n,) [Nm or N] at the arm's posture."""


def arm_dynamics(model: ControlModel) -> ArmDynamics:
    """Returns what evaluates an arm fastest.

    Where laws are compiled, they take a third of the time of Drake's calls; uncompiled they take
    many times as long.
    """
    return ChainDynamics(model) if is_available() else DrakeDynamics(model)


class ChainDynamics:
    """The laws of laws/dynamics/serial_chain.py, which need no context.

    Args:
        model: the arm.

    Attributes:
        chain: the arm as the laws take it.
    """

    def __init__(self, model: ControlModel):
        self.chain = chain_arrays(model)
        self._n = model.num_joints
        self._quantities, self._coriolis = compiled(arm_quantities), compiled(chain_coriolis)

    def evaluate(self, scratch: Scratch | None, state: Array) -> ArmState:
        """See `ArmDynamics`."""
        q, v = state[: self._n], state[self._n :]
        quantities = self._quantities(q, v, *self.chain)
        arm = ArmState(q, v, *quantities[:-3])
        arm.chain = quantities[-3:]
        return arm

    def inertia_rate(self, scratch: Scratch | None, arm: ArmState) -> Array:
        """See `ArmDynamics`."""
        dB: Array = arm.chain[0]
        return dB

    def coriolis(self, scratch: Scratch | None, arm: ArmState, v: Array) -> Array:
        """See `ArmDynamics`."""
        _, s, links = arm.chain
        return self._coriolis(s, links, v)


class DrakeDynamics:
    """Drake's own calls.

    Args:
        model: the arm.
    """

    def __init__(self, model: ControlModel):
        self._model = model

    def evaluate(self, scratch: Scratch, state: Array) -> ArmState:
        """See `ArmDynamics`."""
        return evaluate_arm(self._model, scratch.context, state)

    def inertia_rate(self, scratch: Scratch, arm: ArmState) -> Array:
        """See `ArmDynamics`."""
        return inertia_rate(self._model, scratch.context, arm.q, arm.v)

    def coriolis(self, scratch: Scratch, arm: ArmState, v: Array) -> Array:
        """See `ArmDynamics`."""
        self._model.plant.SetPositions(scratch.context, arm.q)
        return coriolis_forces(self._model, scratch.context, v)
