"""The six-DOF impedance: integrates the motion of the compliant frame C from D and the wrench."""

import logging
from collections.abc import Callable

import numpy as np
from pydrake.common.containers import namedview
from pydrake.systems.framework import (
    BasicVector,
    Context,
    ContinuousState,
    EventStatus,
    State,
)

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.laws.impedance import coupled_stiffness, translational_impedance
from geoimp_drake.laws.impedance.compliant_motion import (
    compliant_motion,
    frame_state_rate,
    has_diverged,
)
from geoimp_drake.laws.impedance.families import OrientationImpedance
from geoimp_drake.laws.impedance.orientation_impedance import overrides
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.declaring import tickets_of
from geoimp_drake.systems.frame_motion import (
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    FRAME_STATE_SIZE,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
    VELOCITY,
    check_frame_motion,
    check_signal,
    frame_motion_vector,
    is_set,
)
from geoimp_drake.systems.stiffness_scale import StiffnessScale
from geoimp_drake.typing import Array
from geoimp_drake.validation import choice, finite_array, spd_matrix

__all__ = ["AXES", "ImpedanceEnergy", "ImpedanceIntegrator"]

AXES = ("both", "translation", "rotation", "none")

ImpedanceEnergy = namedview(
    "ImpedanceEnergy",
    [
        f"{part}_{quantity}"
        for part in ("translational", "rotational")
        for quantity in ("kinetic", "potential", "supplied_power", "dissipated_power")
    ]
    + ["coupling_potential"],
)

_log = logging.getLogger("drake")

# From here on a family warns that its representation is about to fail.
_ILL_CONDITIONED = 10.0


