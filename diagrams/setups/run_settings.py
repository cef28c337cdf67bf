"""What every scenario has: length and log of the run, the control, and Drake's own settings."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from pydrake.multibody.plant import MultibodyPlantConfig
from pydrake.systems.analysis import SimulatorConfig

from geoimp_drake.controllers.config import (
    ImpedanceConfig,
    ImpedanceControllerConfig,
    MotionConfig,
    RedundancyConfig,
    SamplingConfig,
)
from geoimp_drake.diagrams.setups.drake_settings import check_plant_config, check_simulator_config
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.wrist_sensor_config import WristSensorConfig
from geoimp_drake.systems.sources.desired_motion import MotionSegment
from geoimp_drake.validation import positive

__all__ = ["RunSettings"]


@dataclass
class RunSettings:
    """Settings of a run that do not depend on what is in the cell."""

    experiment: str = "plexiglas"  # names the claims and figures
    seed: int = 0  # of the sensors' noise
    duration: float | None = None  # [s]; all of the motion if not given
    log_period: float = 0.01  # [s]
    impedance: ImpedanceConfig = field(default_factory=ImpedanceConfig)
    motion: MotionConfig = field(default_factory=MotionConfig)
    sampling: SamplingConfig = field(default_factory=lambda: SamplingConfig(velocity="differenced"))
    redundancy: RedundancyConfig = field(default_factory=RedundancyConfig)
    form: str = "blocks"  # of the controller; or compiled: one system
    sensor: WristSensorConfig = field(default_factory=WristSensorConfig)
    plant: MultibodyPlantConfig = field(
        default_factory=lambda: MultibodyPlantConfig(
            time_step=1e-3,
            contact_model="hydroelastic",
            discrete_contact_approximation="sap",
        )
    )
    simulator: SimulatorConfig = field(
        default_factory=lambda: SimulatorConfig(
            integration_scheme="explicit_euler", max_step_size=1e-3, use_error_control=False
        )
    )

    def controller(self) -> ImpedanceControllerConfig:
        """Returns the controller's part."""
        return ImpedanceControllerConfig(
            self.impedance, self.motion, self.sampling, self.redundancy, self.form
        )

    def validate_run(self) -> None:
        """Raises ConfigurationError if one of these settings cannot be used."""
        positive(self.log_period, "log_period", "s")
        if self.duration is not None:
            positive(self.duration, "duration", "s")
        if self.seed < 0:
            raise ConfigurationError(f"seed is {self.seed}; it must not be negative.")
        self.controller().validate()
        self.sensor.validate()
        check_plant_config(self.plant)
        check_simulator_config(self.simulator)
        if self.log_period < self.plant.time_step:
            raise ConfigurationError(
                f"log_period is {self.log_period:g} s; it must not be shorter than "
                f"plant.time_step, {self.plant.time_step:g} s."
            )

    def validate_motion(self, segments: Sequence[MotionSegment]) -> None:
        """Raises ConfigurationError if a segment cannot be used, or nothing says how long it is."""
        for index, segment in enumerate(segments):
            segment.validate(f"segments.{index}")
        if not segments and self.duration is None:
            raise ConfigurationError("There is no motion; give a duration.")
