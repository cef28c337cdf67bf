"""Settings of every scenario: length and log of the run, its sensors and Drake's own settings."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from pydrake.multibody.plant import MultibodyPlantConfig
from pydrake.systems.analysis import SimulatorConfig

from geoimp_drake.controllers.config import ImpedanceControllerConfig, SamplingConfig
from geoimp_drake.diagrams.setups.drake_settings import check_plant_config, check_simulator_config
from geoimp_drake.diagrams.setups.world import WorldConfig
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.wrist_sensor_config import WristSensorConfig
from geoimp_drake.systems.arm.industrial_controller import IndustrialControllerConfig
from geoimp_drake.systems.safety_limits import SafetyConfig
from geoimp_drake.systems.sources.desired_motion import MotionSegment, length_of
from geoimp_drake.validation import LARGEST_SEED, choice, key, positive, whole_number

__all__ = ["ENGINES", "CompliantArmSettings", "RunSettings", "differenced"]

# Simulators; the first is the default of every experiment.
ENGINES = ("drake", "mujoco")

# Limits of one run: a day of computing, and 2 GB of log with two arms.
_MOST_STEPS, _MOST_ROWS = 1e9, 1e6
_ROW = 2e-6  # [GB]


@dataclass
class RunSettings:
    """Settings of a run that do not depend on the contents of the cell."""

    experiment: str = "plexiglas"  # gives the claims and figures
    seed: int = 0  # of the sensors' noise; the one in `sensor` is added to it
    duration: float | None = None  # [s]; all of the motion if not given
    log_period: float = 0.01  # [s]
    sensor: WristSensorConfig = field(default_factory=WristSensorConfig)
    world: WorldConfig = field(default_factory=WorldConfig)
    plant: MultibodyPlantConfig = field(
        default_factory=lambda: MultibodyPlantConfig(
            time_step=1e-3,
            contact_model="hydroelastic_with_fallback",
            discrete_contact_approximation="sap",
        )
    )
    simulator: SimulatorConfig = field(
        default_factory=lambda: SimulatorConfig(
            integration_scheme="explicit_euler", max_step_size=1e-3, use_error_control=False
        )
    )
    engine: str = "drake"  # the simulator; or mujoco

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        choice(self.engine, key(name, "engine"), ENGINES)
        period = key(name, "log_period")
        positive(self.log_period, period, "s")
        whole_number(self.seed, key(name, "seed"), 0, LARGEST_SEED)
        check_plant_config(self.plant, key(name, "plant"))
        check_simulator_config(self.simulator, key(name, "simulator"))
        self.world.check_step(key(name, "world"), self.plant.time_step)
        if self.log_period < self.plant.time_step:
            raise ConfigurationError(
                f"{period} is {self.log_period:g} s; it must not be shorter than "
                f"{key(name, 'plant.time_step')}, {self.plant.time_step:g} s."
            )
        if self.duration is not None:
            positive(self.duration, key(name, "duration"), "s")
            self.check_length(self.duration)

    def seeded_sensor(self) -> WristSensorConfig:
        """Returns the configuration of the sensors with the run's seed added to their own."""
        return replace(self.sensor, seed=self.seed + self.sensor.seed)

    def check_moves(self, segments: Sequence[MotionSegment]) -> None:
        """Raises ConfigurationError if nothing gives the run's length, or if it is too long."""
        if self.duration is not None:
            return
        if not segments:
            raise ConfigurationError("There is no motion; give a duration.")
        self.check_length(length_of(segments))

    def check_length(self, duration: float) -> None:
        """Raises ConfigurationError if a run of a duration [s] has too many steps or log rows.

        Every part with a `period` adds steps to the simulation.
        """
        periods = [part.period for part in vars(self).values() if hasattr(part, "period")]
        step = min(self.plant.time_step or np.inf, self.simulator.max_step_size, *periods)
        steps, rows = duration / step, duration / self.log_period
        if steps > _MOST_STEPS or rows > _MOST_ROWS:
            raise ConfigurationError(
                f"A run of {duration:g} s has {steps:.3g} steps of {step:g} s and {rows:.3g} rows "
                f"of log, about {_ROW * rows:.2g} GB; at most {_MOST_STEPS:g} steps and "
                f"{_MOST_ROWS:g} rows are computed. Give a shorter duration, or longer periods."
            )


def differenced() -> SamplingConfig:
    """Returns how scenarios read the joints: velocities are differences of positions."""
    return SamplingConfig(velocity="differenced")


@dataclass
class CompliantArmSettings(ImpedanceControllerConfig, RunSettings):
    """Settings of a run with one compliant arm, its controller's included."""

    sampling: SamplingConfig = field(default_factory=differenced)
    # Of the scheme admittance: the arm's own joint servos, with the period of sampling; null for
    # their defaults.
    servos: IndustrialControllerConfig | None = None
    safety: SafetyConfig | None = None  # limits for somebody whom the arm may hit

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        ImpedanceControllerConfig.validate(self, name)
        RunSettings.validate(self, name)
        self.check_is_streamed(key(name, "servos"), self.servos)
        if self.servos is not None and self.servos.period != self.sampling.period:
            raise ConfigurationError(
                f"{key(name, 'servos.period')} is {self.servos.period:g} s and "
                f"{key(name, 'sampling.period')}, with which references come, "
                f"{self.sampling.period:g} s; give the same."
            )

    def joint_servos(self) -> IndustrialControllerConfig:
        """Returns the configuration of the arm's own servos."""
        return self.servos or IndustrialControllerConfig(period=self.sampling.period)
