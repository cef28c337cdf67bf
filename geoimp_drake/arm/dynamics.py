"""Kinematics and dynamics of an arm at one instant: by compiled laws, or by Drake."""

from functools import partial
from typing import Any, Protocol

import numpy as np
from pydrake.systems.framework import Context

from geoimp_drake.arm.chain import chain_arrays
from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.derivatives import coriolis_forces, inertia_rate
from geoimp_drake.arm.state import ArmState, evaluate_arm
from geoimp_drake.compilation.compiled import bound, compiled, is_available
from geoimp_drake.laws.compositions.arm_quantities import arm_quantities
from geoimp_drake.laws.compositions.chain_null_space import chain_null_space
from geoimp_drake.laws.compositions.null_space_motion import (
    null_space_motion_acceleration,
    null_space_motion_error,
)
from geoimp_drake.laws.dynamics.serial_chain import chain_values
from geoimp_drake.laws.redundancy.null_space_acceleration import coriolis_product
from geoimp_drake.laws.redundancy.null_space_gain import null_space_decay_bound, null_space_force
from geoimp_drake.typing import Array

__all__ = ["ArmDynamics", "ChainArm", "ChainDynamics", "DrakeDynamics", "Scratch", "arm_dynamics"]


class Scratch:
    """A context of a control model's plant, made on first use; a copy has its own.

    Args:
        model: the control model.

    Attributes:
        model: the same.
    """

    def __init__(self, model: ControlModel):
        self.model = model
        self._context: Context | None = None

    def __deepcopy__(self, memo: dict[int, Any]) -> "Scratch":
        return Scratch(self.model)

    def autodiff(self) -> "Scratch":
        """Returns one for `AutoDiffXd`."""
        return Scratch(self.model.autodiff)

    @property
    def context(self) -> Context:
        """The context, at any posture."""
        if self._context is None:
            self._context = self.model.plant.CreateDefaultContext()
        return self._context

    def at(self, x: Array) -> Context:
        """Returns the context at [q; v] (2n,)."""
        self.model.plant.SetPositionsAndVelocities(self.context, x)
        return self.context


class ChainArm:
    """Arrays into which the laws of the chain write an arm at each call; a copy has its own.

    Args:
        n: number of joints.

    Attributes:
        state: the arm.
        arrays: those of the arm, in the form that `arm_quantities` takes.
    """

    def __init__(self, n: int):
        found, Fv = chain_values(n), np.zeros(n)
        Q_WE, R_WE, p_WE = np.zeros(4), np.zeros((3, 3)), np.zeros(3)
        self.arrays = found, Q_WE, R_WE, p_WE, Fv
        self.state = ArmState(
            q=found.x[:n],
            v=found.x[n:],
            Q_WE=Q_WE,
            R_WE=R_WE,
            p_WE=p_WE,
            V_WE=found.V_WE,
            Jv_V_WE=found.J,
            Jdot_v=found.Jdot_v,
            B=found.B,
            Cv=found.Cv,
            Fv=Fv,
            g=found.g,
            chain=found,
        )

    def __deepcopy__(self, memo: dict[int, Any]) -> "ChainArm":
        return ChainArm(len(self.state.q))


class ArmDynamics(Protocol):
    """Evaluates an arm's kinematics and dynamics."""

    def new_scratch(self) -> Any:
        """Returns the working memory of `evaluate` for one context."""

    def evaluate(self, scratch: Any, state: Array) -> ArmState:
        """Returns the arm at [q; v] (2n,) in the model's order, until the scratch is used again."""

    def null_space(
        self, scratch: Scratch, arm: ArmState, gradients: tuple[Array, Array], gains: tuple
    ) -> tuple[Array, Array, Array, float]:
        """Returns J† (n, 6), α_n (n,) and e_n (n,), and a bound on the rates at which it decays.

        They are those of (3.33), (3.38), (3.37) and `null_space_decay_bound`.

        Args:
            scratch: a context of the model's plant.
            arm: the arm, of `evaluate`.
            gradients: of the task function, and their rate along the arm's motion (n,).
            gains: K and κ, k_β, W and its inverse (2, n, n), whether W = B instead, σ₀ and λ₀.
        """


def arm_dynamics(model: ControlModel) -> ArmDynamics:
    """Returns the fastest way to evaluate an arm.

    Compiled laws take a third of the time of Drake's calls; laws that are not compiled take many
    times as long.
    """
    return ChainDynamics(model) if is_available() else DrakeDynamics(model)


class ChainDynamics:
    """The laws of laws/dynamics/serial_chain.py, which need no context.

    Args:
        model: the arm.

    Attributes:
        arguments: the arm in the form that the laws take, and memory for their results.
    """

    def __init__(self, model: ControlModel):
        self._n, chain = model.num_joints, chain_arrays(model)
        self.arguments = chain, chain_values(self._n)
        self._quantities = bound(arm_quantities, chain)
        self._null_space = compiled(chain_null_space(self._n))

    def new_scratch(self) -> ChainArm:
        """See `ArmDynamics`."""
        return ChainArm(self._n)

    def evaluate(self, scratch: ChainArm | None, state: Array) -> ArmState:
        """See `ArmDynamics`; without `scratch`, the result has arrays of its own."""
        arm = scratch or ChainArm(self._n)
        arm.state.chain.x[:] = state
        self._quantities(*arm.arrays)
        return arm.state

    def null_space(
        self, scratch: Scratch | None, arm: ArmState, gradients: tuple[Array, Array], gains: tuple
    ) -> tuple[Array, Array, Array, float]:
        """See `ArmDynamics`."""
        return self._null_space(gains, arm.chain, *gradients)


class DrakeDynamics:
    """Drake's own calls, also for a model with `AutoDiffXd`.

    Args:
        model: the arm.
    """

    def __init__(self, model: ControlModel):
        self._model = model

    def new_scratch(self) -> Scratch:
        """See `ArmDynamics`."""
        return Scratch(self._model)

    def evaluate(self, scratch: Scratch, state: Array) -> ArmState:
        """See `ArmDynamics`."""
        return evaluate_arm(self._model, scratch.context, state)

    def null_space(
        self, scratch: Scratch, arm: ArmState, gradients: tuple[Array, Array], gains: tuple
    ) -> tuple[Array, Array, Array, float]:
        """See `ArmDynamics`."""
        K, kappa, k_beta, (W, W_inverse), weighs_by_inertia, threshold, factor = gains
        gradient, gradient_rate = gradients
        J, v, model, context = arm.Jv_V_WE, arm.v, scratch.model, scratch.context
        dB = inertia_rate(model, context, arm.q, v)
        # (3.33), (3.39), (3.37)
        B_inverse, J_pinv, N, beta, e_n = null_space_motion_error(
            J, arm.B, W_inverse, weighs_by_inertia, threshold, factor, k_beta, gradient, v
        )
        dW = np.zeros_like(dB)
        if weighs_by_inertia:
            W, W_inverse, dW = arm.B, B_inverse, dB
        # (3.38)
        C_e = coriolis_product(partial(coriolis_forces, model, context), arm.Cv, v, e_n)
        alpha_n = null_space_motion_acceleration(
            J,
            v,
            J_pinv,
            N,
            W,
            W_inverse,
            dW,
            B_inverse,
            dB,
            k_beta,
            beta,
            gradient_rate,
            null_space_force(K, kappa, arm.B, e_n),
            C_e,
        )
        return J_pinv, alpha_n, e_n, null_space_decay_bound(N, B_inverse, K)
