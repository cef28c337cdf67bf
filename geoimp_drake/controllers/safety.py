"""The safety limits of an arm, connected before its impedance controller."""

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex
from pydrake.systems.framework import DiagramBuilder, OutputPort, System

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.systems.naming import name_after_arms
from geoimp_drake.systems.safety_limits import SafetyConfig, SafetyLimits

__all__ = ["add_safety_limits", "refuse_safety"]


def add_safety_limits(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    model_instance: ModelInstanceIndex,
    end_effector_frame: Frame,
    config: ImpedanceControllerConfig,
    safety: SafetyConfig,
    *,
    controller: System,
    desired_motion: OutputPort,
    wrench: OutputPort,
) -> SafetyLimits:
    """Adds the block between a desired motion and a controller of either form.

    Its input `estimated_state` remains to be connected, like that of the controller.

    Args:
        builder: which contains the controller.
        plant: this and the next three are those of `make_impedance_controller`.
        model_instance: see there.
        end_effector_frame: see there.
        config: see there.
        safety: limits and their source.
        controller: of the arm.
        desired_motion: of D.
        wrench: h of the arm, from a wrist sensor or a momentum observer.

    Raises:
        ConfigurationError: the configuration cannot be used. The translation has no impedance, or
            gains that are not in W.
    """
    impedance = config.impedance
    if config.is_natural or impedance.stiffness_is_in_desired():
        raise ConfigurationError(
            "safety needs gains of the translation in W: give translation.axes: world, no "
            "coupling, and inertia: given."
        )
    if impedance.axes not in ("both", "translation"):
        raise ConfigurationError(
            f"safety is given, but impedance.axes is '{impedance.axes}': the hand goes where D "
            f"goes, however much force that takes. Give impedance.axes: both or translation."
        )
    model = ControlModel.of_arm(plant, model_instance, end_effector_frame)
    limits = SafetyLimits(model, impedance.gains("translation"), safety, config.sampling.period)
    limits.set_name(name_after_arms(plant, [model_instance], "safety_limits"))
    builder.AddSystem(limits)
    for source, name in (
        (desired_motion, "desired_motion"),
        (controller.GetOutputPort("last_compliant_motion"), "compliant_motion"),
        (wrench, "wrench"),
    ):
        builder.Connect(source, limits.GetInputPort(name))
    for own, name in (("safe_motion", "desired_motion"), ("stiffness_scale",) * 2):
        builder.Connect(limits.GetOutputPort(own), controller.GetInputPort(name))
    return limits


def refuse_safety(config: ImpedanceControllerConfig) -> None:
    """Raises ConfigurationError if a loop called by hand is given the `safety` of a scenario."""
    if getattr(config, "safety", None) is not None:
        raise ConfigurationError(
            "safety is given, but a controller that is called by hand, as geoimp drive does, takes "
            "D as it is: nobody would be protected. Leave safety out, or use geoimp run."
        )
