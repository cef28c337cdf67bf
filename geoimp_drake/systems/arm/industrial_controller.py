"""An industrial control unit: each joint has a PID servo that follows a reference."""

from dataclasses import dataclass

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex
from pydrake.systems.framework import BasicVector, Context, DiscreteStateIndex, State
from pydrake.trajectories import Trajectory

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.state import evaluate_arm
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.motion_control.joint_servo import servo_integral, servo_torque
from geoimp_drake.parts.signals import check_signal
from geoimp_drake.parts.torque import Saturation
from geoimp_drake.systems.naming import name_after_arms
from geoimp_drake.systems.part_system import Block
from geoimp_drake.typing import Array
from geoimp_drake.validation import (
    check,
    finite_vector,
    key,
    non_negative,
    positive,
    positive_vector,
)

__all__ = ["IndustrialController", "IndustrialControllerConfig", "make_industrial_controller"]


@dataclass
class IndustrialControllerConfig:
    """Joint servos of equal bandwidth ω and damping ζ.

    A joint that carries the inertia m has k_p = m ω², k_d = 2 ζ k_p / ω and k_i = `integral_rate`
    times k_p.
    """

    bandwidth: float = 30.0  # ω [rad/s]
    damping: float = 0.9  # ζ
    integral_rate: float = 4.5  # k_i / k_p [1/s]
    kp: Array | None = None  # one per joint [Nm/rad or N/m]; diag(B) ω² at the start if not given
    integral_limit: float = 1.0  # greatest integral part, as a fraction of the joint's effort limit
    period: float = 1e-3  # [s]
    preload: bool = True  # the integral part starts with the torque that holds the arm

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        for part in ("bandwidth", "damping", "integral_limit", "period"):
            positive(getattr(self, part), key(name, part))
        non_negative(self.integral_rate, key(name, "integral_rate"), "1/s")
        if self.kp is not None:
            positive_vector(self.kp, key(name, "kp"))


