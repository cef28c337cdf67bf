"""What a scenario asks for and a drive does not do is refused before a robot is looked for."""

import pytest
from pydrake.multibody.plant import MultibodyPlant

from geoimp_drake.controllers.admittance_controller import AdmittanceLoop
from geoimp_drake.controllers.control_loop import ControlLoop
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.setups.driven_arm import ScenarioDrive
from geoimp_drake.diagrams.setups.single_arm import add_single_arm
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.errors import ConfigurationError


def scenario(*settings: str) -> SingleArmScenario:
    return get_experiment("collision").scenario((), ("body=null", *settings))


def test_a_drive_refuses_safety_before_its_robot_is_looked_for() -> None:
    with pytest.raises(ConfigurationError, match=r"^safety is given, .* use geoimp run\.$"):
        ScenarioDrive(scenario())


@pytest.mark.parametrize("settings", [(), ("impedance.spring=axis-angle",)])
def test_a_drive_refuses_what_is_for_a_simulated_plant(settings: tuple[str, ...]) -> None:
    """A spring without a potential never comes to a robot, nor is a hand left out in silence."""
    turned = get_experiment("orientation_loop").scenario((), settings)
    with pytest.raises(ConfigurationError, match=r"^experiment is 'orientation_loop'"):
        ScenarioDrive(turned)


@pytest.mark.parametrize(
    ("loop", "settings"), [(ControlLoop, ()), (AdmittanceLoop, ("scheme=admittance",))]
)
def test_a_loop_called_by_hand_refuses_safety(loop: type, settings: tuple[str, ...]) -> None:
    own, plant = scenario(*settings), MultibodyPlant(1e-3)
    E, _ = add_single_arm(plant, own)
    with pytest.raises(ConfigurationError, match=r"^safety is given, but a controller"):
        loop(plant, plant.GetModelInstanceByName(own.arm), E, own)
