"""The inner loop of one arm as one system: the blocks of that loop, sooner."""

from collections.abc import Callable

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DependencyTicket,
    DiscreteValues,
    InputPort,
    State,
    ValueProducer,
)

from geoimp_drake.compiled import compiled
from geoimp_drake.control_model import TASK_DIMENSION, ControlModel
from geoimp_drake.errors import SignalError
from geoimp_drake.laws.arm_torque import (
    arm_quantities,
    arm_torque,
    measured_motion,
    redundant_arm_torque,
)
from geoimp_drake.laws.damped_pseudo_inverse import smallest_singular_value
from geoimp_drake.laws.inverse_dynamics import peak_effort
from geoimp_drake.laws.joint_reading import next_reading
from geoimp_drake.laws.resolved_acceleration import check_regular
from geoimp_drake.systems.arm_chain import chain_arrays
from geoimp_drake.systems.arm_model import ArmState
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.frame_motion import (
    check_frame_motion,
    check_signal,
    frame_motion_vector,
)
from geoimp_drake.systems.inverse_dynamics_inner_loop import report_saturation
from geoimp_drake.systems.motion_controller import MotionController
from geoimp_drake.systems.redundancy_resolver import RedundancyResolver
from geoimp_drake.systems.velocity_estimator import VelocityEstimator
from geoimp_drake.task_functions.task_function import Instant, NoTask
from geoimp_drake.typing import Array

__all__ = ["ArmControl"]


