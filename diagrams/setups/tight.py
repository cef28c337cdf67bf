"""Tight cooperation: two arms hold a bar; the object gets an impedance, and the grasp, too.

```
 desired_motion ─▶ cooperative controller ◀──▶ plant: arm ═ sensor ═ rod ═ bar ═ rod ═ sensor ═ arm
                                                                          ║ stick
                                                                        ──── disk ▷ surface
```

The first hand is that of the seven-joint arm, at the bar's end towards −y; the second one is that
of the six-joint arm.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, LinearBushingRollPitchYaw, RigidBody
from pydrake.systems.framework import Context, OutputPort, System

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.cooperative_controller import make_cooperative_controller
from geoimp_drake.controllers.sensor_checks import sampled_loop
from geoimp_drake.controllers.wrist_sensor import (
    connect_wrist_sensors,
    tool_load_beyond,
    wrist_sensor_at,
)
from geoimp_drake.diagrams.scene.bar import add_bar, add_grasp, open_grasp
from geoimp_drake.diagrams.scene.cell import SEVEN, SIX, WRIST_SENSOR, add_cell
from geoimp_drake.diagrams.scene.rod import add_rod
from geoimp_drake.diagrams.scene.surface import surface_plane
from geoimp_drake.diagrams.scene.surface_placement import check_clear
from geoimp_drake.diagrams.setups.arm_log import record_arm
from geoimp_drake.diagrams.setups.compliant_arm import sensor_joint_of
from geoimp_drake.diagrams.setups.posture import StartConfig, start_posture
from geoimp_drake.diagrams.setups.setup import Setup
from geoimp_drake.diagrams.setups.setup_builder import SetupBuilder
from geoimp_drake.diagrams.setups.tight_scenario import ARMS, OBJECT, TightScenario
from geoimp_drake.diagrams.setups.true_plant import add_friction
from geoimp_drake.laws.prediction.sampled_loop import SampledLoop
from geoimp_drake.parts.object_load import ObjectLoad
from geoimp_drake.parts.wrist_sensor_config import WristSensor
from geoimp_drake.rotations import euler
from geoimp_drake.simulation.run import Event
from geoimp_drake.typing import Array
from geoimp_drake.validation import finite_vector

__all__ = ["build_tight"]

# Attitude of each hand at the start: it faces the other one.
_HAND_ATTITUDES = {SEVEN: np.array([-90.0, 0.0, -90.0]), SIX: np.array([90.0, 0.0, -90.0])}


@dataclass
class _Models:
    """The models that were added to a plant."""

    hands: dict[str, Frame]  # E by arm
    bar: RigidBody
    bushing: LinearBushingRollPitchYaw | None

    def disk(self) -> RigidTransform:
        """Returns X_OD."""
        instance = self.bar.model_instance()
        frame = self.bar.GetParentPlant().GetFrameByName("disk", instance)
        X_OD: RigidTransform = frame.GetFixedPoseInBodyFrame()
        return X_OD


def build_tight(
    scenario: TightScenario,
    meshcat: Meshcat | None = None,
    *,
    live: bool = False,
    logged: bool = True,
) -> Setup:
    """Builds the diagram of a scenario.

    Args:
        scenario: its open fields are filled in.
        meshcat: draws the run; None for no drawing.
        live: add sliders there, see `SetupBuilder`.
        logged: with its log, see there.

    Raises:
        ConfigurationError: the scenario cannot be used; the message says why.
    """
    setup = SetupBuilder(
        scenario, lambda plant: _add_models(plant, scenario), meshcat, live=live, logged=logged
    )
    builder, plant, models = setup.builder, setup.plant, setup.models
    _take_hold(plant, models, scenario)
    X_WO = RigidTransform(scenario.centre)
    if scenario.surface is not None:
        check_clear(X_WO @ models.disk(), surface_plane(scenario.surface.pose()), "centre")
    desired = setup.add_desired_motion(X_WO, scenario.segments)
    sensors = _sensors(plant, models, scenario)
    controller = builder.AddSystem(_controller(plant, models, scenario, sensors))
    connect_wrist_sensors(builder, plant, controller)
    builder.Connect(desired, controller.GetInputPort("desired_motion"))
    for k, arm in enumerate(ARMS, 1):
        instance = plant.GetModelInstanceByName(arm)
        # Joint states go in, torques come out.
        setup.true_plant.connect_readings(instance, controller.GetInputPort(f"estimated_state_{k}"))
        setup.true_plant.connect_torques(controller.GetOutputPort(f"actuation_{k}"), instance)
        setup.true_plant.hang_payloads(sensor_joint_of(plant, arm))
    if setup.is_logged:
        _record(setup, scenario, desired, controller)
    setup.record_surface(scenario.surface, np.array([0.0, 0.0, -scenario.bar.stick]))
    wrench = controller.GetOutputPort("object_wrench")
    setup.add_views(OBJECT, "DCO", wrench, controller, models.bar.body_frame())
    loop = _sampled_loop(sensors[0], scenario)
    return setup.build(_release(plant, models, scenario), loop, scenario.surface, len(ARMS))


def _sampled_loop(sensor: WristSensor, scenario: TightScenario) -> SampledLoop | None:
    """Returns the loop of a hand with half of the object's gains, and half of its environment."""
    if sensor.inertia is None:
        return None
    return sampled_loop(
        sensor.inertia,
        scenario.impedance,
        scenario.motion,
        scenario.sampling,
        sensor.config,
        hands=len(ARMS),
    )


