"""Controls in Meshcat during a run: change the stiffness, push the hand, pause."""

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
    DiagramBuilder,
    DiscreteValues,
    System,
)

from geoimp_drake.parts.energy_tank import EnergyTank, TankConfig
from geoimp_drake.parts.impedance_energy import ImpedanceEnergy, dissipated_power
from geoimp_drake.parts.part import Memory
from geoimp_drake.simulation.visualization import FRAME_PERIOD, frame_period
from geoimp_drake.systems.naming import unused_name
from geoimp_drake.systems.part_system import Block
from geoimp_drake.typing import Array

__all__ = ["PushButton", "StiffnessSliders", "add_live_controls", "pause_button"]

TRANSLATION, ROTATION = "K_p, factor", "K_o, factor"
INJECTED, TANK = "injected [W]", "tank [J]"
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

    If a Meshcat has them from another diagram already, they are reset and serve both.

    Args:
        builder: of the diagram; it already holds `plant` and `controller`.
        meshcat: where the sliders and the button appear.
        plant: contains the hand.
        controller: with the ports `stiffness_scale` and `energy`.
        hand: the frame at whose origin the push acts.
        push: whether to add the push; its port of the plant must be free.
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
    continuous. A spring that is made stiffer while it is loaded gains energy that no force
    supplies, Δ𝒰 = 𝒰 Δs/s a step, 𝒰 the potential energy. That energy comes from a tank (0.2 J at
    the start, 2 J at most) that damping fills. When the tank is empty, the stiffness rises no
    further. Ports and labels show the power and the energy in the tank.

    Args:
        meshcat: where the sliders appear.
        period: between two readings [s].

    Ports:
        input energy: `ImpedanceEnergy` of the impedance (9)
        output stiffness_scale: factors of K_p and K_o (2)
        output injected_power: power injected by both in the last step (1) [W]
        output tank: energy in the tank (1) [J]
    """

    def __init__(self, meshcat: Meshcat, period: float = FRAME_PERIOD):
        super().__init__()
        self._meshcat, self._tank = meshcat, EnergyTank(TankConfig())
        self._energy = self.DeclareVectorInputPort("energy", len(ImpedanceEnergy.get_fields()))
        self._places = Memory(
            targets=np.ones(2),
            scale=np.ones(2),
            injected=np.zeros(1),
            tank=self._tank.memory,
            power=0.0,
            time=0.0,
        )
        self._state = self.declare_state(self._places.start)
        held = {self.xd_ticket()}
        for name, place in (
            ("stiffness_scale", self._places.scale),
            ("injected_power", self._places.injected),
            ("tank", self._places.tank),
        ):
            size = place.stop - place.start
            self.DeclareVectorOutputPort(name, size, self._put_out(place), held)
        for name in (TRANSLATION, ROTATION):
            _add_slider(meshcat, name, *_FACTORS, 0.05, 1.0)
        _add_slider(meshcat, INJECTED, -_MOST_POWER, _MOST_POWER, 0.01, 0.0)
        _add_slider(meshcat, TANK, 0.0, TankConfig().cap, 0.01, TankConfig().start)
        self.DeclareInitializationDiscreteUpdateEvent(self._start)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._read)
        self.DeclarePerStepDiscreteUpdateEvent(self._follow)
        self.DeclarePeriodicPublishEvent(period, 0.0, self._show)

    def _put_out(self, place: slice) -> Callable[[Context, BasicVector], None]:
        return lambda context, output: output.SetFromVector(self._values(context)[place])

    def _values(self, context: Context) -> Array:
        values: Array = context.get_discrete_state(self._state).value()
        return values

    def _start(self, context: Context, state: DiscreteValues) -> None:
        values = self._places.start.copy()
        values[self._places.time] = context.get_time()
        state.set_value(self._state, values)

    def _read(self, context: Context, state: DiscreteValues) -> None:
        values = state.get_mutable_value(self._state)
        told = np.array([self._meshcat.GetSliderValue(name) for name in (TRANSLATION, ROTATION)])
        # Drake accepts any number that a page sends, whatever the slider's range.
        targets = values[self._places.targets]
        targets[:] = np.where(np.isnan(told), targets, told.clip(*_FACTORS))

    def _follow(self, context: Context, state: DiscreteValues) -> None:
        """Lets the factors follow the sliders, as far as the tank allows."""
        places, values = self._places, state.get_mutable_value(self._state)
        step, values[places.time] = context.get_time() - values[places.time], context.get_time()
        energy = self._energy.Eval(context)
        view, power = ImpedanceEnergy(energy), dissipated_power(energy)
        # No more than was dissipated, whether the power rises or falls.
        gained = step * min(power, values[places.power])
        values[places.power] = power
        scale = values[places.scale]
        change = (values[places.targets] - scale) * (1.0 - np.exp(-step / _LAG))
        potential = [view.translational_potential, view.rotational_potential]
        injected = float(change / scale @ potential)
        share = self._tank.share(values[places.tank], injected, gained)
        scale += share * change
        values[places.injected] = share * injected / step if step else 0.0

    def _show(self, context: Context) -> None:
        values = self._values(context)
        (power,), (level,) = values[self._places.injected], values[self._places.tank]
        self._meshcat.SetSliderValue(INJECTED, float(np.clip(power, -_MOST_POWER, _MOST_POWER)))
        self._meshcat.SetSliderValue(TANK, float(level))


def _add_slider(meshcat: Meshcat, name: str, *numbers: float) -> None:
    """Adds a slider at its initial value, and replaces one that an earlier diagram left."""
    meshcat.DeleteSlider(name, strict=False)
    meshcat.AddSlider(name, *numbers)


class PushButton(Block):
    """A button that pushes a hand along X: 20 N at most, as sin² over half a second.

    Args:
        meshcat: where the button appears.
        hand: the frame at whose origin the force acts.
        period: between two readings [s].

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
    """Adds a pause button; returns a function that waits while it is on, and says if it waited."""
    meshcat.AddButton(PAUSE, "Space")

    def wait() -> bool:
        waited = False
        while meshcat.GetButtonClicks(PAUSE) % 2:
            waited = True
            time.sleep(0.05)
        return waited

    return wait
