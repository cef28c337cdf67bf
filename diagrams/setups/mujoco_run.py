"""A scenario with one arm in MuJoCo instead of Drake: the same control loop, the same log.

```
 D ──▶ ControlLoop ──torques──▶ MuJoCo: arm ═ sensor ═ tool: disk ▷ surface
        ▲      ▲                 │  │
        │      └───── q, v ──────┘  │
        └─── wrench ◀── sensor ◀────┘
```
"""

from collections import defaultdict
from typing import Any

import numpy as np

from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.diagrams.scene.surface import surface_plane
from geoimp_drake.diagrams.setups.arm_log import slides
from geoimp_drake.diagrams.setups.mujoco_arm import MujocoArm, MujocoWristSensor
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.errors import ConfigurationError, GeoimpError
from geoimp_drake.scenario.loading import plain_data
from geoimp_drake.systems.sources.desired_motion import DesiredMotion
from geoimp_drake.typing import Array
from geoimp_drake.validation import check

__all__ = ["MUJOCO_EXPERIMENTS", "MujocoRun", "run_in_mujoco"]

MUJOCO_EXPERIMENTS = ("plexiglas", "consistency", "nondiagonal")

# Keys of settings that only Drake's plant has.
_DRAKE_ONLY = ("robot", "body", "safety", "world", "effort_scale", "arm", "scheme")


def run_in_mujoco(scenario: SingleArmScenario) -> tuple[dict[str, Array], Exception | None]:
    """Runs a scenario; returns its log, and the error that stopped it before its end, if any.

    Args:
        scenario: one of `MUJOCO_EXPERIMENTS`; its open fields are filled in.

    Raises:
        ConfigurationError: the scenario cannot be run in MuJoCo, or that is not installed.
    """
    run = MujocoRun(scenario)
    failure = run.go_on(scenario.length)
    return run.log(), failure


class MujocoRun:
    """A scenario in MuJoCo, tick by tick.

    Args:
        scenario: is checked; its open fields are filled in.

    Attributes:
        arm: in MuJoCo.
        loop: its controller.

    Raises:
        ConfigurationError: the scenario cannot be run in MuJoCo, or that is not installed.
    """

    def __init__(self, scenario: SingleArmScenario):
        _check_supported(scenario)
        check(scenario)
        _check_periods(scenario)
        scenario.duration = scenario.length
        self._scenario, self.arm = scenario, MujocoArm(scenario)
        plant = self.arm.plant
        self._instance = plant.GetModelInstanceByName(scenario.arm)
        self.loop = ControlLoop(plant, self._instance, self.arm.end_effector, scenario)
        self._sensor = MujocoWristSensor(self.arm, scenario.seeded_sensor())
        self._desired = DesiredMotion(self.arm.X_WE, scenario.segments)
        self._rows: defaultdict[str, list[Array]] = defaultdict(list)
        self._wrench = np.zeros(6)
        self._every = max(1, round(scenario.log_period / scenario.plant.time_step))
        self._torque = self.loop.reset(*self.arm.state, None, self._D(0.0))
        self._keep(0.0)

    def go_on(self, end: float) -> Exception | None:
        """Runs up to a time [s]; returns the error that stopped it before that, if any."""
        step = self._scenario.plant.time_step
        for k in range(1, round(end / step) + 1):
            try:
                self._tick(k * step)
            except GeoimpError as failure:
                return failure
            if k % self._every == 0:
                self._keep(k * step)
        return None

    def log(self) -> dict[str, Array]:
        """Returns the log so far, by the keys of a run's log."""
        scenario, arm = self._scenario, self._scenario.arm
        rows = {name: np.array(values) for name, values in self._rows.items()}
        log = {"t": rows.pop("t")} | {f"{arm}/{name}": values for name, values in rows.items()}
        log[f"{arm}/prismatic"] = slides(self.arm.plant, self._instance)
        if scenario.surface is not None:
            log["surface/plane"] = surface_plane(scenario.surface.pose())
            log["surface/disk"] = np.zeros(3)
        return log

    def _tick(self, time: float) -> None:
        self.arm.step(self._torque)
        self._wrench = self._sensor.sample(self.loop.output("compliant_motion").copy())
        self._torque = self.loop.step(*self.arm.state, self._wrench, self._D(time))

    def _D(self, time: float) -> Array:
        return self._desired.evaluate(time)

    def _keep(self, time: float) -> None:
        """Keeps a row of the log."""
        reading = self.loop.joints.reading(*self.arm.state)
        n = len(reading) // 2
        row: dict[str, Any] = {
            "t": time,
            "q": reading[:n],
            "v": reading[n:],
            "u": self.loop.output("actuation"),
            "motion_E": self.arm.motion(),
            "motion_D": self._D(time),
            "motion_C": self.loop.output("compliant_motion"),
            "wrench": self._wrench,
            "wrench_true": self._sensor.true_wrench(),
            "energy": self.loop.output("energy"),
        }
        reports = {
            "limited": self._scenario.limits is not None,
            "compensation": self._scenario.remedies.is_on,
        }
        row |= {name: self.loop.output(name) for name, is_on in reports.items() if is_on}
        for name, value in row.items():
            self._rows[name].append(np.copy(value))


def _check_supported(scenario: Any) -> None:
    """Raises ConfigurationError for settings that MuJoCo does not simulate here."""
    if scenario.experiment not in MUJOCO_EXPERIMENTS:
        raise ConfigurationError(
            f"MuJoCo runs {', '.join(MUJOCO_EXPERIMENTS)}, not '{scenario.experiment}': leave out "
            f"--simulator mujoco, or engine: mujoco."
        )
    own, usual = plain_data(scenario), plain_data(SingleArmScenario())
    if other := [name for name in _DRAKE_ONLY if own[name] != usual[name]]:
        raise ConfigurationError(
            f"MuJoCo runs the arm six as its model knows it, and the scenario gives "
            f"{', '.join(other)}, for Drake alone: leave out --simulator mujoco, or these keys."
        )


def _check_periods(scenario: SingleArmScenario) -> None:
    step = scenario.plant.time_step
    for name in ("sampling", "sensor"):
        if (period := getattr(scenario, name).period) != step:
            raise ConfigurationError(
                f"{name}.period is {period:g} s; in MuJoCo it must be plant.time_step, {step:g} s."
            )