class IndustrialController(Block):
    """Follows joint references with one PID servo per joint and no model of the arm.

    At every sampling instant, for each joint on its own,

        e = q_d − q,   τ = k_p e + k_d (q̇_d − q̇) + z,   z ← z + k_i e Δt within its limit,

    and τ, limited to ± the effort limit, acts until the next instant. Saturation is reported: by
    `peak_effort`, and in Drake's log the first time that a joint saturates. Until the first instant
    τ = z, the holding torque. Before and after its trajectory the arm is held at the trajectory's
    ends. Without a trajectory, q_d and q̇_d are those of the port `joint_reference` at the sampling
    instant.

    This is a stiff position controller, which does not know the forces at the hand. See
    `make_impedance_controller` for a compliant one. Call `preset` before it takes an arm over from
    another controller.

    Args:
        model: the arm; only its limits and the order of its joints and actuators are used.
        trajectory: q_d over time, from the base to the hand (n) [rad or m]; None for the port.
        kp: proportional gains (n) [Nm/rad or N/m].
        holding_torque: z at the start (n) [Nm or N].
        config: the other gains, limit and sampling; `kp` and `preload` are not used.

    Raises:
        ConfigurationError: a gain, torque or the trajectory does not fit the arm.
        SignalError: the state or the reference at a port is NaN or infinite.

    Ports:
        input estimated_state: [q; v] of the model instance, in its own order (2n)
        input joint_reference: [q_d; q̇_d] in the same order; absent with a trajectory (2n)
        output actuation: τ in the order of the model instance's actuators (n) [Nm or N]
        output set_point: [q_d; q̇_d] in the order of `estimated_state` (2n)
        output peak_effort: largest torque so far as a fraction of the limit (n)
    """

    def __init__(
        self,
        model: ControlModel,
        trajectory: Trajectory | None,
        kp: Array,
        holding_torque: Array,
        config: IndustrialControllerConfig | None = None,
    ):
        super().__init__()
        config = config or IndustrialControllerConfig()
        check(config, "servo")
        n = model.num_joints
        if trajectory is not None:
            _check_rows(trajectory, n)
        self._model, self._trajectory, self._config = model, trajectory, config
        self._kp = positive_vector(kp, "servo.kp", n)
        self._kd = 2.0 * config.damping / config.bandwidth * self._kp
        self._ki = config.integral_rate * self._kp
        self._limits = model.effort_limits
        self._saturation = Saturation(model, "the servo gives no more")
        self._integral_limit = config.integral_limit * self._limits
        preload = finite_vector(holding_torque, "servo holding torque", n)
        _check_preload(preload, self._integral_limit, model.joint_names)
        self._declare(n, preload)

    def _declare(self, n: int, preload: Array) -> None:
        self._state_port = self.DeclareVectorInputPort("estimated_state", 2 * n)
        set_point_of = self.time_ticket()
        if self._trajectory is None:
            self._reference_port = self.DeclareVectorInputPort("joint_reference", 2 * n)
            set_point_of = self._reference_port.ticket()
        # Both in the order of the control model.
        self._integral = self.declare_state(preload)
        self._torque = self.declare_state(np.clip(preload, -self._limits, self._limits))
        # In the order of the actuators.
        self._peak = self.declare_state(n)
        # How far the arm was from the trajectory when the servos took it over.
        self._offset = self.declare_state(n)
        self.DeclareVectorOutputPort(
            "actuation", n, self._calc_actuation, {self.ticket_of_state(self._torque)}
        )
        self.DeclareVectorOutputPort(
            "set_point",
            2 * n,
            self._calc_set_point,
            {set_point_of, self.ticket_of_state(self._offset)},
        )
        self.DeclareStateOutputPort("peak_effort", DiscreteStateIndex(self._peak))
        # Unrestricted updates come first, like the step of a plant with sampled output ports: the
        # state that is read is the one at this instant. The offset is zero, so that the instants
        # are those of the plant's steps to the last bit.
        self.DeclarePeriodicUnrestrictedUpdateEvent(self._config.period, 0.0, self._sample)

    def _calc_actuation(self, context: Context, output: BasicVector) -> None:
        torque = context.get_discrete_state(self._torque).value()
        output.SetFromVector(torque[self._model.actuation_order])

    def _calc_set_point(self, context: Context, output: BasicVector) -> None:
        set_point = np.empty(2 * self._model.num_joints)
        set_point[self._model.state_order] = self._set_point(context)
        output.SetFromVector(set_point)

    def preset(self, context: Context, torque: Array) -> None:
        """Lets the servos begin where the arm is, with the torques that act on it: nothing jumps.

        The trajectory is shifted so that e = 0, and z = τ − k_d (q̇_d − q̇). In a running diagram,
        call it between two steps, right before a `HandOver` or the arm takes these torques.

        Args:
            context: of this controller, with its input port connected or fixed.
            torque: τ that acts on the joints now, in the order of `actuation` (n) [Nm or N].

        Raises:
            ConfigurationError: the torque does not fit the arm, or z exceeds its limit.
            SignalError: the state at the port is NaN or infinite.
        """
        order, n = self._model.actuation_order, self._model.num_joints
        acting = np.empty(n)
        acting[order] = finite_vector(torque, "preset torque", n)
        e, de = self._error(context).reshape(2, -1)
        integral = acting - self._kd * de
        _check_preload(integral, self._integral_limit, self._model.joint_names)
        offset = context.get_discrete_state(self._offset).value() - e
        context.SetDiscreteState(self._offset, offset)
        context.SetDiscreteState(self._integral, integral)
        context.SetDiscreteState(self._torque, np.clip(acting, -self._limits, self._limits))

    def _error(self, context: Context) -> Array:
        """Returns [e; q̇_d − q̇] in the order of the control model."""
        reading = self._state_port.Eval(context)
        check_signal(reading, f"{self.get_name()}:estimated_state")
        error: Array = self._set_point(context) - reading[self._model.state_order]
        return error

    def _set_point(self, context: Context) -> Array:
        """Returns [q_d; q̇_d] in the order of the control model."""
        time, offset = context.get_time(), context.get_discrete_state(self._offset).value()
        if self._trajectory is None:
            reference: Array = self._reference_port.Eval(context)
            check_signal(reference, f"{self.get_name()}:joint_reference")
            shift = np.concatenate((offset, np.zeros_like(offset)))
            return reference[self._model.state_order] + shift
        start, end = self._trajectory.start_time(), self._trajectory.end_time()
        t = min(max(time, start), end)
        q, v = self._trajectory.value(t)[:, 0], self._trajectory.EvalDerivative(t)[:, 0]
        return np.concatenate((q + offset, v if t == time else np.zeros_like(v)))

    def _sample(self, context: Context, state: State) -> None:
        e, de = self._error(context).reshape(2, -1)
        integral = context.get_discrete_state(self._integral).value()
        torque = servo_torque(self._kp, self._kd, e, de, integral)
        following = servo_integral(self._ki, e, integral, self._integral_limit, self._config.period)
        values = state.get_mutable_discrete_state()
        values.set_value(self._integral, following)
        values.set_value(self._torque, np.clip(torque, -self._limits, self._limits))
        peak = values.get_mutable_value(self._peak)
        asked = torque[self._model.actuation_order]
        saturated = self._saturation.compare(peak, asked)
        self._saturation.report(saturated, asked, self.get_name(), context.get_time())


