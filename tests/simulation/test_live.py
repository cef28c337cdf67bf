"""What one can do while a run goes on: stiffness without a jump, a push, a pause."""

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput

from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.parts.impedance_energy import ImpedanceEnergy
from geoimp_drake.simulation.live import (
    INJECTED,
    PAUSE,
    PUSH,
    ROTATION,
    TRANSLATION,
    PushButton,
    StiffnessSliders,
    pause_button,
)
from geoimp_drake.simulation.replay import start_meshcat
from geoimp_drake.simulation.run import simulate

LAG = 0.3


class Panel:
    """A Meshcat without a browser: what its sliders and buttons say is set by the test."""

    def __init__(self):
        self.sliders: dict[str, float] = {}
        self.clicks: dict[str, int] = {}

    def AddSlider(self, name, *range_and_step):
        self.sliders[name] = range_and_step[-1]

    def GetSliderValue(self, name):
        return self.sliders[name]

    def SetSliderValue(self, name, value):
        self.sliders[name] = value

    def AddButton(self, name, *_):
        self.clicks[name] = 0

    def GetButtonClicks(self, name):
        return self.clicks[name]


def energy(translational: float, rotational: float) -> np.ndarray:
    view = ImpedanceEnergy(np.zeros(9))
    view.translational_potential, view.rotational_potential = translational, rotational
    return np.asarray(view)


def test_the_stiffness_follows_its_slider_without_a_jump_and_tells_its_power():
    panel, builder = Panel(), DiagramBuilder()
    sliders = builder.AddSystem(StiffnessSliders(panel))
    source = builder.AddSystem(ConstantVectorSource(energy(3.0, 0.5)))
    builder.Connect(source.get_output_port(), sliders.GetInputPort("energy"))
    scale = LogVectorOutput(sliders.GetOutputPort("stiffness_scale"), builder, 1e-3)
    power = LogVectorOutput(sliders.GetOutputPort("injected_power"), builder, 1e-3)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.5)
    panel.sliders[TRANSLATION] = 2.0
    simulator.AdvanceTo(3.0)
    t = scale.FindLog(simulator.get_context()).sample_times()
    s = scale.FindLog(simulator.get_context()).data()
    np.testing.assert_array_equal(s[1], 1.0)
    np.testing.assert_array_equal(s[0, t <= 0.5], 1.0)
    assert np.abs(np.diff(s[0])).max() < 1.05 * 1e-3 / LAG
    assert s[0, -1] == pytest.approx(2.0, abs=1e-3)
    injected = power.FindLog(simulator.get_context()).data()[0]
    rate = np.gradient(s[0], t)
    np.testing.assert_allclose(injected[600:], (3.0 * rate / s[0])[600:], rtol=0.01, atol=1e-6)
    assert 0.0 < panel.sliders[INJECTED] < 0.1


def test_a_click_pushes_once_and_the_push_fades():
    panel = Panel()
    plant = MultibodyPlant(1e-3)
    plant.Finalize()
    button = PushButton(panel, plant.world_frame())
    simulator = Simulator(button)

    def force(time: float) -> float:
        simulator.AdvanceTo(time)
        (applied,) = button.get_output_port().Eval(simulator.get_context())
        return float(applied.F_Bq_W.translational()[0])

    assert force(0.5) == 0.0
    panel.clicks[PUSH] = 1
    pushed = [force(time) for time in np.arange(0.5, 1.3, 0.01)]
    assert max(pushed) == pytest.approx(20.0, rel=0.01)
    assert np.abs(np.diff(pushed)).max() < 2.0
    assert pushed[-1] == 0.0


def test_a_pause_waits_until_the_next_click(monkeypatch):
    panel = Panel()
    wait = pause_button(panel)
    assert not wait()
    panel.clicks[PAUSE] = 1
    naps = []

    def nap(seconds: float) -> None:
        naps.append(seconds)
        panel.clicks[PAUSE] += len(naps) == 3

    monkeypatch.setattr("geoimp_drake.simulation.live.time.sleep", nap)
    assert wait()
    assert len(naps) == 3


@pytest.mark.parametrize("name", ["plexiglas", "consistency", "peg_in_hole", "bar"])
def test_every_kind_of_experiment_runs_with_the_controls(name):
    experiment = get_experiment(name)
    scenario = experiment.scenario((), ("duration=0.02",))
    meshcat = start_meshcat(*experiment.view)
    setup = experiment.build(scenario, meshcat, live=True)
    meshcat.SetSliderValue(ROTATION, 2.0)
    outcome = simulate(setup.diagram, scenario.simulator, 0.02, events=setup.events)
    assert outcome.failure is None
    sliders = setup.diagram.GetSubsystemByName("stiffness_sliders")
    context = sliders.GetMyContextFromRoot(outcome.context)
    scale = sliders.GetOutputPort("stiffness_scale").Eval(context)
    assert scale[0] == 1.0
    assert 1.02 < scale[1] < 1.2
    assert setup.diagram.HasSubsystemNamed("push_button") == (name != "consistency")
