"""One arm under six-DOF impedance control, and somebody's hand that turns its end effector.

```
 desired_motion ──▶ compliant arm ◀──▶ plant: arm ═ sensor ═ E ◀── turning_hand
```
"""

from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform
from pydrake.multibody.tree import Frame

from geoimp_drake.diagrams.scene.turning_hand import TurningHand
from geoimp_drake.diagrams.setups.setup import Setup
from geoimp_drake.diagrams.setups.setup_builder import SetupBuilder
from geoimp_drake.diagrams.setups.single_arm import build_single_arm
from geoimp_drake.diagrams.setups.turned_arm_scenario import TurnedArmScenario
from geoimp_drake.rotations import quaternion

__all__ = ["build_turned_arm"]


def build_turned_arm(
    scenario: TurnedArmScenario,
    meshcat: Meshcat | None = None,
    *,
    live: bool = False,
    logged: bool = True,
) -> Setup:
    """Builds the diagram of a scenario; arguments and errors as of `build_single_arm`."""

    def add_hand(setup: SetupBuilder, E: Frame, X_WE: RigidTransform) -> None:
        Q_WD = quaternion.from_rotation(X_WE.rotation().matrix())
        hand = setup.builder.AddNamedSystem("turning_hand", TurningHand(E, scenario.hand, Q_WD))
        for name in ("body_poses", "body_spatial_velocities"):
            setup.builder.Connect(setup.plant.GetOutputPort(name), hand.GetInputPort(name))
        setup.push(hand.GetOutputPort("applied_spatial_force"))
        if setup.is_logged:
            setup.recorder.record("hand/moment", hand.GetOutputPort("moment"))

    scenario.duration = scenario.length
    return build_single_arm(scenario, meshcat, live=live, logged=logged, add_hand=add_hand)
