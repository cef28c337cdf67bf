"""The six-DOF impedance: integrates the motion of the compliant frame C from D and the wrench."""

import logging

import numpy as np
from pydrake.common.containers import namedview
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import (
    BasicVector,
    Context,
    ContinuousState,
    EventStatus,
    LeafSystem,
    State,
    ValueProducer,
)

from geoimp_drake.errors import ConfigurationError, SignalError
from geoimp_drake.laws import coupled_stiffness, translational_impedance
from geoimp_drake.laws.families import OrientationImpedance
from geoimp_drake.rotations import quaternion
from geoimp_drake.systems.frame_motion import (
    ACCELERATION,
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    FRAME_MOTION_SIZE,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
    VELOCITY,
    check_frame_motion,
    check_signal,
    frame_motion_vector,
)
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

# The state has the order of a frame motion, without its accelerations.
_STATE_SIZE = ACCELERATION.start

_log = logging.getLogger("drake")

# From here on a family warns that its representation is about to fail.
_ILL_CONDITIONED = 10.0

# No arm is that far away or that fast [m, rad, m/s, rad/s].
_DIVERGED = 1e6


class ImpedanceIntegrator(LeafSystem):
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
        output compliant_motion: of C in W (19)
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
        self._M_p_inverse = np.linalg.inv(self._M_p)
        self._D_p = spd_matrix(D_p, "D_p")
        self._K_p = spd_matrix(K_p, "K_p")
        self._rotation = rotation
        self._K_c = None if K_c is None else self._checked_coupling(K_c, axes)
        self._translates = axes in ("both", "translation")
        self._rotates = axes in ("both", "rotation")
        self._desired = self.DeclareVectorInputPort("desired_motion", frame_motion_vector())
        self._wrench = self.DeclareVectorInputPort("wrench", 6)
        self._measured = self.DeclareVectorInputPort("measured_motion", frame_motion_vector())
        # As declared it is zero, quaternion included: C has not started.
        self.DeclareContinuousState(_STATE_SIZE)
        self.DeclareDiscreteState(1)  # whether bad conditioning has been reported
        self.DeclareInitializationUnrestrictedUpdateEvent(self._stop)
        self.DeclareInitializationPublishEvent(self._check)
        self.DeclarePerStepUnrestrictedUpdateEvent(self._start_or_normalize)
        law_inputs = {
            self.xc_ticket(),
            *(self.input_port_ticket(port.get_index()) for port in self._inputs()),
        }
        self._law = self.DeclareCacheEntry(
            "motion of C",
            ValueProducer(lambda: AbstractValue.Make(object()), self._calc_law),
            law_inputs,
        )
        for name, model, calc in (
            ("compliant_motion", frame_motion_vector(), self._calc_motion),
            ("displacement", BasicVector(6), self._calc_displacement),
            ("energy", BasicVector(len(ImpedanceEnergy.get_fields())), self._calc_energy),
        ):
            self.DeclareVectorOutputPort(name, model, calc, law_inputs)

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
        return self._desired, self._wrench, self._measured

    def _stop(self, context: Context, state: State) -> EventStatus:
        """Forgets where C was. It starts with the first step: by then the joints have been read."""
        state.get_mutable_continuous_state().SetFromVector(np.zeros(_STATE_SIZE))
        state.get_mutable_discrete_state().set_value([0.0])
        return EventStatus.Succeeded()

    def _check(self, context: Context) -> EventStatus:
        """Evaluates the law, so that initialization already refuses what it cannot use."""
        self._law.Eval(context)
        return EventStatus.Succeeded()

    def _start_or_normalize(self, context: Context, state: State) -> EventStatus:
        x = self._compliant_state(context)
        x[QUATERNION] = quaternion.normalized(x[QUATERNION])
        state.get_mutable_continuous_state().SetFromVector(x)
        if self._rotates and not context.get_discrete_state_vector().value()[0]:
            self._watch_conditioning(context, x[QUATERNION], state)
        return EventStatus.Succeeded()

    def _watch_conditioning(self, context: Context, Q_WC: Array, state: State) -> None:
        conditioning = self._rotation.conditioning(self._desired.Eval(context)[QUATERNION], Q_WC)
        if conditioning > _ILL_CONDITIONED:
            state.get_mutable_discrete_state().set_value([1.0])
            _log.warning(
                f"{self.get_name()}: at t = {context.get_time():.3f} s the orientation family "
                f"'{self._rotation.name}' comes near its singularity, cond(T) = "
                f"{conditioning:.1f}; its moments lose meaning there. The quaternion has none."
            )

    def _start_state(self, context: Context) -> Array:
        """Returns the state of C at rest on the measured pose of E."""
        measured = self._measured.Eval(context)
        check_frame_motion(measured, f"{self.get_name()}:measured_motion")
        state: Array = measured[:_STATE_SIZE].copy()
        state[VELOCITY] = 0.0
        return state

    def _compliant_state(self, context: Context) -> Array:
        x: Array = context.get_continuous_state_vector().CopyToVector()
        return x if _has_started(x) else self._start_state(context)

    def _calc_law(self, context: Context, value: AbstractValue) -> None:
        """Computes the motion of C, accelerations included: the one evaluation per step."""
        desired = self._desired.Eval(context)
        wrench = self._wrench.Eval(context)
        check_frame_motion(desired, f"{self.get_name()}:desired_motion")
        check_signal(wrench, f"{self.get_name()}:wrench")
        motion = np.empty(FRAME_MOTION_SIZE)
        motion[:_STATE_SIZE] = self._checked(self._compliant_state(context))
        motion[QUATERNION] = quaternion.normalized(motion[QUATERNION])
        moment, force, K_p = wrench[:3], wrench[3:], self._K_p
        if self._K_c is not None:
            moment, force, K_p = coupled_stiffness.without_coupling(
                desired[QUATERNION],
                motion[QUATERNION],
                desired[POSITION] - motion[POSITION],
                moment,
                force,
                K_p,
                self._K_c,
            )
        self._rotate(desired, moment, motion)
        self._translate(desired, force, K_p, motion)
        value.set_value(motion)

    def _checked(self, state: Array) -> Array:
        if not np.abs(state).max() < _DIVERGED:  # written so that NaN fails, too
            raise SignalError(
                f"{self.get_name()}: the motion of C has diverged, an entry of its state is "
                f"{state[np.argmax(np.abs(state))]:.3g}. The integration step must stay well below "
                f"M/D; shorten the simulator's max_step_size, or lower the damping or raise the "
                f"mass of the impedance."
            )
        return state

    def _rotate(self, desired: Array, moment: Array, motion: Array) -> None:
        if not self._rotates:
            for part in (QUATERNION, ANGULAR_VELOCITY, ANGULAR_ACCELERATION):
                motion[part] = desired[part]
            return
        self._rotation.check_domain(desired[QUATERNION], motion[QUATERNION])
        motion[ANGULAR_ACCELERATION] = self._rotation.angular_acceleration(
            desired[QUATERNION],
            desired[ANGULAR_VELOCITY],
            desired[ANGULAR_ACCELERATION],
            motion[QUATERNION],
            motion[ANGULAR_VELOCITY],
            moment,
        )

    def _translate(self, desired: Array, force: Array, K_p: Array, motion: Array) -> None:
        if not self._translates:
            for part in (POSITION, LINEAR_VELOCITY, LINEAR_ACCELERATION):
                motion[part] = desired[part]
            return
        motion[LINEAR_ACCELERATION] = translational_impedance.compliant_acceleration(
            desired[LINEAR_ACCELERATION],
            desired[LINEAR_VELOCITY] - motion[LINEAR_VELOCITY],
            desired[POSITION] - motion[POSITION],
            force,
            self._M_p_inverse,
            self._D_p,
            K_p,
        )

    def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
        """Integrates C; a part without impedance follows D."""
        motion = self._law.Eval(context)
        rate = np.empty(_STATE_SIZE)
        rate[QUATERNION] = quaternion.rate(motion[QUATERNION], motion[ANGULAR_VELOCITY])
        rate[POSITION] = motion[LINEAR_VELOCITY]
        rate[VELOCITY] = motion[ACCELERATION]
        derivatives.SetFromVector(rate)

    def _calc_motion(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._law.Eval(context))

    def _calc_displacement(self, context: Context, output: BasicVector) -> None:
        C, D = self._law.Eval(context), self._desired.Eval(context)
        rotation = self._rotation.displacement(D[QUATERNION], C[QUATERNION])
        output.SetFromVector(np.concatenate((rotation, D[POSITION] - C[POSITION])))

    def _calc_energy(self, context: Context, output: BasicVector) -> None:
        C, D = self._law.Eval(context), self._desired.Eval(context)
        wrench = self._wrench.Eval(context)
        output.SetFromVector(
            [
                *self._translational_energy(C, D, wrench[3:]),
                *self._rotational_energy(C, D, wrench),
                self._coupling_energy(C, D),
            ]
        )

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


def _has_started(state: Array) -> bool:
    return bool(state[0] != 0.0 or state[QUATERNION].any())
