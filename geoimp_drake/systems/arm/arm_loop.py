"""The inner loop of one arm, for the systems that contain one."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, ValueProducer

from geoimp_drake.arm.chain import chain_arrays
from geoimp_drake.arm.control_model import TASK_DIMENSION, ControlModel
from geoimp_drake.arm.state import ArmState
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.errors import SignalError
from geoimp_drake.laws.compositions.arm_torque import (
    arm_quantities,
    arm_torque,
    measured_motion,
    redundant_arm_torque,
)
from geoimp_drake.laws.motion_control.inverse_dynamics import peak_effort
from geoimp_drake.laws.motion_control.joint_reading import next_reading
from geoimp_drake.laws.motion_control.resolved_acceleration import check_regular
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import smallest_singular_value
from geoimp_drake.systems.arm.inverse_dynamics_inner_loop import report_saturation
from geoimp_drake.systems.arm.motion_controller import MotionController
from geoimp_drake.systems.arm.redundancy_resolver import RedundancyResolver
from geoimp_drake.systems.arm.velocity_estimator import VelocityEstimator
from geoimp_drake.systems.frame_motion import check_frame_motion, check_signal
from geoimp_drake.task_functions.task_function import Instant, NoTask
from geoimp_drake.typing import Array

__all__ = ["ArmBlocks", "ArmLoop"]


@dataclass(frozen=True)
class ArmBlocks:
    """The blocks of an arm's inner loop, whose work one system takes over."""

    model: ControlModel
    readings: VelocityEstimator  # its sampling
    motion: MotionController  # its gains; the orientation law is (2.15)
    redundancy: RedundancyResolver  # its gains and task function


