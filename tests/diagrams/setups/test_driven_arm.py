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


@pytest.mark.parametrize(
    ("loop", "settings"), [(ControlLoop, ()), (AdmittanceLoop, ("scheme=admittance",))]
)
def test_a_loop_called_by_hand_refuses_safety(loop: type, settings: tuple[str, ...]) -> None:
    own, plant = scenario(*settings), MultibodyPlant(1e-3)
    E, _ = add_single_arm(plant, own)
    with pytest.raises(ConfigurationError, match=r"^safety is given, but a controller"):
        loop(plant, plant.GetModelInstanceByName(own.arm), E, own)