class ArmControl(Block):
    """Makes the end effector of an arm track a reference motion: five blocks as one system.

    It does what these do, connected one after the other, with the same laws and the same numbers,
    in one compiled call a step (laws/arm_torque.py):

        VelocityEstimator ─▶ ArmModel ─▶ MotionController ─▶ RedundancyResolver
                                                          ─▶ InverseDynamicsInnerLoop

    Kinematics and dynamics are those of laws/serial_chain.py in the place of Drake's.

    Args:
        model: the arm's control model.
        readings: the block whose sampling it takes over.
        motion: the block whose gains it takes over; its orientation law is (2.15).
        redundancy: the block whose gains and task function it takes over.

    Raises:
        SignalError: an input is NaN or infinite, or the reference's quaternion is not unit.
        SingularityError: six joints in an exactly singular posture.

    Ports:
        input estimated_state: [q; v] of the model instance, in its own order (2n)
        input reference_motion: of the frame to be tracked, in W (19)
        input wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6)
        output actuation: τ in the order of the model instance's actuators (n) [Nm or N]
        output measured_motion: of E in W as the joint readings tell; accelerations are zero (19)
        output peak_effort: largest torque since the start as a fraction of the limit (n)
        output smallest_singular_value: of J, in rad and m (1)
        output null_space_error: e_n, zero for six joints (n)
        output task_value: w (1)
    """

    def __init__(
        self,
        model: ControlModel,
        readings: VelocityEstimator,
        motion: MotionController,
        redundancy: RedundancyResolver,
    ):
        super().__init__()
        self._model = model
        self._task, self._is_idle = redundancy.task, isinstance(redundancy.task, NoTask)
        n = model.num_joints
        self._chain = chain_arrays(model)
        self._is_redundant = n > TASK_DIMENSION
        self._law: Callable[..., bool] = (
            compiled(redundant_arm_torque(n)) if self._is_redundant else compiled(arm_torque)
        )
        self._constants = model.state_order, model.actuation_order, *motion.gains
        self._internal = _internal_arguments(redundancy, n) if self._is_redundant else ()
        self._none = np.zeros(n)
        self._measured, self._quantities = compiled(measured_motion), compiled(arm_quantities)
        self._next, self._peak_effort = compiled(next_reading), compiled(peak_effort)
        self._sampling = readings.period, readings.is_differenced
        self._limits = model.effort_limits[model.actuation_order]
        self._state = self.DeclareVectorInputPort("estimated_state", 2 * n)
        self._reference = self.DeclareVectorInputPort("reference_motion", frame_motion_vector())
        self._wrench = self.DeclareVectorInputPort("wrench", 6)
        self._declare_state(n)
        self._declare_outputs(n)

    def _declare_state(self, n: int) -> None:
        # The held reading and, last, how many there have been: none, the first, more.
        self._held = self.declare_state(2 * n + 1)
        self._peak = self.declare_state(n)
        # The posture from which targets may start; NaN until there is one.
        self._start = self.declare_state(np.full(n, np.nan))
        self._scratch = self.DeclareCacheEntry(
            "scratch context of the control model",
            ValueProducer(
                lambda: AbstractValue.Make(self._model.plant.CreateDefaultContext()),
                lambda context, value: None,
            ),
            {self.nothing_ticket()},
        )
        period = self._sampling[0]
        self.DeclareInitializationDiscreteUpdateEvent(self._first_reading)
        # Without offset, so that its instants are those of the plant's steps to the last bit.
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._next_reading)
        # Unrestricted updates come first, as a plant's step with sampled output ports does: the
        # torque compared is the one that the step uses, and is not computed again.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._compare_with_limits)

    def _declare_outputs(self, n: int) -> None:
        reading = {self.ticket_of_state(self._held), self._ticket(self._state)}
        law = reading | {self._ticket(self._reference), self._ticket(self._wrench)}
        if self._is_redundant:
            law |= {self.ticket_of_state(self._start), self.time_ticket()}
        self._torque = self.DeclareVectorOutputPort("actuation", n, self._calc_torque, law)
        self.DeclareVectorOutputPort(
            "measured_motion", frame_motion_vector(), self._calc_measured_motion, reading
        )
        self.declare_state_output("peak_effort", self._peak)
        # Of six joints it says how near a singularity is, where there may be no torque.
        tickets = law if self._is_redundant else reading
        self._reported = self.DeclareCacheEntry(
            "internal motion",
            ValueProducer(lambda: AbstractValue.Make(object()), self._calc_report),
            tickets,
        )
        for k, (name, size) in enumerate(
            (("smallest_singular_value", 1), ("null_space_error", n), ("task_value", 1))
        ):
            self.DeclareVectorOutputPort(name, size, self._part_of_report(k), tickets)

    def _ticket(self, port: InputPort) -> DependencyTicket:
        return self.input_port_ticket(port.get_index())

    @property
    def model(self) -> ControlModel:
        """The arm's control model."""
        return self._model

    def _first_reading(self, context: Context, state: DiscreteValues) -> None:
        reading = self._state.Eval(context)
        self._check_reading(reading)
        state.set_value(self._held, np.append(reading, 1.0))
        state.set_value(self._start, reading[self._model.state_order[: len(self._none)]])

    def _next_reading(self, context: Context, state: DiscreteValues) -> None:
        reading = self._state.Eval(context)
        # Drake hands over a copy of the context's state.
        held = state.get_mutable_value(self._held)
        if not self._next(reading, held, *self._sampling, held):
            self._check_reading(reading)

    def _compare_with_limits(self, context: Context, state: State) -> None:
        torque = self._torque.Eval(context)
        # Drake hands over a copy of the context's state.
        peak = state.get_mutable_discrete_state(self._peak).get_mutable_value()
        if self._peak_effort(torque, self._limits, peak, peak):
            before = context.get_discrete_state(self._peak).value()
            new = np.flatnonzero((before <= 1) & (peak > 1))
            report_saturation(self.get_name(), self._model, context.get_time(), torque, new)

    def _reading(self, context: Context) -> Array:
        """Returns [q; v] and perhaps more; before the first reading the port's passes through."""
        held: Array = context.get_discrete_state(self._held).value()
        if held[-1]:
            return held
        state: Array = self._state.Eval(context)
        return state

    def _calc_measured_motion(self, context: Context, output: BasicVector) -> None:
        reading, motion = self._reading(context), output.get_mutable_value()
        if not self._measured(self._model.state_order, reading, motion, *self._chain):
            self._check_reading(reading[: 2 * len(self._none)])

    def _calc_torque(self, context: Context, output: BasicVector) -> None:
        self._evaluate(context, output.get_mutable_value())

    def _evaluate(self, context: Context, u: Array) -> tuple[Array, float]:
        """Writes the torques; returns e_n and w, both zero for six joints."""
        reading = self._reading(context)
        signals = reading, self._reference.Eval(context), self._wrench.Eval(context), u
        if not self._is_redundant:
            self._resolve(signals)
            return self._none, 0.0
        error = np.empty_like(self._none)
        w, gradient, gradient_rate = self._task_value(context, reading)
        self._resolve(signals, gradient, gradient_rate, error, *self._internal)
        return error, w

    def _resolve(self, signals: tuple[Array, ...], *internal: Array) -> None:
        try:
            if not self._law(*self._constants, *signals, *internal, *self._chain):
                self._check(*signals[:3])
        except np.linalg.LinAlgError:
            check_regular(self._arm(signals[0]).Jv_V_WE)
            raise

    def _task_value(self, context: Context, reading: Array) -> tuple[float, Array, Array]:
        """Returns w, its gradient and that gradient's rate."""
        if self._is_idle:
            return 0.0, self._none, self._none
        x, n = reading[self._model.state_order], len(self._none)
        start = context.get_discrete_state(self._start).value()
        instant = Instant(
            context.get_time(),
            x[:n],
            x[n:],
            x[:n] if np.isnan(start[0]) else start,
            lambda: self._arm(reading),
            lambda: self._positioned_scratch(context, x),
        )
        task = self._task.evaluate(instant)
        return task.value, task.gradient, task.gradient_rate

    def _positioned_scratch(self, context: Context, x: Array) -> Context:
        scratch: Context = self._scratch.Eval(context)
        self._model.plant.SetPositionsAndVelocities(scratch, x)
        return scratch

    def _arm(self, reading: Array) -> ArmState:
        x, n = reading[self._model.state_order], len(self._none)
        return ArmState(x[:n], x[n:], *self._quantities(x[:n], x[n:], *self._chain))

    def _calc_report(self, context: Context, value: AbstractValue) -> None:
        error, w = self._none, 0.0
        if self._is_redundant:
            error, w = self._evaluate(context, np.empty_like(self._none))
        reading = self._reading(context)[: 2 * len(self._none)]
        self._check_reading(reading)
        sigma = smallest_singular_value(self._arm(reading).Jv_V_WE)
        value.set_value((np.array([sigma]), error, np.array([w])))

    def _part_of_report(self, k: int) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(self._reported.Eval(context)[k])

        return calc

    def _check(self, reading: Array, reference: Array, wrench: Array) -> None:
        """Raises SignalError, by name, for what the law cannot use."""
        self._check_reading(reading[: 2 * len(self._none)])
        check_frame_motion(reference, f"{self.get_name()}:reference_motion")
        check_signal(wrench, f"{self.get_name()}:wrench")
        check_regular(self._arm(reading).Jv_V_WE)
        raise SignalError(f"{self.get_name()}: the joint accelerations are not finite.")

    def _check_reading(self, reading: Array) -> None:
        check_signal(reading, f"{self.get_name()}:estimated_state")


def _internal_arguments(redundancy: RedundancyResolver, n: int) -> tuple:
    """Returns K_n, k_β, W and its inverse, whether that is B, σ₀ and λ₀."""
    gains = redundancy.gains
    weights = np.zeros((2, n, n)) if gains.weight is None else np.array(gains.weight[:2])
    by_inertia = gains.weight is None
    damping = gains.damping
    return gains.K_n, gains.k_beta, weights, by_inertia, damping.threshold, damping.factor
