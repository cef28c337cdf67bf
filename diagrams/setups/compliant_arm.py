"""An arm of the cell under six-DOF impedance control, connected and logged.

```
 desired_motion ──▶ controller ──actuation──▶ plant: arm ═ sensor ═ what the hand holds
                     ▲      ▲                  │ │
                     │      └── state ─────────┘ │
                     └── reaction forces ────────┘
```
"""

from dataclasses import dataclass
from typing import Any

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, Joint, ModelInstanceIndex
from pydrake.systems.framework import OutputPort, System

from geoimp_drake.controllers.impedance_controller import make_impedance_controller
from geoimp_drake.controllers.safety import add_safety_limits
from geoimp_drake.controllers.sensor_checks import sampled_loop
from geoimp_drake.controllers.wrist_sensor import connect_wrist_sensors, wrist_sensor_at
from geoimp_drake.diagrams.scene.cell import WRIST_SENSOR
from geoimp_drake.diagrams.setups.arm_log import record_arm
from geoimp_drake.diagrams.setups.run_settings import CompliantArmSettings
from geoimp_drake.diagrams.setups.setup_builder import SetupBuilder
from geoimp_drake.laws.prediction.sampled_loop import SampledLoop
from geoimp_drake.parts.wrist_sensor_config import WristSensor
from geoimp_drake.systems.arm.industrial_controller import make_industrial_controller

__all__ = ["CompliantArm", "add_compliant_arm", "sensor_joint_of"]


@dataclass
class CompliantArm:
    """The parts that `add_compliant_arm` put into a diagram."""

    name: str  # of the arm, in plant and log
    end_effector: Frame
    desired_motion: OutputPort
    controller: System
    torques: OutputPort
    loop: SampledLoop | None  # about the start, in free space; None if the scheme has no such loop

    def record(self, setup: SetupBuilder[Any]) -> None:
        """Logs the keys of the log contract; in another world also E as the controller sees it."""
        ports = {
            "u": self.torques,
            "motion_E": setup.true_plant.motion(self.end_effector, "motion_of_E"),
            "motion_D": self.desired_motion,
            "motion_C": self.controller.GetOutputPort("compliant_motion"),
            "wrench": self.controller.GetOutputPort("wrench"),
            "wrench_true": self.controller.GetOutputPort("wrench_true"),
            "energy": self.controller.GetOutputPort("energy"),
        }
        for name in ("limited", "compensation"):
            if self.controller.HasOutputPort(name):
                ports[name] = self.controller.GetOutputPort(name)
        if setup.is_another_world:
            ports["motion_E_known"] = self.controller.GetOutputPort("measured_motion")
        record_arm(setup.recorder, setup.plant, self.name, ports)


def add_compliant_arm(
    setup: SetupBuilder[Any],
    arm: str,
    E: Frame,
    sensor_joint: Joint,
    desired_motion: OutputPort,
    settings: CompliantArmSettings,
) -> CompliantArm:
    """Adds impedance controller and wrist sensor of one arm, connected to the plant.

    Args:
        setup: its plant contains the arm and its sensor.
        arm: name of its model instance.
        E: the frame that is made compliant.
        sensor_joint: the weld that its wrist sensor reads.
        desired_motion: of D in W (19).
        settings: those of controller and sensor, and the seed.
    """
    builder, plant = setup.builder, setup.plant
    instance = plant.GetModelInstanceByName(arm)
    # If the tool's inertial load is removed by reference, C's motion gives the load. D's motion
    # would leave 1e-3 of misalignment in the experiments where a torque turns the hand.
    sensor = wrist_sensor_at(
        plant, sensor_joint, E, settings.seeded_sensor(), name=f"{arm}_{WRIST_SENSOR}"
    )
    controller = builder.AddSystem(
        make_impedance_controller(plant, instance, E, settings, sensor=sensor)
    )
    connect_wrist_sensors(builder, plant, controller)

    # Desired motion and joint state go in, torques come out.
    desired_motion = _with_safety(setup, instance, E, controller, desired_motion, settings)
    setup.true_plant.connect_readings(instance, controller.GetInputPort("estimated_state"))
    if settings.scheme == "admittance":
        torques = _add_servos(setup, instance, E, controller, settings)
    else:
        torques = controller.GetOutputPort("actuation")
    setup.true_plant.connect_torques(torques, instance)
    setup.true_plant.hang_payloads(sensor_joint)
    return CompliantArm(
        arm, E, desired_motion, controller, torques, _sampled_loop(sensor, settings)
    )


def _sampled_loop(sensor: WristSensor, settings: CompliantArmSettings) -> SampledLoop | None:
    """Returns the loop that the wrench closes, if there is one."""
    if sensor.inertia is None or settings.scheme == "admittance" or settings.is_natural:
        return None
    return sampled_loop(
        sensor.inertia,
        settings.impedance,
        settings.motion,
        settings.sampling,
        sensor.config,
        is_direct=settings.scheme == "direct",
    )


def _with_safety(
    setup: SetupBuilder[Any],
    instance: ModelInstanceIndex,
    E: Frame,
    controller: System,
    desired_motion: OutputPort,
    settings: CompliantArmSettings,
) -> OutputPort:
    """Connects the desired motion, through the safety limits if there are any; returns D."""
    builder = setup.builder
    if settings.safety is None:
        builder.Connect(desired_motion, controller.GetInputPort("desired_motion"))
        return desired_motion
    limits = add_safety_limits(
        builder,
        setup.plant,
        instance,
        E,
        settings,
        settings.safety,
        controller=controller,
        desired_motion=desired_motion,
        wrench=controller.GetOutputPort("wrench"),
    )
    setup.true_plant.connect_readings(instance, limits.GetInputPort("estimated_state"))
    return limits.GetOutputPort("safe_motion")


def _add_servos(
    setup: SetupBuilder[Any],
    instance: ModelInstanceIndex,
    E: Frame,
    controller: System,
    settings: CompliantArmSettings,
) -> OutputPort:
    """Adds the joint servos that the scheme admittance streams to; returns their torques."""
    builder, plant = setup.builder, setup.plant
    servos = builder.AddSystem(
        make_industrial_controller(plant, instance, E, None, settings.joint_servos())
    )
    setup.true_plant.connect_readings(instance, servos.GetInputPort("estimated_state"))
    reference = controller.GetOutputPort("joint_reference")
    builder.Connect(reference, servos.GetInputPort("joint_reference"))
    return servos.GetOutputPort("actuation")


def sensor_joint_of(plant: MultibodyPlant, arm: str) -> Joint:
    """Returns the weld that the wrist sensor of one of the cell's arms reads."""
    return plant.GetJointByName(WRIST_SENSOR, plant.GetModelInstanceByName(f"{arm}_sensor"))
