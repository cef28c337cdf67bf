"""The six-DOF impedance of E with the arm's own inertia, which needs no wrench."""

import numpy as np

from geoimp_drake.arm.state import ArmState
from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.errors import SignalError
from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE, VELOCITY
from geoimp_drake.laws.impedance.coupled_stiffness import stiffness_matrix
from geoimp_drake.laws.impedance.natural_inertia import mobility, natural_motion
from geoimp_drake.parts.hold_back import NO_SLACK
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.impedance_energy import ImpedanceEnergy
from geoimp_drake.parts.inner_loop import InnerLoop
from geoimp_drake.parts.law_signals import ArmSignals, ImpedanceSignals
from geoimp_drake.parts.part import Now, Output
from geoimp_drake.typing import Array
from geoimp_drake.validation import positive

__all__ = ["NaturalImpedance"]

_NO_WRENCH, _UNKNOWN = np.zeros(6), np.full(6, np.nan)


class _Found:
    """The motion of C (19), Λ⁻¹ (6, 6) and Λ⁻¹DΔv (6)."""

    __slots__ = ("motion", "terms")

    def __init__(self) -> None:
        self.motion = np.zeros(FRAME_MOTION_SIZE)
        self.terms: tuple[Array, ...] = ()


class NaturalImpedance:
    """The part of `systems.natural_impedance.NaturalImpedance`; arguments and errors are the same.

    Attributes:
        springs: the impedance whose stiffness and orientation family are used.
        needs_wrench: False.
        holds: see `Impedance`.
    """

    needs_wrench = False
    float_only = "takes the root of a matrix in floats"

    def __init__(self, springs: Impedance, damping_ratio: float = 1.0):
        positive(damping_ratio, "damping_ratio")
        self.springs, self._zeta = springs, damping_ratio
        self.memory, self.displacement = springs.memory, springs.displacement
        self.holds = springs.holds
        self.new_signals = springs.new_signals
        law = natural_motion(springs.rotation.elastic_law, springs.rotation.axes_law)
        self._law, self._mobility = compiled(law), compiled(mobility)
        self._factor = _factor(*_stiffness(springs.gains(None)))
        self.inputs = {
            "desired_motion": FRAME_MOTION_SIZE,
            "arm": object(),
            "wrench": 6,
            "stiffness_scale": 2,
            "slack": 6,
        }
        self.found_of = "desired_motion", "arm", "stiffness_scale"
        of = "found", "desired_motion"
        self.outputs = (
            Output("compliant_motion", FRAME_MOTION_SIZE, _write_motion, ("found",)),
            springs.outputs[1],
            Output("displacement", 6, self._write_displacement, of),
            Output("energy", 9, self._write_energy, (*of, "wrench", "stiffness_scale")),
        )

    def check_start(self, now: Now) -> None:
        """Evaluates the law, so that initialization already refuses unusable signals."""
        _ = now.found

    def new_found(self) -> _Found:
        """Returns the arrays that the motion of C is written to."""
        return _Found()

    def find(self, now: Now, found: _Found) -> None:
        """Writes the motion of C, and further arguments of its energy."""
        found.terms = self._write_of(now, now["arm"], found.motion)

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Keeps the motion of C as a step begins."""
        slack = now["slack"] if now.has("slack") else NO_SLACK
        self.keep(memory, state, now, now.found.motion, slack)

    def keep(self, memory: Array, state: Array, now: Now, motion: Array, slack: Array) -> None:
        """Does what `Impedance.remember` does: without a state there is nothing to hold back."""
        self.springs.remember(memory, now, motion, slack)

    def follow(
        self,
        now: Now,
        wrench: Array,
        loop: InnerLoop,
        memory: Array,
        signals: ImpedanceSignals,
        arm: ArmSignals,
    ) -> tuple[Array, ...]:
        """Does what `Impedance.follow` does, for E as measured; returns Λ⁻¹ and Λ⁻¹DΔv."""
        return self._write_of(now, loop.arm_state(memory, now), signals.motion)

    def energy(self, now: Now, C: Array, wrench: Array, mobility: Array, damping: Array) -> Array:
        """Returns ImpedanceEnergy (9,) [J, W]: kinetic energy ½ΔvᵀΛΔv and damping ΔvᵀDΔv.

        Each part has its rows of Δv, and so half of what couples translation and rotation.

        Args:
            now: the inputs, of which the motion of D and the factors of K_p and K_o are used.
            C: motion of C (19,).
            wrench: at the end effector (6,), NaN if it is not known.
            mobility: Λ⁻¹ (6, 6).
            damping: Λ⁻¹DΔv (6,).
        """
        energy = ImpedanceEnergy(self.springs.energy(now, C, wrench))
        dV = now["desired_motion"][VELOCITY] - C[VELOCITY]
        inertia = np.linalg.pinv(mobility)
        kinetic, dissipated = 0.5 * dV * (inertia @ dV), dV * (inertia @ damping)
        supplied = dV * wrench
        for part, rows in (("rotational", slice(0, 3)), ("translational", slice(3, 6))):
            setattr(energy, f"{part}_kinetic", kinetic[rows].sum())
            setattr(energy, f"{part}_dissipated_power", dissipated[rows].sum())
            setattr(energy, f"{part}_supplied_power", supplied[rows].sum())
        return np.asarray(energy)

    def _write_of(self, now: Now, arm: ArmState, motion: Array) -> tuple[Array, ...]:
        springs, desired, damping = self.springs, now["desired_motion"], np.empty(6)
        state = np.concatenate((arm.Q_WE, arm.p_WE, arm.V_WE))
        gains, factor = springs.gains(now), self._factor
        stiffness, (*_, couples, in_desired, _) = _stiffness(gains), gains[3]
        if now.has("stiffness_scale"):
            factor = _factor(*stiffness, now.port("stiffness_scale"))
        if springs.has_domain:
            springs.check(now, desired, _NO_WRENCH, state)
        G = self._mobility(arm.Jv_V_WE, arm.B)
        if not self._law(
            state, desired, G, *stiffness, couples, in_desired, factor, self._zeta, motion, damping
        ):
            springs.check(now, desired, _NO_WRENCH, state)
        return G, damping

    def _write_displacement(self, now: Now, value: Array) -> None:
        value[:] = self.displacement(now["desired_motion"], now.found.motion)

    def _write_energy(self, now: Now, value: Array) -> None:
        found: _Found = now.found
        wrench = now["wrench"] if now.has("wrench") else _UNKNOWN
        value[:] = self.energy(now, found.motion, wrench, *found.terms)


def _write_motion(now: Now, motion: Array) -> None:
    motion[:] = now.found.motion


def _stiffness(gains: tuple[Array, ...]) -> tuple[Array, Array, Array]:
    """Returns K_p, K_o and K_c of the gains as `compliant_motion` takes them."""
    translation, rotation, coupling, _ = gains
    return translation[2], rotation[2], coupling[0]


def _factor(K_p: Array, K_o: Array, K_c: Array, port: str = "") -> Array:
    """Returns the lower Cholesky factor L of the 6×6 stiffness K₀ = LLᵀ where E equals D.

    Raises:
        SignalError: the factors at `port` make it indefinite.
    """
    try:
        return np.linalg.cholesky(stiffness_matrix(K_p, K_o, K_c))
    except np.linalg.LinAlgError as error:
        raise SignalError(
            f"Port '{port}': its factors of K_p and K_o leave a 6×6 stiffness that is not positive "
            f"definite with the coupling K_c, for which there is no damping. Give larger factors."
        ) from error
