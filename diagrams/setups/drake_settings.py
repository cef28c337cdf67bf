"""Drake's own settings in a scenario, checked before Drake sees them.

Drake refuses some of them with an error that does not name the key, and ends the process for
others.
"""

from pydrake.multibody.plant import MultibodyPlantConfig
from pydrake.systems.analysis import GetIntegrationSchemes, SimulatorConfig

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.validation import choice, non_negative, positive

__all__ = ["check_plant_config", "check_simulator_config"]

CONTACT_MODELS = ("point", "hydroelastic", "hydroelastic_with_fallback")
CONTACT_APPROXIMATIONS = ("lagged", "sap", "similar")
CONTACT_SURFACES = ("polygon", "triangle")
_SLOWEST_RATE = 1e-3


def check_plant_config(config: MultibodyPlantConfig, name: str = "plant") -> None:
    """Raises ConfigurationError if no plant can have these settings; `name` is their key."""
    non_negative(config.time_step, f"{name}.time_step", "s")  # zero: a continuous plant
    positive(config.penetration_allowance, f"{name}.penetration_allowance", "m")
    positive(config.stiction_tolerance, f"{name}.stiction_tolerance", "m/s")
    non_negative(config.sap_near_rigid_threshold, f"{name}.sap_near_rigid_threshold")
    choice(config.contact_model, f"{name}.contact_model", CONTACT_MODELS)
    choice(
        config.discrete_contact_approximation,
        f"{name}.discrete_contact_approximation",
        CONTACT_APPROXIMATIONS,
    )
    if config.time_step == 0 and config.contact_model != "point":
        raise ConfigurationError(
            f"{name}.time_step is 0, a continuous plant, and {name}.contact_model is "
            f"'{config.contact_model}': Drake leaves gravity out of its reaction forces then, and "
            f"a wrist sensor would take the tool's weight for contact. Set {name}.contact_model "
            f"to 'point', or give a time step."
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
    rate = config.target_realtime_rate
    if rate != 0 and not rate >= _SLOWEST_RATE:
        raise ConfigurationError(
            f"{name}.target_realtime_rate is {rate:g}; give 0, as fast as possible, or "
            f"{_SLOWEST_RATE:g} or more."
        )
    if config.start_time != 0.0:
        raise ConfigurationError(
            f"{name}.start_time is {config.start_time:g} s; motions begin at zero, leave it 0."
        )
