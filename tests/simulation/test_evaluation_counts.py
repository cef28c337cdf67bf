"""How often laws, arm and ports are evaluated in a step: counted, so that no test is timed."""

from collections import Counter

import pytest
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.framework import InputPort, OutputPort

from geoimp_drake.compilation.compiled import is_available
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.systems.arm import arm_model, redundancy_resolver
from geoimp_drake.systems.arm.arm_control import ArmControl
from geoimp_drake.systems.arm.arm_model import ArmModel
from geoimp_drake.systems.arm.inverse_dynamics_inner_loop import InverseDynamicsInnerLoop
from geoimp_drake.systems.arm.motion_controller import MotionController
from geoimp_drake.systems.arm.redundancy_resolver import RedundancyResolver
from geoimp_drake.systems.arm.velocity_estimator import VelocityEstimator
from geoimp_drake.systems.cooperation.cooperative_control import CooperativeControl
from geoimp_drake.systems.impedance_integrator import ImpedanceIntegrator
from geoimp_drake.systems.sensing.force_torque_sensors import ForceTorqueSensors
from geoimp_drake.systems.sensing.wrist_sensing import WristSensing
from geoimp_drake.systems.sources.desired_motion import DesiredMotion

# What each system's callbacks are called, of the blocks and of the systems that take their place.
LAWS: dict[type, tuple[str, ...]] = {
    ArmControl: ("_calc_torque", "_calc_measured_motion", "_next_reading", "_compare_with_limits"),
    ArmModel: ("_calc_arm", "_calc_motion"),
    DesiredMotion: ("_calc_motion",),
    ForceTorqueSensors: ("_sample",),
    WristSensing: ("sample", "true_wrench"),
    ImpedanceIntegrator: (
        "_write_motion",
        "_calc_motion",
        "DoCalcTimeDerivatives",
        "_calc_energy",
    ),
    InverseDynamicsInnerLoop: ("_calc_torque", "_compare_with_limits"),
    MotionController: ("_calc_acceleration",),
    CooperativeControl: (
        "_find",
        "_calc_found",
        "_calc_torque",
        "_compare_with_limits",
        "_hold_motions",
        "_sample",
        "_start_or_normalize",
        "DoCalcTimeDerivatives",
    ),
    RedundancyResolver: ("_calc_six", "_calc_redundant", "_calc_internal", "_report_six"),
    VelocityEstimator: ("_next_reading",),
}
# In one step. The impedance's law is evaluated twice: for the torque (the event that normalizes the
# state and the sensor's load take what the torque has evaluated), and, with the new wrench, for
# the integrator's step; for that no output port or cache entry is evaluated.
SOURCES = {
    "DesiredMotion._calc_motion": 1,
    "ForceTorqueSensors._sample": 1,
    "WristSensing.sample": 1,
}
IMPEDANCE = {
    "ImpedanceIntegrator._write_motion": 2,
    "ImpedanceIntegrator._calc_motion": 1,
    "ImpedanceIntegrator.DoCalcTimeDerivatives": 1,
}
FUSED = {
    "ArmControl._calc_torque": 1,
    "ArmControl._next_reading": 1,
    "ArmControl._compare_with_limits": 1,
}
BLOCKS = {
    "ArmModel._calc_arm": 1,
    "InverseDynamicsInnerLoop._calc_torque": 1,
    "InverseDynamicsInnerLoop._compare_with_limits": 1,
    "MotionController._calc_acceleration": 1,
    "VelocityEstimator._next_reading": 1,
}
SIX = {"RedundancyResolver._calc_six": 1}
SEVEN = {"RedundancyResolver._calc_redundant": 1, "RedundancyResolver._calc_internal": 1}
# Both arms, and what their object needs.
BAR = {
    "CooperativeControl._find": 2,
    "CooperativeControl._calc_found": 1,
    "CooperativeControl._calc_torque": 2,  # one for each arm
    "CooperativeControl._compare_with_limits": 1,
    "CooperativeControl._hold_motions": 1,
    "CooperativeControl._sample": 1,
    "CooperativeControl._start_or_normalize": 1,
    "CooperativeControl.DoCalcTimeDerivatives": 1,
    "DesiredMotion._calc_motion": 1,
    "WristSensing.sample": 2,
}


def counted(monkeypatch, owner: object, method: str, name: str, calls: Counter) -> None:
    original = getattr(owner, method)

    def counting(*arguments, **keywords):
        calls[name] += 1
        return original(*arguments, **keywords)

    monkeypatch.setattr(owner, method, counting)


def calls_per_step(monkeypatch, experiment: str, fused: bool = True) -> dict[str, float]:
    """Returns what is called in a step of an experiment in free motion, logging off."""
    calls: Counter = Counter()
    for system, methods in LAWS.items():
        for method in methods:
            counted(monkeypatch, system, method, f"{system.__name__}.{method}", calls)
    counted(monkeypatch, arm_model, "evaluate_arm", "arms", calls)
    counted(monkeypatch, redundancy_resolver, "evaluate_internal_motion", "internal", calls)
    for port in (InputPort, OutputPort):
        counted(monkeypatch, port, "Eval", "ports", calls)
    chosen = get_experiment(experiment)
    settings = (f"form={'compiled' if fused else 'blocks'}",)
    setup = chosen.build(chosen.scenario((), settings), logged=False)
    simulator = Simulator(setup.diagram)
    ApplySimulatorConfig(setup.scenario.simulator, simulator)
    simulator.AdvanceTo(0.01)
    calls.clear()
    simulator.AdvanceTo(0.06)
    steps = calls["DesiredMotion._calc_motion"]
    assert 50 <= steps <= 51  # times are sums of rounded steps
    return {name: count / steps for name, count in calls.items()}


needs_numba = pytest.mark.skipif(not is_available(), reason="numba is not installed")


@needs_numba
@pytest.mark.parametrize(("experiment", "ports"), [("plexiglas", 12), ("redundancy", 12)])
def test_evaluations_in_a_step(monkeypatch, experiment, ports) -> None:
    calls = calls_per_step(monkeypatch, experiment)
    assert calls.pop("ports") == ports
    assert calls == {**SOURCES, **IMPEDANCE, **FUSED}


@needs_numba
def test_evaluations_in_a_step_of_two_arms(monkeypatch) -> None:
    calls = calls_per_step(monkeypatch, "bar")
    assert calls.pop("ports") == 8
    assert calls == BAR


@pytest.mark.parametrize(
    ("experiment", "own", "internal", "ports"),
    [("plexiglas", SIX, 0, 18), ("redundancy", SEVEN, 1, 19)],
)
def test_evaluations_of_separate_blocks(monkeypatch, experiment, own, internal, ports) -> None:
    calls = calls_per_step(monkeypatch, experiment, fused=False)
    assert calls.pop("arms") == 1
    assert calls.pop("internal", 0) == internal
    assert calls.pop("ports") == ports
    assert calls == {**SOURCES, **IMPEDANCE, **BLOCKS, **own}


def test_either_of_two_arms_is_evaluated_once_in_a_step(monkeypatch) -> None:
    calls = calls_per_step(monkeypatch, "bar", fused=False)
    assert calls["arms"] == 2
    assert calls["internal"] == 1
    assert calls["MotionController._calc_acceleration"] == 2
    # Of the object and of the grasp, as often as for one arm.
    assert calls["ImpedanceIntegrator._write_motion"] == 4
