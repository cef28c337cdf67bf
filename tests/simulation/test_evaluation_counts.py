"""How often systems, laws and ports are evaluated in a step: counted, so that no test is timed."""

from collections import Counter

import pytest
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.framework import InputPort, OutputPort

from geoimp_drake.arm.dynamics import ChainDynamics
from geoimp_drake.compilation.compiled import is_available
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.inner_loop import InnerLoop
from geoimp_drake.systems import part_shell
from geoimp_drake.systems.sources.desired_motion import DesiredMotion

pytestmark = pytest.mark.skipif(not is_available(), reason="numba is not installed")

# Calls from Drake into each system in a step. The whole controller: its step begins, it is sampled,
# and its found values, torques and derivatives are evaluated. The impedance's law is evaluated
# twice: for the torques and, with the new wrench, for the integrator's step.
COMPILED = {
    "plexiglas": {"six_impedance_controller": 5},
    "redundancy": {"seven_impedance_controller": 5},
    "bar": {"seven_six_cooperative_controller": 6},  # torques of two arms
}
BLOCKS = {
    "impedance": 4,  # its step, its motion and that of the last step, its derivatives
    "joint_readings": 2,  # a sample and what it says
    "motion_control": 1,
    "redundancy": 1,
    "limits": 4,  # its step, what it finds, and that as an acceleration and as a slack
    "inverse_dynamics": 2,  # torques, and their limits
    "wrist_sensors": 2,  # a sample and what it says
}
# A constant K_n is compared with what the posture allows; one system has it from its torques.
WATCHED = {("redundancy", "blocks"): {"redundancy": 2}}
PORTS = {
    ("plexiglas", "compiled"): 5,
    ("redundancy", "compiled"): 5,
    ("bar", "compiled"): 6,
    ("plexiglas", "blocks"): 22,
    ("redundancy", "blocks"): 24,
}


def counted(monkeypatch, owner: object, method: str, name: str, calls: Counter) -> None:
    original = getattr(owner, method)

    def counting(*arguments, **keywords):
        calls[name] += 1
        return original(*arguments, **keywords)

    monkeypatch.setattr(owner, method, counting)


def calls_per_step(monkeypatch, experiment: str, form: str) -> dict[str, float]:
    """Returns what is called in a step of an experiment in free motion, logging off."""
    calls: Counter = Counter()
    entered = part_shell.PartView.__init__

    def entering(self, system, context) -> None:
        calls[system.get_name()] += 1
        entered(self, system, context)

    monkeypatch.setattr(part_shell.PartView, "__init__", entering)
    for owner, method, name in (
        (ChainDynamics, "evaluate", "arms"),
        (Impedance, "write_motion", "impedances"),
        (Impedance, "evaluate", "impedances"),
        (InnerLoop, "write_torque", "torques"),
        (DesiredMotion, "_calc_motion", "steps"),
        (InputPort, "Eval", "ports"),
        (OutputPort, "Eval", "ports"),
    ):
        counted(monkeypatch, owner, method, name, calls)
    chosen = get_experiment(experiment)
    setup = chosen.build(chosen.scenario((), (f"form={form}",)), logged=False)
    simulator = Simulator(setup.diagram)
    ApplySimulatorConfig(setup.scenario.simulator, simulator)
    simulator.AdvanceTo(0.01)
    calls.clear()
    simulator.AdvanceTo(0.06)
    steps = calls.pop("steps")
    assert 50 <= steps <= 51  # times are sums of rounded steps
    return {name: count / steps for name, count in calls.items()}


@pytest.mark.parametrize("experiment", ["plexiglas", "redundancy"])
def test_evaluations_in_a_step_of_one_system(monkeypatch, experiment) -> None:
    calls = calls_per_step(monkeypatch, experiment, "compiled")
    assert calls.pop("ports") == PORTS[experiment, "compiled"]
    assert calls == {**COMPILED[experiment], "impedances": 2, "torques": 1}


def test_evaluations_in_a_step_of_two_arms_as_one_system(monkeypatch) -> None:
    calls = calls_per_step(monkeypatch, "bar", "compiled")
    assert calls.pop("ports") == PORTS["bar", "compiled"]
    assert calls == {**COMPILED["bar"], "torques": 2}


@pytest.mark.parametrize("experiment", ["plexiglas", "redundancy"])
def test_evaluations_in_a_step_of_blocks(monkeypatch, experiment) -> None:
    calls = calls_per_step(monkeypatch, experiment, "blocks")
    assert calls.pop("ports") == PORTS[experiment, "blocks"]
    watched = WATCHED.get((experiment, "blocks"), {})
    assert calls == {**BLOCKS, "impedances": 2, "arms": 1, **watched}


def test_either_of_two_arms_is_evaluated_once_in_a_step_of_blocks(monkeypatch) -> None:
    calls = calls_per_step(monkeypatch, "bar", "blocks")
    assert calls["arms"] == 2
    # Of the object and of the grasp, as often as for one arm.
    assert calls["impedances"] == 4
    for name in ("joint_readings", "motion_control", "redundancy", "inverse_dynamics"):
        assert calls[name] == 2 * BLOCKS[name]
