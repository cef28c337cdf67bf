"""What one can do while a run goes on: stiffness without a jump, a push, a pause."""

import asyncio
import logging

import msgpack
import numpy as np
import psutil
import pytest
from library_tree import ROOT
from listening import listening
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput
from tornado.websocket import websocket_connect

from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.output_folder import write_files
from geoimp_drake.parts.impedance_energy import ImpedanceEnergy
from geoimp_drake.simulation import experiment as experiments
from geoimp_drake.simulation.live import (
    INJECTED,
    PAUSE,
    PUSH,
    ROTATION,
    TANK,
    TRANSLATION,
    PushButton,
    StiffnessSliders,
    pause_button,
)
from geoimp_drake.simulation.replay import start_meshcat, stop_listening
from geoimp_drake.simulation.run import simulate

LAG = 0.3


class Panel:
    """A Meshcat without a browser: what its sliders and buttons say is set by the test."""

    def __init__(self):
        self.sliders: dict[str, float] = {}
        self.clicks: dict[str, int] = {}

    def DeleteSlider(self, name, strict=True):
        return self.sliders.pop(name, None) is not None

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


def energy(translational: float, rotational: float, dissipated: float = 50.0) -> np.ndarray:
    """Energies that damping fills the tank with, unless it dissipates nothing."""
    view = ImpedanceEnergy(np.zeros(9))
    view.translational_potential, view.rotational_potential = translational, rotational
    view.rotational_dissipated_power = dissipated
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
    # A frame may fall between two rows: then two steps do.
    assert np.abs(np.diff(s[0])).max() < 2.05 * 1e-3 / LAG
    assert s[0, -1] == pytest.approx(2.0, abs=1e-3)
    injected = power.FindLog(simulator.get_context()).data()[0]
    rate = (2.0 - s[0]) / LAG
    np.testing.assert_allclose(injected[600:], (3.0 * rate / s[0])[600:], rtol=0.01, atol=1e-6)
    assert 0.0 < panel.sliders[INJECTED] < 0.1


def test_a_spring_at_rest_is_made_stiffer_only_as_far_as_the_tank_lets():
    panel, builder = Panel(), DiagramBuilder()
    sliders = builder.AddSystem(StiffnessSliders(panel))
    source = builder.AddSystem(ConstantVectorSource(energy(3.0, 0.5, 0.0)))
    builder.Connect(source.get_output_port(), sliders.GetInputPort("energy"))
    power = LogVectorOutput(sliders.GetOutputPort("injected_power"), builder, 1e-3)
    simulator = Simulator(builder.Build())

    def read(port):
        context = sliders.GetMyContextFromRoot(simulator.get_context())
        return sliders.GetOutputPort(port).Eval(context).copy()

    panel.sliders[TRANSLATION] = 2.0
    simulator.AdvanceTo(3.0)
    # 𝒰 Δs/s adds up to 3 J ln s while 𝒰 stays as it is here; there are 0.2 J.
    assert read("stiffness_scale")[0] == pytest.approx(np.exp(0.2 / 3.0), rel=1e-3)
    assert read("tank")[0] == panel.sliders[TANK] == 0.0
    assert power.FindLog(simulator.get_context()).data().sum() * 1e-3 == pytest.approx(0.2, 0.01)
    panel.sliders[TRANSLATION] = 0.5
    simulator.AdvanceTo(6.0)
    # A softer spring gives energy back.
    assert read("stiffness_scale")[0] == pytest.approx(0.5, abs=1e-3)
    assert read("tank")[0] == pytest.approx(2.0)


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


VIEW = ((2.0, 0.0, 1.0), (0.0, 0.0, 0.0))


def send(meshcat, slider: str, value: object) -> None:
    """Sends what a page would send for a slider, and waits until Drake has taken it."""

    async def sent() -> None:
        page = await websocket_connect(meshcat.ws_url())
        message = {"type": "slider", "name": slider, "value": value}
        await page.write_message(msgpack.packb(message), binary=True)
        while not np.array_equal(meshcat.GetSliderValue(slider), value, equal_nan=True):
            await asyncio.sleep(0.01)
        page.close()
        while await page.read_message() is not None:
            pass

    asyncio.run(asyncio.wait_for(sent(), 10))