def make_industrial_controller(
    plant: MultibodyPlant,
    model_instance: ModelInstanceIndex,
    end_effector_frame: Frame,
    trajectory: Trajectory | None,
    config: IndustrialControllerConfig | None = None,
) -> IndustrialController:
    """Makes an industrial control unit for one arm of `plant`.

    Gains and holding torque are set once, for the posture at the trajectory's start. Unless given,
    k_p = diag(B) ω². The holding torque holds the arm there against gravity.

    Args:
        plant: finalized, contains the arm.
        model_instance: the arm, as for `ControlModel.of_arm`.
        end_effector_frame: any frame fixed in the hand.
        trajectory: q_d over time, from the base to the hand (n) [rad or m], see `plan`. With None,
            the port `joint_reference` gives the references, and gains are those for the plant's
            default posture.
        config: gains, limits and sampling.

    Returns:
        The system, named after the arm; its ports are those of `IndustrialController`.

    Raises:
        ModelError: the plant does not contain such an arm.
        ConfigurationError: the configuration or the trajectory does not fit the arm.
    """
    config = config or IndustrialControllerConfig()
    check(config, "servo")
    model = ControlModel.of_arm(plant, model_instance, end_effector_frame)
    if trajectory is None:
        q = plant.GetDefaultPositions(model_instance)[model.state_order[: model.num_joints]]
    else:
        _check_rows(trajectory, model.num_joints)
        q = trajectory.value(trajectory.start_time())[:, 0]
    scratch = model.plant.CreateDefaultContext()
    arm = evaluate_arm(model, scratch, np.concatenate((q, np.zeros_like(q))))
    kp = np.diag(arm.B) * config.bandwidth**2 if config.kp is None else config.kp
    holding_torque = arm.g if config.preload else np.zeros_like(q)
    controller = IndustrialController(model, trajectory, kp, holding_torque, config)
    controller.set_name(name_after_arms(plant, [model_instance], "industrial_controller"))
    return controller


def _check_rows(trajectory: Trajectory, n: int) -> None:
    if (trajectory.rows(), trajectory.cols()) != (n, 1):
        raise ConfigurationError(
            f"The trajectory has {trajectory.rows()} rows and {trajectory.cols()} columns; the arm "
            f"has {n} joints: give {n} rows and one column."
        )


def _check_preload(preload: Array, limit: Array, joint_names: tuple[str, ...]) -> None:
    beyond = [
        f"{name} {torque:.4g} of ±{greatest:.4g}"
        for name, torque, greatest in zip(joint_names, preload, limit, strict=True)
        if abs(torque) > greatest
    ]
    if beyond:
        raise ConfigurationError(
            f"The holding torque exceeds the integral part's limit: {'; '.join(beyond)}. Raise "
            f"servo.integral_limit or start from a posture that needs less."
        )
