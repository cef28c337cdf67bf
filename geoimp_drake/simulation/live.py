"""What one can do in Meshcat while a run goes on: change the stiffness, push the hand, pause."""

import time
from collections.abc import Callable

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import Meshcat
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce, MultibodyPlant
from pydrake.multibody.tree import Frame
from pydrake.systems.framework import (
    BasicVector,
    Context,
    ContinuousState,
    DiagramBuilder,
    DiscreteValues,
    System,
)

from geoimp_drake.parts.impedance_energy import ImpedanceEnergy
from geoimp_drake.simulation.visualization import FRAME_PERIOD, frame_period
from geoimp_drake.systems.naming import unused_name
from geoimp_drake.systems.part_system import Block
from geoimp_drake.typing import Array

__all__ = ["PushButton", "StiffnessSliders", "add_live_controls", "pause_button"]

TRANSLATION, ROTATION = "K_p, factor", "K_o, factor"
INJECTED = "injected [W]"
PUSH, PAUSE = "Push the hand", "Pause / go on"

_FACTORS = (0.25, 4.0)
_LAG = 0.3  # [s] with which the stiffness follows a slider
_MOST_POWER = 20.0  # [W] that can be shown
_PUSH_FORCE, _PUSH_DURATION = 20.0, 0.5  # [N, s]


def add_live_controls(
    builder: DiagramBuilder,
    meshcat: Meshcat,
    plant: MultibodyPlant,
    controller: System,
    hand: Frame,
    *,
    push: bool = True,
    step: float | None = None,
) -> None:
    """Adds sliders for the stiffness and a button that pushes, connected to a controller.

    On a Meshcat that has them from another diagram they begin anew, and serve both.

    Args:
        builder: of the diagram, holds `plant` and `controller` already.
        meshcat: where the sliders and the button appear.
        plant: contains the hand.
        controller: with the ports `stiffness_scale` and `energy`.
        hand: at whose origin the push acts.
        push: whether there is a push; its plant port must be free.
        step: of the simulation [s], by default the plant's; see `visualization.frame_period`.
    """
    period = frame_period(plant.time_step() if step is None else step)
    sliders = builder.AddNamedSystem(
        unused_name(builder, "stiffness_sliders"), StiffnessSliders(meshcat, period)
    )
    builder.Connect(
        sliders.GetOutputPort("stiffness_scale"), controller.GetInputPort("stiffness_scale")
    )
    builder.Connect(controller.GetOutputPort("energy"), sliders.GetInputPort("energy"))
    if push:
        button = builder.AddNamedSystem(
            unused_name(builder, "push_button"), PushButton(meshcat, hand, period)
        )
        builder.Connect(button.get_output_port(), plant.get_applied_spatial_force_input_port())


