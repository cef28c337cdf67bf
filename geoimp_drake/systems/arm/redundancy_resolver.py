"""From task to joint accelerations, for six joints and for more."""

from collections.abc import Callable

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    EventStatus,
    ValueProducer,
)

from geoimp_drake.arm.control_model import TASK_DIMENSION, ControlModel
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.frame_motion import is_finite
from geoimp_drake.laws.motion_control.resolved_acceleration import (
    check_regular,
    resolved_acceleration,
)
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import SingularityDamping
from geoimp_drake.laws.redundancy.redundant_acceleration import redundant_acceleration
from geoimp_drake.systems.arm.internal_motion import (
    InternalMotion,
    InternalMotionGains,
    evaluate_internal_motion,
)
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.frame_motion import check_signal
from geoimp_drake.task_functions.task_function import NoTask, TaskFunction
from geoimp_drake.typing import Array

__all__ = ["RedundancyResolver"]


class RedundancyResolver(Block):
    """Resolves a task acceleration into joint accelerations.

    Six joints: (2.5) α = J⁻¹(a − J̇q̇), exactly. More:

        α = J†(a − J̇q̇) + α_n                                                    (3.32)
        J† = W⁻¹Jᵀ(JW⁻¹Jᵀ)⁻¹,  W = B unless another weight is given             (3.33), (3.36)
        e_n = (I − J†J)(β − q̇)                                                  (3.37)
        α_n = (I − J†J)(β̇ − J̇†J(β − q̇) + B⁻¹(K_n e_n + Ce_n))                   (3.38)
        β = k_β B⁻¹(∂w/∂q)ᵀ                                                      (3.39)

    so that with W = B the energy V = ½ e_nᵀBe_n of the error of the internal motion obeys
    V̇ = −e_nᵀK_n e_n while internal motion does not disturb the end effector, nor a wrench there the
    internal motion. Without a task function the internal motion is damped to rest.

    Below the threshold of `damping` the directions that are nearly lost slow down, see
    `damped_pseudo_inverse`; the internal motion still does not disturb the end effector.

    Symbols: J Jacobian and v = q̇ velocity of E, B joint inertia, w the task function, C the
    Christoffel matrix.

    Args:
        model: the arm's control model, n ≥ 6 joints.
        K_n: gain of e_n, symmetric positive definite (n×n), or a number k for k I [Nms/rad, Ns/m].
        k_beta: k_β; positive climbs w, negative descends, zero only reports it.
        task: w; none by default.
        weight: a constant W, symmetric positive definite (n×n); B by default.
        damping: near singularities; a threshold of zero switches it off. Not for six joints.

    Raises:
        ConfigurationError: K_n or the weight is not symmetric positive definite, k_β not finite,
            or the damping negative.
        SignalError: the task acceleration is NaN or infinite.
        SingularityError: six joints in an exactly singular posture.

    Ports:
        input task_acceleration: a = [angular; linear] of E in W (6)
        input arm: ArmState
        output joint_acceleration: α (n)
        output smallest_singular_value: of J, in rad and m (1)
        output null_space_error: e_n, zero for six joints (n)
        output task_value: w (1)
    """

    def __init__(
        self,
        model: ControlModel,
        K_n: float | Array = 20.0,
        *,
        k_beta: float = 0.0,
        task: TaskFunction | None = None,
        weight: Array | None = None,
        damping: SingularityDamping | None = None,
    ):
        super().__init__()
        self._model = model
        self._task = task or NoTask()
        self._gains = InternalMotionGains.checked(
            model.num_joints, K_n, k_beta, weight, damping or SingularityDamping()
        )
        self._resolve = compiled(resolved_acceleration)
        self._combine = compiled(redundant_acceleration)
        self._declare(model.num_joints)

    @property
    def gains(self) -> InternalMotionGains:
        """How the internal motion is controlled."""
        return self._gains

    @property
    def task(self) -> TaskFunction:
        """The task function w."""
        return self._task

    def _declare(self, n: int) -> None:
        """Declares ports, state and cache."""
        self._a = self.DeclareVectorInputPort("task_acceleration", TASK_DIMENSION)
        self._arm = self.DeclareAbstractInputPort("arm", AbstractValue.Make(object()))
        arm = self.input_port_ticket(self._arm.get_index())
        # The posture from which targets may start; NaN until the first step. It is not kept at
        # initialization: the joint readings are taken anew in the same instant. Six joints have no
        # internal motion that could need it.
        start = self.declare_state(np.full(n, np.nan))
        if n > TASK_DIMENSION:
            self.DeclareInitializationDiscreteUpdateEvent(self._forget_start_posture)
            self.DeclarePerStepDiscreteUpdateEvent(self._keep_start_posture)
        self._scratch = self.DeclareCacheEntry(
            "scratch context of the control model",
            ValueProducer(
                lambda: AbstractValue.Make(self._model.plant.CreateDefaultContext()),
                lambda context, value: None,
            ),
            {self.nothing_ticket()},
        )
        posture = {arm, self.time_ticket(), self.ticket_of_state(start)}
        six = n == TASK_DIMENSION
        self._internal = self.DeclareCacheEntry(
            "internal motion",
            ValueProducer(
                lambda: AbstractValue.Make(object()),
                self._report_six if six else self._calc_internal,
            ),
            posture,
        )
        self.DeclareVectorOutputPort(
            "joint_acceleration",
            n,
            self._calc_six if six else self._calc_redundant,
            {self.input_port_ticket(self._a.get_index()), *({arm} if six else posture)},
        )
        for name, size in (
            ("smallest_singular_value", 1),
            ("null_space_error", n),
            ("task_value", 1),
        ):
            self.DeclareVectorOutputPort(name, size, self._report(name), posture)

    def _report(self, name: str) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(np.atleast_1d(getattr(self._internal.Eval(context), name)))

        return calc

    @staticmethod
    def _forget_start_posture(context: Context, state: DiscreteValues) -> EventStatus:
        state.set_value(np.full_like(state.value(), np.nan))
        return EventStatus.Succeeded()

    def _keep_start_posture(self, context: Context, state: DiscreteValues) -> EventStatus:
        if not np.isnan(context.get_discrete_state_vector().value()[0]):
            return EventStatus.DidNothing()
        state.set_value(self._arm.Eval(context).q)
        return EventStatus.Succeeded()

    def _task_acceleration(self, context: Context) -> Array:
        a: Array = self._a.Eval(context)
        if not is_finite(a):
            check_signal(a, f"{self.get_name()}:task_acceleration")
        return a

    def _calc_six(self, context: Context, output: BasicVector) -> None:
        arm, a = self._arm.Eval(context), self._task_acceleration(context)
        try:
            output.SetFromVector(self._resolve(arm.Jv_V_WE, arm.Jdot_v, a))
        except np.linalg.LinAlgError:
            check_regular(arm.Jv_V_WE)
            raise

    def _report_six(self, context: Context, value: AbstractValue) -> None:
        J, none = self._arm.Eval(context).Jv_V_WE, np.zeros(TASK_DIMENSION)
        value.set_value(InternalMotion(J, np.empty((0, 0)), none, none, 0.0))

    def _calc_redundant(self, context: Context, output: BasicVector) -> None:
        arm, a = self._arm.Eval(context), self._task_acceleration(context)
        internal = self._internal.Eval(context)
        output.SetFromVector(self._combine(internal.J_pinv, a, arm.Jdot_v, internal.alpha_n))

    def _calc_internal(self, context: Context, value: AbstractValue) -> None:
        arm = self._arm.Eval(context)
        start = context.get_discrete_state_vector().value()
        scratch = self._scratch.Eval(context)
        value.set_value(
            evaluate_internal_motion(
                self._model,
                scratch,
                arm,
                context.get_time(),
                arm.q if np.isnan(start[0]) else start,
                self._task,
                self._gains,
            )
        )
