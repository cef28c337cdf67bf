"""From task to joint accelerations, for six joints and for more."""

from geoimp_drake.arm.control_model import TASK_DIMENSION, ControlModel
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import SingularityDamping
from geoimp_drake.parts.null_space import NullSpace
from geoimp_drake.parts.part import Part
from geoimp_drake.parts.redundancy import (
    RedundantAcceleration,
    ResolvedAcceleration,
    WatchedRedundantAcceleration,
)
from geoimp_drake.systems.part_system import PartSystem
from geoimp_drake.task_functions.task_function import TaskFunction
from geoimp_drake.typing import Array

__all__ = ["RedundancyResolver"]


class RedundancyResolver(PartSystem):
    """Resolves a task acceleration into joint accelerations.

    Six joints: (2.5) α = J⁻¹(a − J̇q̇), exactly. More:

        α = J†(a − J̇q̇) + α_n                                                    (3.32)
        J† = W⁻¹Jᵀ(JW⁻¹Jᵀ)⁻¹,  W = B unless another weight is given             (3.33), (3.36)
        e_n = (I − J†J)(β − q̇)                                                  (3.37)
        α_n = (I − J†J)(β̇ − J̇†J(β − q̇) + B⁻¹(K_n e_n + Ce_n))                   (3.38)
        β = k_β B⁻¹(∂w/∂q)ᵀ                                                      (3.39)

    With W = B, the energy V = ½ e_nᵀBe_n of the error of the null-space motion then obeys V̇ =
    −e_nᵀK_n e_n. Null-space motion does not disturb the end effector, and a wrench at the end
    effector does not disturb the null-space motion. Without a task function the null-space motion
    is damped to rest. The gain K_n is constant, or κB, with which V̇ = −2κV in any posture.

    Below the threshold of `damping` the directions that are nearly lost slow down, see
    `damped_pseudo_inverse`; the null-space motion still does not disturb the end effector.

    Symbols: J Jacobian and v = q̇ velocity of E, B joint inertia, w the task function, C the
    Christoffel matrix.

    Args:
        model: the arm's control model, n ≥ 6 joints.
        K_n: constant gain of e_n, symmetric positive definite (n×n), or a number k for k I
            [Nms/rad, Ns/m]; zero for K_n = κB.
        kappa: κ [1/s]; by default 10, unless K_n is given.
        k_beta: k_β; positive climbs w, negative descends, zero only reports it.
        task: w; none by default.
        weight: a constant W, symmetric positive definite (n×n); B by default.
        damping: near singularities; a threshold of zero switches it off. Not for six joints.
        period: of the joints' readings [s]. With a constant K_n, a warning is logged at the first
            posture in which the null-space motion would grow with this period. None switches that
            off.

    Raises:
        ConfigurationError: K_n or the weight is not symmetric positive definite, κ not positive,
            both given, k_β not finite, or the damping negative.
        SignalError: the task acceleration is NaN or infinite.
        SingularityError: six joints in an exactly singular posture, unless the part has a
            threshold, see `part_of`.

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
        K_n: float | Array = 0.0,
        *,
        kappa: float | None = None,
        k_beta: float = 0.0,
        task: TaskFunction | None = None,
        weight: Array | None = None,
        damping: SingularityDamping | None = None,
        period: float | None = None,
    ):
        null_space = NullSpace(model, K_n, kappa, k_beta, task, weight, damping, period)
        super().__init__(self.part_of(model, null_space))

    @staticmethod
    def part_of(model: ControlModel, null_space: NullSpace, threshold: float = 0.0) -> Part:
        """Returns the part for an arm; one with six joints has no null space.

        Args:
            model: the arm.
            null_space: how its null-space motion is controlled.
            threshold: of `ResolvedAcceleration`.
        """
        if model.num_joints == TASK_DIMENSION:
            return ResolvedAcceleration(threshold)
        is_watched = null_space.watch is not None
        kind = WatchedRedundantAcceleration if is_watched else RedundantAcceleration
        return kind(model, null_space)