class StiffnessSliders(Block):
    """Two sliders that scale K_p and K_o; the stiffness follows them without a jump.

    A factor s follows its slider u by ṡ = (u − s)/T, T = 0.3 s, so that the elastic wrench is
    continuous. A spring that is made stiffer while it is loaded gains energy that no
    force supplies: the power 𝒰 ṡ/s, 𝒰 the potential energy, is put out and shown.

    Args:
        meshcat: where the sliders appear.
        period: with which they are read [s].

    Ports:
        input energy: `ImpedanceEnergy` of the impedance (9)
        output stiffness_scale: factors of K_p and K_o (2)
        output injected_power: by both (1) [W]
    """

    def __init__(self, meshcat: Meshcat, period: float = FRAME_PERIOD):
        super().__init__()
        self._meshcat = meshcat
        self._energy = self.DeclareVectorInputPort("energy", len(ImpedanceEnergy.get_fields()))
        self._targets = self.declare_state(np.ones(2))
        self.DeclareContinuousState(BasicVector(np.ones(2)), 0, 0, 2)
        state = {self.xc_ticket()}
        self.DeclareVectorOutputPort("stiffness_scale", 2, self._calc_scale, state)
        self.DeclareVectorOutputPort("injected_power", 1, self._calc_power)
        for name in (TRANSLATION, ROTATION):
            _add_slider(meshcat, name, *_FACTORS, 0.05, 1.0)
        _add_slider(meshcat, INJECTED, -_MOST_POWER, _MOST_POWER, 0.01, 0.0)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._read)
        self.DeclarePeriodicPublishEvent(period, 0.0, self._show)

    def _read(self, context: Context, state: DiscreteValues) -> None:
        before = context.get_discrete_state(self._targets).value()
        values = np.array([self._meshcat.GetSliderValue(name) for name in (TRANSLATION, ROTATION)])
        # Drake takes any number that a page sends, whatever the range.
        state.set_value(self._targets, np.where(np.isnan(values), before, values.clip(*_FACTORS)))

    def _rates(self, context: Context) -> Array:
        targets: Array = context.get_discrete_state(self._targets).value()
        return (targets - _scale(context)) / _LAG

    def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
        """Lets the factors follow the sliders."""
        derivatives.SetFromVector(self._rates(context))

    def _calc_scale(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(_scale(context))

    def _power(self, context: Context) -> float:
        energy = ImpedanceEnergy(self._energy.Eval(context))
        potential = [energy.translational_potential, energy.rotational_potential]
        return float(self._rates(context) / _scale(context) @ potential)

    def _calc_power(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([self._power(context)])

    def _show(self, context: Context) -> None:
        shown = float(np.clip(self._power(context), -_MOST_POWER, _MOST_POWER))
        self._meshcat.SetSliderValue(INJECTED, shown)


def _add_slider(meshcat: Meshcat, name: str, *numbers: float) -> None:
    """Adds a slider at its initial value, in the place of one that an earlier diagram left."""
    meshcat.DeleteSlider(name, strict=False)
    meshcat.AddSlider(name, *numbers)


def _scale(context: Context) -> Array:
    scale: Array = context.get_continuous_state_vector().CopyToVector()
    return scale


class PushButton(Block):
    """A button that pushes a hand along X: 20 N at most, as sin² over half a second.

    Args:
        meshcat: where the button appears.
        hand: at whose origin the force acts.
        period: with which it is read [s].

    Ports:
        output applied_spatial_force: for the plant's port, list of ExternallyAppliedSpatialForce
    """

    def __init__(self, meshcat: Meshcat, hand: Frame, period: float = FRAME_PERIOD):
        super().__init__()
        self._meshcat = meshcat
        self._body = hand.body().index()
        self._p_BF = hand.GetFixedPoseInBodyFrame().translation()
        # How often it has been clicked, and when last [s].
        self.declare_state([0.0, -np.inf])
        meshcat.AddButton(PUSH)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._read)
        self.DeclareAbstractOutputPort(
            "applied_spatial_force",
            lambda: AbstractValue.Make([ExternallyAppliedSpatialForce()]),
            self._calc_force,
            {self.time_ticket(), self.xd_ticket()},
        )

    def _read(self, context: Context, state: DiscreteValues) -> None:
        before, _ = context.get_discrete_state_vector().value()
        clicks = self._meshcat.GetButtonClicks(PUSH)
        if clicks > before:
            state.set_value([clicks, context.get_time()])

    def _calc_force(self, context: Context, output: AbstractValue) -> None:
        _, start = context.get_discrete_state_vector().value()
        phase = (context.get_time() - start) / _PUSH_DURATION
        size = _PUSH_FORCE * np.sin(np.pi * phase) ** 2 if 0.0 <= phase <= 1.0 else 0.0
        applied = ExternallyAppliedSpatialForce()
        applied.body_index = self._body
        applied.p_BoBq_B = self._p_BF
        applied.F_Bq_W = SpatialForce(tau=np.zeros(3), f=np.array([size, 0.0, 0.0]))
        output.set_value([applied])


def pause_button(meshcat: Meshcat) -> Callable[[], bool]:
    """Adds a pause button; what it returns waits while it is on and returns True if it waited."""
    meshcat.AddButton(PAUSE, "Space")

    def wait() -> bool:
        waited = False
        while meshcat.GetButtonClicks(PAUSE) % 2:
            waited = True
            time.sleep(0.05)
        return waited

    return wait
