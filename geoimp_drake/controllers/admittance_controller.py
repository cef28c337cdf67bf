"""The impedance controller of a position-controlled arm: a Diagram, one system, or a loop."""

from collections.abc import Sequence
from typing import NamedTuple

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex
from pydrake.systems.framework import DiagramBuilder, System

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.arm_loop import ArmLoop
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.forms import add_passivity, connect_wrenches, make_compiled
from geoimp_drake.controllers.safety import refuse_safety
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.admittance_controller import AdmittanceController
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.inverse_kinematics import InverseKinematics
from geoimp_drake.parts.passivity import Passivity
from geoimp_drake.parts.wrist_sensors import WristSensors
from geoimp_drake.systems.arm import inverse_kinematics
from geoimp_drake.systems.impedance_integrator import ImpedanceIntegrator
from geoimp_drake.typing import Array
from geoimp_drake.validation import check

__all__ = ["AdmittanceLoop", "JointReference", "make_admittance_controller"]


class JointReference(NamedTuple):
    """The reference for the servos of a position-controlled arm, in the robot's order of joints."""

    positions: Array  # q_d (n) [rad, m]
    velocities: Array  # q̇_d (n) [rad/s, m/s]


def make_admittance_controller(
    model: ControlModel, config: ImpedanceControllerConfig, sensors: WristSensors | None
) -> System:
    """Returns the controller of the scheme `admittance`; see `make_impedance_controller`.

    Args:
        model: the arm.
        config: checked.
        sensors: of the wrist; None if the wrench is an input.
    """
    impedance, kinematics = config.impedance.make(), config.make_kinematics(model)
    passivity = config.make_passivity(impedance)
    if config.form == "blocks":
        return _of_blocks(impedance, kinematics, sensors, passivity)
    return make_compiled(AdmittanceController(impedance, kinematics, sensors, passivity))


def _of_blocks(
    impedance: Impedance,
    kinematics: InverseKinematics,
    sensors: WristSensors | None,
    passivity: Passivity,
) -> System:
    builder = DiagramBuilder()
    compliant = builder.AddNamedSystem("impedance", ImpedanceIntegrator.of(impedance))
    joints = builder.AddNamedSystem(
        "inverse_kinematics", inverse_kinematics.InverseKinematics.of(kinematics)
    )
    # C starts on the measured pose of E.
    measured = joints.GetOutputPort("measured_motion")
    builder.Connect(measured, compliant.GetInputPort("measured_motion"))
    motion = compliant.GetOutputPort("compliant_motion")
    builder.Connect(motion, joints.GetInputPort("reference_motion"))
    # C is held back by what the limits leave undone.
    builder.Connect(joints.GetOutputPort("slack"), compliant.GetInputPort("slack"))
    builder.ExportInput(joints.GetInputPort("estimated_state"), "estimated_state")
    builder.ExportInput(compliant.GetInputPort("desired_motion"), "desired_motion")
    wrenches = [compliant.GetInputPort("wrench")]
    add_passivity(builder, compliant, passivity, measured, wrenches)
    for system, names in (
        (joints, [output.name for output in kinematics.outputs if output.name != "slack"]),
        (compliant, [output.name for output in impedance.outputs]),
    ):
        for name in names:
            builder.ExportOutput(system.GetOutputPort(name), name)
    reference = compliant.GetOutputPort("last_compliant_motion")
    connect_wrenches(builder, sensors, {"wrench": wrenches}, {"reference_motion": reference})
    return builder.Build()


class AdmittanceLoop(ArmLoop):
    """The controller of the scheme `admittance`, called by hand at each tick of a robot.

    It takes what a robot reports and returns positions and velocities for its servos, in the
    robot's own order of joints. C is integrated by explicit Euler over the time between ticks: with
    a stiff environment give a mass of at least 2 D Δt.

    Args:
        plant: finalized, contains the arm as `make_impedance_controller` wants it.
        model_instance: the arm.
        end_effector_frame: E, the frame that is made compliant.
        config: gains, orientation family and sampling; `scheme` is admittance.
        joints: the joints' names in the robot's order; by default that from base to hand.

    Attributes:
        config: gains, orientation family and sampling.
        model: the arm.
        joints: the order of q, v and references.
        period: of a tick, unless `step` is told another [s].
        gives: what `step` returns, `position`.

    Raises:
        ModelError: the plant does not contain such an arm.
        ConfigurationError: the configuration cannot be used, or `joints` are not those of the arm.
    """

    gives = "position"

    def __init__(
        self,
        plant: MultibodyPlant,
        model_instance: ModelInstanceIndex,
        end_effector_frame: Frame,
        config: ImpedanceControllerConfig,
        *,
        joints: Sequence[str] | None = None,
    ):
        check(config)
        refuse_safety(config)
        if config.scheme != "admittance":
            raise ConfigurationError(
                f"scheme is '{config.scheme}'; AdmittanceLoop is for admittance. Use ControlLoop, "
                f"which returns torques."
            )
        model = ControlModel.of_arm(plant, model_instance, end_effector_frame)
        impedance = config.impedance.make()
        passivity = config.make_passivity(impedance)
        part = AdmittanceController(impedance, config.make_kinematics(model), passivity=passivity)
        name = f"{plant.GetModelInstanceName(model_instance)}_admittance_loop"
        super().__init__(part, name, model, joints, config.sampling.period)
        self.config = config
        self._let_change(impedance, passivity)

    def reset(
        self, q: Array, v: Array, wrench: Array | None = None, desired: Array | None = None
    ) -> JointReference:
        """Starts C and the reference at rest on the measured posture; returns the reference.

        Args:
            q: joint positions (n) [rad, m].
            v: joint velocities (n) [rad/s, m/s].
            wrench: h by the end effector on the environment, about Eo, in W (6); zero by default.
            desired: motion of D in W (19); at rest on E by default.

        Raises:
            SignalError: a signal cannot be used.
        """
        self._start(q, v, wrench, desired)
        return self._reference()

    def step(
        self, q: Array, v: Array, wrench: Array, desired: Array, dt: float | None = None
    ) -> JointReference:
        """Returns the joint reference of the next tick.

        Args:
            q: joint positions (n) [rad, m]; they are reported, no law reads them.
            v: joint velocities (n) [rad/s, m/s].
            wrench: h by the end effector on the environment, about Eo, in W (6) [Nm, N].
            desired: motion of D in W, see `frame_motion` (19).
            dt: time since the last tick [s]; the period of sampling by default.

        Raises:
            SignalError: a signal is not finite or of another size, or no time has passed.
            SingularityError: the attitude leaves the domain of the orientation family.
        """
        readings = {"estimated_state": self.joints.reading(q, v), "wrench": wrench}
        elapsed = self.period if dt is None else dt
        self._loop.step(readings, {"desired_motion": desired}, elapsed)
        return self._reference()

    def _reference(self) -> JointReference:
        return JointReference(*self.joints.split(self._loop.output("joint_reference")))