class ArmLoop:
    """The inner loop of one arm as a part of a system, which keeps the state and has the ports.

    What the arm has to remember is a vector of 3n + 1, its memory: the held reading [q; v]; how
    many readings there have been (none, the first, more); and the posture from which targets may
    start. Before the first reading, that of the port passes through.

    Args:
        system: whose part it is.
        blocks: whose work it does.
        suffix: of the system's ports that belong to this arm, in errors.

    Attributes:
        model: the arm's control model.
        is_redundant: whether it has more than six joints.
        memory_at_start: (3n + 1).
    """

    def __init__(self, system: LeafSystem, blocks: ArmBlocks, suffix: str = ""):
        self.model = model = blocks.model
        n = model.num_joints
        self.is_redundant = n > TASK_DIMENSION
        self.memory_at_start = np.concatenate((np.zeros(2 * n + 1), np.full(n, np.nan)))
        self._n, self._count, self._system, self._suffix = n, 2 * n, system, suffix
        task = blocks.redundancy.task
        self._task, self._is_idle = task, isinstance(task, NoTask)
        self._law: Callable[..., bool] = (
            compiled(redundant_arm_torque(n)) if self.is_redundant else compiled(arm_torque)
        )
        self._chain = chain_arrays(model)
        self._constants = model.state_order, model.actuation_order, *blocks.motion.gains
        self._internal = _internal_arguments(blocks.redundancy, n) if self.is_redundant else ()
        self._none = np.zeros(n)
        self._measured, self._quantities = compiled(measured_motion), compiled(arm_quantities)
        self._next, self._peak_effort = compiled(next_reading), compiled(peak_effort)
        self._sampling = blocks.readings.period, blocks.readings.is_differenced
        self._limits = model.effort_limits[model.actuation_order]
        self._scratch = system.DeclareCacheEntry(
            f"scratch context of the control model{suffix}",
            ValueProducer(
                lambda: AbstractValue.Make(model.plant.CreateDefaultContext()),
                lambda context, value: None,
            ),
            {system.nothing_ticket()},
        )

    def has_reading(self, memory: Array) -> bool:
        """Whether there has been a reading.

        Args:
            memory: of the arm (3n + 1).
        """
        return bool(memory[self._count])

    def take_first(self, memory: Array, state: Array) -> None:
        """Takes the first reading.

        Args:
            memory: of the arm (3n + 1), where to write.
            state: [q; v] (2n).

        Raises:
            SignalError: the reading is NaN or infinite.
        """
        self._check_reading(state)
        self.pass_through(memory, state)
        memory[self._count] = 1.0
        memory[self._count + 1 :] = state[self.model.state_order[: self._n]]

    def take_next(self, memory: Array, state: Array) -> None:
        """Takes another reading; arguments and errors are those of `take_first`."""
        held = memory[: self._count + 1]
        if not self._next(state, held, *self._sampling, held):
            self._check_reading(state)

    def pass_through(self, memory: Array, state: Array) -> None:
        """Writes a reading that is not held yet.

        Args:
            memory: of the arm (3n + 1), where to write.
            state: [q; v] (2n).
        """
        memory[: self._count] = state

    def write_motion(self, memory: Array, motion: Array) -> None:
        """Writes the motion of E in W that the reading tells, accelerations zero.

        Args:
            memory: of the arm (3n + 1).
            motion: where to write (19).

        Raises:
            SignalError: the reading is NaN or infinite.
        """
        if not self._measured(self.model.state_order, memory, motion, *self._chain):
            self._check_reading(memory[: self._count])

    def write_torque(
        self, context: Context, memory: Array, reference: Array, wrench: Array, u: Array
    ) -> tuple[Array, float]:
        """Writes the torques; returns e_n and w, both zero for six joints.

        Args:
            context: of the system, for the task function.
            memory: of the arm (3n + 1).
            reference: motion of the frame to be tracked (19).
            wrench: h by the end effector on the environment (6).
            u: where to write, in the order of the model instance's actuators (n).

        Raises:
            SignalError: a signal is NaN or infinite, or the reference's quaternion is not unit.
            SingularityError: six joints in an exactly singular posture.
        """
        signals = memory, reference, wrench, u
        if not self.is_redundant:
            self._resolve(signals)
            return self._none, 0.0
        error = np.empty_like(self._none)
        w, gradient, gradient_rate = self._task_value(context, memory)
        self._resolve(signals, gradient, gradient_rate, error, *self._internal)
        return error, w

    def smallest_singular_value(self, memory: Array) -> float:
        """Returns that of the Jacobian of E, in rad and m.

        Args:
            memory: of the arm (3n + 1).

        Raises:
            SignalError: the reading is NaN or infinite.
        """
        self._check_reading(memory[: self._count])
        return float(smallest_singular_value(self._arm(memory).Jv_V_WE))

    def compare_with_limits(self, context: Context, torque: Array, group: int, peak: Array) -> None:
        """Updates the largest torques as fractions of the limits; warns at a new saturation.

        Args:
            context: of the system, whose time it is.
            torque: in the order of the actuators (n).
            group: of the system's state that holds the largest fractions so far.
            peak: these in the state that comes next (n), moved on.
        """
        if self._peak_effort(torque, self._limits, peak, peak):
            before = context.get_discrete_state(group).value()
            new = np.flatnonzero((before <= 1) & (peak > 1))
            report_saturation(self._name(), self.model, context.get_time(), torque, new)

    def _check_reading(self, reading: Array) -> None:
        """Raises SignalError, by name, for a reading [q; v] (2n) that is NaN or infinite."""
        check_signal(reading, self._port("estimated_state"))

    def _name(self) -> str:
        """Returns the name of the system, and which arm it is if there are two."""
        arm = self._suffix.replace("_", ", arm ")
        return f"{self._system.get_name()}{arm}"

    def _port(self, name: str) -> str:
        return f"{self._system.get_name()}:{name}{self._suffix}"

    def _resolve(self, signals: tuple[Array, ...], *internal: Array) -> None:
        try:
            if not self._law(*self._constants, *signals, *internal, *self._chain):
                self._check(*signals[:3])
        except np.linalg.LinAlgError:
            check_regular(self._arm(signals[0]).Jv_V_WE)
            raise

    def _check(self, memory: Array, reference: Array, wrench: Array) -> None:
        """Raises SignalError, by name, for what the law cannot use."""
        self._check_reading(memory[: self._count])
        check_frame_motion(reference, self._port("reference_motion"))
        check_signal(wrench, self._port("wrench"))
        check_regular(self._arm(memory).Jv_V_WE)
        raise SignalError(f"{self._name()}: the joint accelerations are not finite.")

    def _task_value(self, context: Context, memory: Array) -> tuple[float, Array, Array]:
        """Returns w, its gradient and that gradient's rate."""
        if self._is_idle:
            return 0.0, self._none, self._none
        x, n, start = memory[self.model.state_order], self._n, memory[self._count + 1 :]
        instant = Instant(
            context.get_time(),
            x[:n],
            x[n:],
            x[:n] if np.isnan(start[0]) else start,
            lambda: self._arm(memory),
            lambda: self._positioned_scratch(context, x),
        )
        task = self._task.evaluate(instant)
        return task.value, task.gradient, task.gradient_rate

    def _positioned_scratch(self, context: Context, x: Array) -> Context:
        scratch: Context = self._scratch.Eval(context)
        self.model.plant.SetPositionsAndVelocities(scratch, x)
        return scratch

    def _arm(self, memory: Array) -> ArmState:
        x, n = memory[self.model.state_order], self._n
        return ArmState(x[:n], x[n:], *self._quantities(x[:n], x[n:], *self._chain))


def _internal_arguments(redundancy: RedundancyResolver, n: int) -> tuple:
    """Returns K_n, k_β, W and its inverse, whether that is B, σ₀ and λ₀."""
    gains = redundancy.gains
    weights = np.zeros((2, n, n)) if gains.weight is None else np.array(gains.weight[:2])
    by_inertia = gains.weight is None
    damping = gains.damping
    return gains.K_n, gains.k_beta, weights, by_inertia, damping.threshold, damping.factor