class ImpedanceIntegrator(Block):
    """Makes the frame C behave as a mass, damper and spring that the wrench deflects from D.

    Translation (3.1) and rotation, by the family that is given (quaternion: (3.30)),

        M_p Δp̈_dc + D_p Δṗ_dc + K_p Δp_dc = f
        M_o Δᶜω̇_dc + D_o Δᶜω_dc + K'_o ᶜε_dc = ᶜμ,   K'_o = 2 Eᵀ(η_dc, ᶜε_dc) K_o  (3.31)

    are solved for the acceleration of C, which is integrated; Δ is "D minus C". The orientation is
    propagated by its quaternion, Q̇ = ½ [−εᵀ; E(η, ε)] ω_c, and the state's quaternion is
    normalized before every step: a term in Q̇ that pulls the norm to one would be integrated with
    the integrator's own error, which at 1 ms and 2 rad/s leaves a norm error of 4e-7.

    C starts at rest on the measured pose of E: with a simulator's first step, and (so that the
    ports can be evaluated without one) before it. Initialize the simulator again to restart C on
    E after another controller has moved the arm.

    With a coupling K_c (laws/coupled_stiffness.py) translation and rotation load each other; K_p is
    then in D instead of W.

    Near a singularity of the family's Euler angles, where cond(T) exceeds 10, a warning is logged
    once; at the singularity, or beyond ϑ_M of an angle/axis family, a named error is raised.

    What a plant's last step has done belongs to the motion of C when that step began; it is held
    in the state, so that an inertial load taken from it makes no algebraic loop with the wrench.

    Frames: W world, D desired, C compliant, E end effector.

    Args:
        M_p, D_p, K_p: symmetric positive definite (3×3), in W [kg, Ns/m, N/m].
        rotation: the orientation family with its gains.
        axes: `both`, or `translation` / `rotation` for an impedance on one part only; the other
            part of C then equals D. With `none` C is D: plain motion control, to compare with.
        K_c: coupling (3×3), in D [N]; for the quaternion family on both parts only.

    Raises:
        ConfigurationError: a gain is not symmetric positive definite, `axes` is unknown, or the
            coupling makes the 6×6 stiffness indefinite or has no meaning for the family.
        SignalError: an input is NaN or infinite, a quaternion is not unit, or C has diverged.
        SingularityError: the attitude leaves the domain of the orientation family.

    Ports:
        input desired_motion: of D in W (19)
        input wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6)
        input measured_motion: of E in W, read until the first step only (19)
        input stiffness_scale: factors of K_p and K_o, one each if not connected (2)
        output compliant_motion: of C in W (19)
        output last_compliant_motion: of C when the last step began; of no input directly (19)
        output displacement: [orientation displacement of the family; Δp_dc] (6) [-, m]
        output energy: ImpedanceEnergy: energies [J] and powers [W] of both parts (9)
    """

    def __init__(
        self,
        M_p: Array,
        D_p: Array,
        K_p: Array,
        rotation: OrientationImpedance,
        axes: str = "both",
        K_c: Array | None = None,
    ):
        super().__init__()
        choice(axes, "impedance axes", AXES)
        self._M_p = spd_matrix(M_p, "M_p")
        self._D_p = spd_matrix(D_p, "D_p")
        self._K_p = spd_matrix(K_p, "K_p")
        self._rotation = rotation
        self._K_c = None if K_c is None else self._checked_coupling(K_c, axes)
        self._rotates = axes in ("both", "rotation")
        self._law, self._rate = _law_of(rotation), compiled(frame_state_rate)
        self._gains: tuple[Array, ...] = (
            np.array([np.linalg.inv(self._M_p), self._D_p, self._K_p]),
            np.array([rotation.M_inv, rotation.D_o, rotation.K_o]),
            np.zeros((3, 3)) if self._K_c is None else self._K_c,
            np.array([axes in ("both", "translation"), self._rotates, self._K_c is not None]),
        )
        # Most families have neither a domain nor a conditioning of their own to look at.
        self._has_domain = overrides(rotation, "check_domain")
        self._has_conditioning = self._rotates and overrides(rotation, "conditioning")
        self._desired = self.DeclareVectorInputPort("desired_motion", frame_motion_vector())
        self._wrench = self.DeclareVectorInputPort("wrench", 6)
        self._measured = self.DeclareVectorInputPort("measured_motion", frame_motion_vector())
        self._scale = StiffnessScale(self, self.gains)
        # As declared it is zero, quaternion included: C has not started.
        self.DeclareContinuousState(FRAME_STATE_SIZE)
        self._reported = self.declare_state(1)  # whether bad conditioning has been
        self._last = self.declare_state(frame_motion_vector())
        self.DeclareInitializationUnrestrictedUpdateEvent(self._stop)
        self.DeclareInitializationPublishEvent(self._check)
        self.DeclarePerStepUnrestrictedUpdateEvent(self._start_or_normalize)
        law_inputs = {self.xc_ticket()} | tickets_of(self, *self._inputs())
        self._compliant = self.DeclareVectorOutputPort(
            "compliant_motion", frame_motion_vector(), self._calc_motion, law_inputs
        )
        self.declare_state_output("last_compliant_motion", self._last)
        self.DeclareVectorOutputPort("displacement", 6, self._calc_displacement, law_inputs)
        self.DeclareVectorOutputPort(
            "energy", len(ImpedanceEnergy.get_fields()), self._calc_energy, law_inputs
        )

    def _checked_coupling(self, K_c: Array, axes: str) -> Array:
        if self._rotation.name != "quaternion" or axes != "both":
            raise ConfigurationError(
                f"A coupling K_c is defined for the orientation family 'quaternion' on both parts; "
                f"here the family is '{self._rotation.name}' and the axes are '{axes}'."
            )
        coupling = finite_array(K_c, "K_c", (3, 3))
        coupled_stiffness.check_positive_definite(self._K_p, self._rotation.K_o, coupling)
        return coupling

    def _inputs(self) -> tuple:
        return self._desired, self._wrench, self._measured, self._scale.port

    def _stop(self, context: Context, state: State) -> EventStatus:
        """Forgets where C was. It starts with the first step: by then the joints have been read."""
        state.get_mutable_continuous_state().SetFromVector(np.zeros(FRAME_STATE_SIZE))
        state.get_mutable_discrete_state(self._reported).SetFromVector([0.0])
        state.get_mutable_discrete_state(self._last).SetFromVector(frame_motion_vector().value())
        return EventStatus.Succeeded()

    def _check(self, context: Context) -> EventStatus:
        """Evaluates the law, so that initialization already refuses what it cannot use."""
        self._compliant.Eval(context)
        return EventStatus.Succeeded()

    def _start_or_normalize(self, context: Context, state: State) -> None:
        # The law's quaternion is normalized. This comes with the plant's step, whose torque has
        # evaluated the law already.
        motion = self._compliant.Eval(context)
        state.get_mutable_continuous_state().SetFromVector(motion[:FRAME_STATE_SIZE])
        state.get_mutable_discrete_state(self._last).SetFromVector(motion)
        if self._has_conditioning and not context.get_discrete_state(self._reported).value()[0]:
            self._watch_conditioning(context, motion[QUATERNION], state)

    def _watch_conditioning(self, context: Context, Q_WC: Array, state: State) -> None:
        conditioning = self._rotation.conditioning(self._desired.Eval(context)[QUATERNION], Q_WC)
        if conditioning > _ILL_CONDITIONED:
            state.get_mutable_discrete_state(self._reported).SetFromVector([1.0])
            _log.warning(
                f"{self.get_name()}: at t = {context.get_time():.3f} s the orientation family "
                f"'{self._rotation.name}' comes near its singularity, cond(T) = "
                f"{conditioning:.1f}; its moments lose meaning there. The quaternion has none."
            )

    def _start_state(self, context: Context) -> Array:
        """Returns the state of C at rest on the measured pose of E."""
        measured = self._measured.Eval(context)
        check_frame_motion(measured, f"{self.get_name()}:measured_motion")
        state: Array = measured[:FRAME_STATE_SIZE].copy()
        state[VELOCITY] = 0.0
        return state

    def _compliant_state(self, context: Context) -> Array:
        x: Array = context.get_continuous_state_vector().CopyToVector()
        return x if is_set(x) else self._start_state(context)

    def _calc_motion(self, context: Context, output: BasicVector) -> None:
        self._write_motion(context, output.get_mutable_value())

    def _write_motion(self, context: Context, motion: Array) -> None:
        """Writes the motion of C (19), accelerations included."""
        desired, wrench = self._desired.Eval(context), self._wrench.Eval(context)
        state, gains = self._compliant_state(context), self._scale.gains(context)
        if self._rotates and self._has_domain:
            self.check_signals(self.get_name(), desired, wrench, state)
        if not self._law(state, desired, wrench, *gains, motion):
            self.check_signals(self.get_name(), desired, wrench, state)

    def gains(self, system: str, factors: Array | None = None) -> tuple[Array, ...]:
        """Returns the gains as the law takes them, K_p and K_o multiplied by positive factors.

        Args:
            system: the name in the error.
            factors: of K_p and K_o (2,); None for one each.

        Raises:
            SignalError: a factor is not positive and finite.
        """
        if factors is None:
            return self._gains
        p, o = factors
        if not (0 < p < np.inf and 0 < o < np.inf):
            raise SignalError(
                f"Port '{system}:stiffness_scale' got {p:g} and {o:g}; both factors must "
                f"be positive and finite."
            )
        translation, rotation = (gains.copy() for gains in self._gains[:2])
        translation[2] *= p
        rotation[2] *= o
        return translation, rotation, *self._gains[2:]

    def check_signals(self, system: str, desired: Array, wrench: Array, state: Array) -> None:
        """Raises, by name, for what the law cannot use.

        Args:
            system: the name in the error.
            desired: motion of D (19,).
            wrench: at the end effector (6,).
            state: of C (13,).

        Raises:
            SignalError: a signal is not finite, a quaternion not unit, or C has diverged.
            SingularityError: the attitude leaves the domain of the family.
        """
        check_frame_motion(desired, f"{system}:desired_motion")
        check_signal(wrench, f"{system}:wrench")
        if has_diverged(state):
            raise SignalError(
                f"{system}: the motion of C has diverged, an entry of its state is "
                f"{state[np.argmax(np.abs(state))]:.3g}. The integration step must stay well below "
                f"M/D; shorten the simulator's max_step_size, or lower the damping or raise the "
                f"mass of the impedance."
            )
        if self._rotates and self._has_domain:
            self._rotation.check_domain(
                desired[QUATERNION], quaternion.normalized(state[QUATERNION])
            )

    def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
        """Integrates C; a part without impedance follows D."""
        # Not by the output port: as a rule the wrench has just been sampled, and the state is about
        # to change, so nobody else could use what the port would then hold.
        motion, state_rate = np.empty(FRAME_MOTION_SIZE), np.empty(FRAME_STATE_SIZE)
        self._write_motion(context, motion)
        self._rate(motion, state_rate)
        derivatives.SetFromVector(state_rate)

    def _calc_displacement(self, context: Context, output: BasicVector) -> None:
        C, D = self._compliant.Eval(context), self._desired.Eval(context)
        output.SetFromVector(self.displacement(D, C))

    def displacement(self, D: Array, C: Array) -> Array:
        """Returns the family's orientation displacement and Δp_dc (6,) of two motions (19,)."""
        rotation = self._rotation.displacement(D[QUATERNION], C[QUATERNION])
        return np.concatenate((rotation, D[POSITION] - C[POSITION]))

    def _calc_energy(self, context: Context, output: BasicVector) -> None:
        C, D = self._compliant.Eval(context), self._desired.Eval(context)
        factors = self._scale.factors(context)
        output.SetFromVector(self.energy(D, C, self._wrench.Eval(context), factors))

    def energy(self, D: Array, C: Array, wrench: Array, factors: Array | None = None) -> Array:
        """Returns ImpedanceEnergy (9,) [J, W].

        Args:
            D: motion of D (19,).
            C: motion of C (19,).
            wrench: at the end effector (6,).
            factors: of K_p and K_o (2,); None for one each.
        """
        energy = ImpedanceEnergy(
            np.array(
                [
                    *self._translational_energy(C, D, wrench[3:]),
                    *self._rotational_energy(C, D, wrench),
                    self._coupling_energy(C, D),
                ]
            )
        )
        if factors is not None:
            energy.translational_potential *= factors[0]
            energy.rotational_potential *= factors[1]
        return np.asarray(energy)

    def _coupling_energy(self, C: Array, D: Array) -> float:
        if self._K_c is None:
            return 0.0
        R_WD = quaternion.to_rotation(D[QUATERNION])
        Q_CD = quaternion.relative(C[QUATERNION], D[QUATERNION])
        return coupled_stiffness.coupling_energy(
            Q_CD, R_WD.T @ (D[POSITION] - C[POSITION]), self._K_c
        )

    def _translational_energy(self, C: Array, D: Array, force: Array) -> tuple[float, ...]:
        dp = D[POSITION] - C[POSITION]
        dv = D[LINEAR_VELOCITY] - C[LINEAR_VELOCITY]
        return (
            translational_impedance.kinetic_energy(dv, self._M_p),
            translational_impedance.potential_energy(dp, self._K_p),
            translational_impedance.supplied_power(dv, force),
            translational_impedance.dissipated_power(dv, self._D_p),
        )

    def _rotational_energy(self, C: Array, D: Array, wrench: Array) -> tuple[float, ...]:
        relative = (D[QUATERNION], D[ANGULAR_VELOCITY], C[QUATERNION], C[ANGULAR_VELOCITY])
        return (
            self._rotation.kinetic_energy(*relative),
            self._rotation.potential_energy(D[QUATERNION], C[QUATERNION]),
            self._rotation.supplied_power(*relative, wrench[:3]),
            self._rotation.dissipated_power(*relative),
        )


def _law_of(rotation: OrientationImpedance) -> Callable[..., bool]:
    """Returns the law of the whole impedance; in Python if the family's own is not compilable."""
    if not overrides(rotation, "angular_acceleration"):
        return compiled(compliant_motion(rotation.law))

    def law(*state_and_gains: Array) -> Array:
        return rotation.angular_acceleration(*state_and_gains[:6])

    return compliant_motion(law)