@pytest.mark.parametrize(
    ("value", "followed"),
    [(1e9, 4.0), (-1e9, 0.25), (np.inf, 4.0), (-np.inf, 0.25), (np.nan, 2.0), (3.0, 3.0)],
)
@pytest.mark.parametrize("slider", [TRANSLATION, ROTATION])
def test_a_page_moves_the_stiffness_within_the_range_of_its_slider_only(slider, value, followed):
    meshcat = start_meshcat(*VIEW)
    builder = DiagramBuilder()
    sliders = builder.AddSystem(StiffnessSliders(meshcat))
    source = builder.AddSystem(ConstantVectorSource(energy(3.0, 0.5)))
    builder.Connect(source.get_output_port(), sliders.GetInputPort("energy"))
    log = LogVectorOutput(sliders.GetOutputPort("stiffness_scale"), builder, 0.01)
    simulator = Simulator(builder.Build())
    steps = SimulatorConfig(
        integration_scheme="runge_kutta2", max_step_size=0.01, use_error_control=False
    )
    ApplySimulatorConfig(steps, simulator)
    send(meshcat, slider, 2.0)
    simulator.AdvanceTo(3.0)
    send(meshcat, slider, value)
    simulator.AdvanceTo(7.0)
    scale = log.FindLog(simulator.get_context()).data()
    assert scale.min() >= 0.25
    assert scale.max() <= 4.0
    moved, left = scale[:, -1] if slider == TRANSLATION else scale[::-1, -1]
    assert moved == pytest.approx(followed, abs=1e-3)
    assert left == 1.0


def here() -> set[tuple[str, int]]:
    return listening([psutil.Process().pid])


def test_meshcat_listens_on_loopback_only():
    before = here()
    meshcat = start_meshcat(*VIEW)
    assert here() - before == {("127.0.0.1", meshcat.port())}


def test_meshcat_listens_where_it_is_told():
    assert start_meshcat(*VIEW, host="localhost").web_url().startswith("http://localhost:")


def test_an_address_of_another_machine_is_refused():
    level = logging.getLogger("drake").level
    with pytest.raises(ConfigurationError, match=r"at 203\.0\.113\.9: it is not an addr"):
        start_meshcat(*VIEW, host="203.0.113.9")
    assert logging.getLogger("drake").level == level


def test_a_replay_is_recorded_while_nothing_listens(tmp_path, monkeypatch):
    during = []

    def write(folder, contents):
        files = write_files(folder, contents)
        during.append(here())
        return files

    monkeypatch.setattr(experiments, "write_files", write)
    before = here()
    experiment = get_experiment("plexiglas")
    scenario = experiment.scenario((), ("duration=0.02",))
    experiments.run_experiment(experiment, scenario, tmp_path, figures=False, html=True)
    (listened,) = during
    assert listened <= before  # those of other tests may be gone meanwhile
    assert "<script" in (tmp_path / "replay.html").read_text("utf-8")


def test_a_meshcat_that_listens_no_longer_leaves_others_alone_and_ends_well():
    other, meshcat = start_meshcat(*VIEW), start_meshcat(*VIEW)
    port, opened = meshcat.port(), psutil.Process().num_fds()
    stop_listening(meshcat)
    assert psutil.Process().num_fds() == opened
    ports = {number for _, number in here()}
    assert other.port() in ports
    assert port not in ports
    descriptors = psutil.Process().num_fds()
    del meshcat
    assert psutil.Process().num_fds() < descriptors


def test_every_meshcat_is_started_in_one_place():
    files = [
        path
        for folder in ("geoimp_drake", "diagrams", "notebooks", "docs")
        for path in (ROOT / folder).rglob("*")
        if path.suffix in {".py", ".ipynb", ".md"}
    ]
    starts = ("Meshcat(", "StartMeshcat")
    found = [p for p in files if any(word in p.read_text("utf-8") for word in starts)]
    assert found == [ROOT / "geoimp_drake" / "simulation" / "replay.py"]


def test_a_second_diagram_on_the_same_meshcat_has_the_controls_anew():
    """As when a cell of a notebook is run again."""
    experiment = get_experiment("plexiglas")
    meshcat = start_meshcat(*experiment.view)
    for _ in range(2):
        setup = experiment.build(experiment.scenario(), meshcat, live=True)
        wait = pause_button(meshcat)
        assert meshcat.GetSliderValue(ROTATION) == 1.0
        meshcat.SetSliderValue(ROTATION, 2.0)
        outcome = simulate(setup.diagram, setup.scenario.simulator, 0.05, wait=wait)
        assert outcome.failure is None
        sliders = setup.diagram.GetSubsystemByName("stiffness_sliders")
        context = sliders.GetMyContextFromRoot(outcome.context)
        assert sliders.GetOutputPort("stiffness_scale").Eval(context)[1] > 1.1


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