def _add_models(
    plant: MultibodyPlant, scenario: TightScenario, offsets: Mapping[str, Array] | None = None
) -> _Models:
    """Adds arms, sensors, rods, bar, grasps and surface; `offsets` moves bases of arms [m]."""
    add_cell(plant, "two_arms", offsets)
    hands = {arm: add_rod(plant, arm, scenario.rod, _attitude(arm).inverse()) for arm in ARMS}
    bar = add_bar(plant, scenario.bar)
    ends = dict(zip(ARMS, (plant.GetFrameByName(f"end_{k}") for k in (1, 2)), strict=True))
    plant.WeldFrames(hands[scenario.carrier], ends[scenario.carrier])
    other = next(arm for arm in ARMS if arm != scenario.carrier)
    models = _Models(hands, bar, add_grasp(plant, hands[other], ends[other], scenario.grasp))
    if scenario.surface is not None and plant.geometry_source_is_registered():
        scenario.surface.add(plant, bar, models.disk(), scenario.disk_resolution_hint)
    add_friction(plant, scenario.world)
    plant.Finalize()
    return models


def _attitude(arm: str) -> RotationMatrix:
    """Returns R_WS of an arm's hand at the start."""
    return RotationMatrix(euler.to_rotation(np.deg2rad(_HAND_ATTITUDES[arm])))


def _take_hold(plant: MultibodyPlant, models: _Models, scenario: TightScenario) -> None:
    """Puts both hands, parallel to W, to the places where they hold the bar."""
    load = [models.bar.model_instance()]
    for arm, position in scenario.ends().items():
        instance = plant.GetModelInstanceByName(arm)
        model = ControlModel.of_arm(plant, instance, models.hands[arm], without=load)
        guess = np.array(scenario.guesses.get(arm, np.zeros(model.num_joints)))
        finite_vector(guess, f"guesses.{arm}", model.num_joints)
        start = StartConfig(position=position, attitude_deg=np.zeros(3), guess=guess)
        posture, _ = start_posture(model, start, regular=scenario.limits is None)
        plant.SetDefaultPositions(instance, posture)


def _controller(
    plant: MultibodyPlant,
    models: _Models,
    scenario: TightScenario,
    sensors: Sequence[WristSensor],
) -> System:
    """Returns the controller, made for the assumed cell."""
    if np.any(scenario.assumed.base_offset):
        plant = MultibodyPlant(scenario.plant.time_step)
        models = _add_models(plant, scenario, {SIX: scenario.assumed.base_offset})
    return make_cooperative_controller(
        plant,
        [plant.GetModelInstanceByName(arm) for arm in ARMS],
        [models.hands[arm] for arm in ARMS],
        scenario.told(_load(models.bar)),
        loads=[models.bar.model_instance()],
        sensors=sensors,
    )


def _load(bar: RigidBody) -> ObjectLoad:
    """Returns the load of the hands; its frame is O."""
    M_OOo = bar.default_spatial_inertia()
    p_OG = M_OOo.get_com()
    inertia = M_OOo.Shift(p_OG).CalcRotationalInertia().CopyToFullMatrix3()
    return ObjectLoad(mass=M_OOo.get_mass(), centre_of_mass=p_OG, inertia=inertia)


def _sensors(plant: MultibodyPlant, models: _Models, scenario: TightScenario) -> list[WristSensor]:
    """Returns a sensor for each hand; its own rod is removed from the reading, the bar is not."""
    # At the start each hand bears half of the bar, and neither turns it.
    share = -0.5 * models.bar.default_mass() * plant.gravity_field().gravity_vector()
    initial = np.concatenate((np.zeros(3), share))
    sensors, config = [], scenario.seeded_sensor()
    for arm in ARMS:
        joint = sensor_joint_of(plant, arm)
        tool = tool_load_beyond(plant, joint, without=[models.bar.model_instance()])
        name = f"{arm}_{WRIST_SENSOR}"
        hand = models.hands[arm]
        sensors.append(wrist_sensor_at(plant, joint, hand, config, tool, initial, name))
    return sensors


def _record(
    setup: SetupBuilder[_Models], scenario: TightScenario, desired: OutputPort, controller: System
) -> None:
    """Logs the keys of the log contract for a tight cooperation."""
    true, recorder, plant, models = setup.true_plant, setup.recorder, setup.plant, setup.models
    for k, arm in enumerate(ARMS, 1):
        ports = {
            "u": controller.GetOutputPort(f"actuation_{k}"),
            "motion_E": true.motion(models.hands[arm], f"motion_of_E_{k}"),
            "motion_r": controller.GetOutputPort(f"reference_motion_{k}"),
            "wrench": controller.GetOutputPort(f"wrench_{k}"),
            "wrench_true": controller.GetOutputPort(f"wrench_true_{k}"),
        }
        if scenario.limits is not None:
            ports["limited"] = controller.GetOutputPort(f"limited_{k}")
        record_arm(recorder, plant, arm, ports)
    for key, port in {
        "motion_O": controller.GetOutputPort("object_motion"),
        "motion_D": desired,
        "motion_C": controller.GetOutputPort("compliant_motion"),
        "motion_bar": true.motion(models.bar.body_frame(), "motion_of_bar"),
        "wrench": controller.GetOutputPort("object_wrench"),
        "wrench_internal": controller.GetOutputPort("internal_wrench"),
        "energy": controller.GetOutputPort("energy"),
    }.items():
        recorder.record(f"{OBJECT}/{key}", port)
    if scenario.monitor.enabled:
        recorder.record("grasp/opened", controller.GetOutputPort("opened"))


def _release(plant: MultibodyPlant, models: _Models, scenario: TightScenario) -> list[Event]:
    """Returns the opening of the grasp, if it is to open."""
    if scenario.release is None or models.bushing is None:
        return []
    bushing = models.bushing

    def open_it(context: Context) -> None:
        open_grasp(bushing, plant.GetMyMutableContextFromRoot(context))

    return [Event(scenario.release, open_it)]
