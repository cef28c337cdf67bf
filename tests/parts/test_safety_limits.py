"""D through the safety limits: slowed, leashed and given up, or passed on to the bit."""

import numpy as np
import pytest
from driven_arm import make_plant
from pydrake.systems.framework import DiagramBuilder

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.laws.frame_motion import LINEAR_VELOCITY, POSITION, VELOCITY
from geoimp_drake.parts.part_loop import PartLoop
from geoimp_drake.parts.safety_limits import SafetyConfig, SafetyLimits
from geoimp_drake.validation import check

GAINS = 9.0 * np.eye(3), 2000.0 * np.eye(3), 700.0 * np.eye(3)
SOURCE = "this test"
AT_REST = np.array([1.0, *[0.0] * 18])


class Limited:
    """The part, called by hand; C follows D as it was given unless it is told where to stay."""

    def __init__(self, **fields):
        plant, arm, E = make_plant(DiagramBuilder(), "light7")
        model = ControlModel.of_arm(plant, arm, E)
        config = SafetyConfig(force=150.0, source=SOURCE, contact_stiffness=7.5e4, **fields)
        self.loop = PartLoop(SafetyLimits(model, GAINS, config), "safety")
        self.signals = {
            "desired_motion": AT_REST,
            "compliant_motion": AT_REST,
            "wrench": np.zeros(6),
            "estimated_state": plant.GetDefaultPositions(arm).tolist() + [0.0] * 7,
        }
        self.signals["estimated_state"] = np.array(self.signals["estimated_state"])
        self.loop.reset(self.signals)

    def step(self, D: np.ndarray, C: np.ndarray | None = None, **others) -> np.ndarray:
        C = self.loop.output("safe_motion").copy() if C is None else C
        readings = {**self.signals, "compliant_motion": C, **others}
        del readings["desired_motion"]
        self.loop.step(readings, {"desired_motion": D}, 1e-3)
        return self.loop.output("safe_motion").copy()


def at(z: float, speed: float = 0.0) -> np.ndarray:
    motion = AT_REST.copy()
    motion[POSITION][2], motion[LINEAR_VELOCITY][2] = z, speed
    return motion


def test_a_slow_motion_passes_to_the_bit():
    limited = Limited()
    for k in range(1, 50):
        D = at(2e-5 * k, 0.02)
        np.testing.assert_array_equal(limited.step(D), D)


def test_a_fast_motion_and_a_jump_go_on_at_the_safe_speed():
    limited, positions = Limited(leash=False), []
    for _ in range(200):
        D = limited.step(at(0.1, 0.8))
        positions.append(D[POSITION][2])
    # Wherever the mass that counts is M: 150 / (2000 + √(9 · 7.5e4)) = 0.053 m/s.
    speed = D[LINEAR_VELOCITY][2]
    assert 0.02 < speed <= 0.0532
    np.testing.assert_allclose(np.diff(positions), 1e-3 * speed, rtol=1e-6)
    assert limited.loop.output("safety")[1] == pytest.approx(0.1 - positions[-2], abs=2e-4)


def test_a_stopped_C_is_pulled_with_half_of_the_force_at_most():
    limited = Limited(cap=False)
    limited.step(at(0.0))
    D = limited.step(at(0.5, 0.8), at(0.0))
    assert 700.0 * D[POSITION][2] == pytest.approx(75.0)
    assert 2000.0 * D[LINEAR_VELOCITY][2] == pytest.approx(75.0)


def test_somebody_who_is_hit_makes_D_rest_where_C_is(caplog):
    limited, C = Limited(), at(0.004, 0.05)
    limited.step(at(0.0))
    limited.step(at(0.004, 0.05), C, wrench=np.array([0.0, 0.0, 0.0, 0.0, 9.0, 12.1]))
    assert "15.1 N at the wrist" in caplog.text
    D = limited.step(at(0.3, 0.05), at(0.01))
    np.testing.assert_array_equal(D[POSITION], C[POSITION])
    np.testing.assert_array_equal(D[VELOCITY], 0.0)
    np.testing.assert_array_equal(limited.loop.output("stiffness_scale"), [0.2, 0.2])
    assert limited.loop.output("safety")[2] == 1.0


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"source": " "}, "safety.source is empty; say where the limit of 150 N comes from"),
        ({"force": 0.0}, "safety.force"),
        ({"contact_stiffness": -1.0}, "safety.contact_stiffness"),
        ({"detection": 0.0}, "safety.detection"),
    ],
)
def test_limits_without_a_number_or_a_source_are_refused(fields, words):
    given = {"force": 150.0, "source": SOURCE, "contact_stiffness": 7.5e4, **fields}
    with pytest.raises(ConfigurationError, match=words):
        check(SafetyConfig(**given), "safety")


def test_a_wrench_that_is_none_is_an_error_that_names_the_port():
    with pytest.raises(SignalError, match="'safety:wrench' got"):
        Limited().step(at(0.0), wrench=np.full(6, np.nan))
