"""Drake's own settings in a scenario, checked before Drake sees them.

Some of them Drake refuses with an error that does not name the key, others by ending the process.
"""

from pydrake.multibody.plant import MultibodyPlantConfig
from pydrake.systems.analysis import GetIntegrationSchemes, SimulatorConfig

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.validation import choice, non_negative, positive

__all__ = ["check_plant_config", "check_simulator_config"]

CONTACT_MODELS = ("point", "hydroelastic", "hydroelastic_with_fallback")
CONTACT_APPROXIMATIONS = ("lagged", "sap", "similar")
CONTACT_SURFACES = ("polygon", "triangle")


def check_plant_config(config: MultibodyPlantConfig, name: str = "plant") -> None:
    """Raises ConfigurationError if no plant can be made from the settings; `name` is their key."""
    positive(config.time_step, f"{name}.time_step", "s")
    positive(config.penetration_allowance, f"{name}.penetration_allowance", "m")
    positive(config.stiction_tolerance, f"{name}.stiction_tolerance", "m/s")
    non_negative(config.sap_near_rigid_threshold, f"{name}.sap_near_rigid_threshold")
    choice(config.contact_model, f"{name}.contact_model", CONTACT_MODELS)
    choice(
        config.discrete_contact_approximation,
        f"{name}.discrete_contact_approximation",
        CONTACT_APPROXIMATIONS,
    )
    choice(
        config.contact_surface_representation,
        f"{name}.contact_surface_representation",
        CONTACT_SURFACES,
    )


def check_simulator_config(config: SimulatorConfig, name: str = "simulator") -> None:
    """Raises ConfigurationError if a simulator cannot use the settings; `name` is their key."""
    choice(config.integration_scheme, f"{name}.integration_scheme", GetIntegrationSchemes())
    positive(config.max_step_size, f"{name}.max_step_size", "s")
    positive(config.accuracy, f"{name}.accuracy")
    non_negative(config.target_realtime_rate, f"{name}.target_realtime_rate")
    if config.start_time != 0.0:
        raise ConfigurationError(
            f"{name}.start_time is {config.start_time:g} s; motions begin at zero, leave it 0."
        )
