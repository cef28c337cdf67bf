"""The six-DOF impedance: the motion of the compliant frame C from D and the wrench."""

import numpy as np

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.laws.frame_motion import (
    ACCELERATION,
    FRAME_MOTION_SIZE,
    FRAME_STATE_SIZE,
    POSITION,
    QUATERNION,
    VELOCITY,
)
from geoimp_drake.laws.impedance.compliant_motion import compliant_motion, frame_state_rate
from geoimp_drake.laws.impedance.families import OrientationImpedance
from geoimp_drake.parts.hold_back import NO_SLACK, HoldBack
from geoimp_drake.parts.impedance_checks import ImpedanceChecks, at_rest, checked_coupling
from geoimp_drake.parts.impedance_energy import Energies, ImpedanceEnergy
from geoimp_drake.parts.impedance_gains import GAIN_PORTS, ImpedanceGains
from geoimp_drake.parts.inner_loop import InnerLoop
from geoimp_drake.parts.law_signals import ArmSignals, ImpedanceSignals
from geoimp_drake.parts.masses import Masses
from geoimp_drake.parts.part import Memory, Now, Output, held, nested
from geoimp_drake.parts.signals import AT_REST, is_set
from geoimp_drake.rotations import quaternion
from geoimp_drake.typing import Array
from geoimp_drake.validation import choice, spd_matrix

__all__ = ["AXES", "TRANSLATION_AXES", "Impedance"]

AXES = ("both", "translation", "rotation", "none")

# The axes in which M_p, D_p and K_p are given.
TRANSLATION_AXES = ("world", "desired")


class Impedance:
    """The part of `ImpedanceIntegrator`; errors and arguments are the same, except for `remedy`.

    Args:
        M_p: see `ImpedanceIntegrator`, like all that follow except `remedy`.
        D_p: see there.
        K_p: see there.
        rotation: see there.
        axes: see there.
        K_c: see there.
        remedy: the advice in the error if the motion diverges; a default for an end effector.
        translation_axes: see there.

    Attributes:
        rotation: the orientation family with its gains.
        changing_gains: gains as configured, or as signals ask for.
        gains: `changing_gains.at`, which returns them.
        energies: evaluates energies and powers with given gains.
        check: raises an error if the law cannot use a signal, see `ImpedanceChecks`.
        has_domain: see there.
        is_plain: whether its law can be used at any attitude, and needs no check of it.
        needs_wrench: whether the law contains the wrench.
        holds: place in the memory that is not zero while C is held back.
    """

    needs_wrench = True

    def __init__(
        self,
        M_p: Array,
        D_p: Array,
        K_p: Array,
        rotation: OrientationImpedance,
        axes: str = "both",
        K_c: Array | None = None,
        remedy: str = "",
        translation_axes: str = "world",
    ):
        choice(axes, "impedance axes", AXES)
        choice(translation_axes, "translation axes", TRANSLATION_AXES)
        self._M_p = spd_matrix(M_p, "M_p")
        self._D_p = spd_matrix(D_p, "D_p")
        self._K_p = spd_matrix(K_p, "K_p")
        self.rotation = rotation
        self._K_c = None if K_c is None else checked_coupling(K_c, self._K_p, rotation, axes)
        self._rotates = axes in ("both", "rotation")
        self._translates = axes in ("both", "translation")
        self._in_desired = translation_axes == "desired"
        self._masses = Masses(rotation.M_o, self._M_p, self._in_desired)
        self.energies = Energies(self._M_p, rotation)
        self._law = compiled(compliant_motion(rotation.law))
        self._write_rate = compiled(frame_state_rate)
        self.changing_gains = ImpedanceGains(
            np.array([np.linalg.inv(self._M_p), self._D_p, self._K_p]),
            np.array([rotation.M_inv, rotation.D_o, rotation.K_o]),
            self._K_c,
            (self._translates, self._rotates, self._in_desired),
            has_couplings=rotation.name == "quaternion",
        )
        self.gains = self.changing_gains.at
        self._checks = ImpedanceChecks(rotation, self._rotates, remedy)
        self.check, self.has_domain = self._checks.check, self._checks.has_domain
        self.is_plain = not (self.has_domain or self._checks.has_conditioning)
        self.inputs = {
            "desired_motion": FRAME_MOTION_SIZE,
            "wrench": 6,
            "measured_motion": FRAME_MOTION_SIZE,
            **GAIN_PORTS,
            "slack": 6,
        }
        # Zero, quaternion included: C has not started.
        self.state = Memory(frame=np.zeros(FRAME_STATE_SIZE))
        self._back = HoldBack((self._rotates, self._translates))
        self.memory = Memory(last=AT_REST, reported=0.0, held=self._back.memory)
        self._slack = nested(self.memory.held, self._back.memory.slack)
        self.holds = self.memory.held.start + self._back.memory.holds
        self._last_acceleration = nested(self.memory.last, ACCELERATION)
        signals = "state", "desired_motion", "wrench", "measured_motion", *GAIN_PORTS
        self.outputs = (
            Output("compliant_motion", FRAME_MOTION_SIZE, self.find, signals),
            held("last_compliant_motion", self.memory.last),
            Output("displacement", 6, self._write_displacement, signals),
            Output("energy", len(ImpedanceEnergy.get_fields()), self._write_energy, signals),
        )

    def check_start(self, now: Now) -> None:
        """Evaluates the law, so that initialization already refuses unusable signals."""
        now.output("compliant_motion")

    def find(self, now: Now, motion: Array) -> None:
        """Writes the motion of C (19,), accelerations included."""
        state = now.state
        if not is_set(state):
            state = at_rest(now["measured_motion"], now.port("measured_motion"))
        self.write_motion(now, now["desired_motion"], now["wrench"], state, motion)

    def new_signals(self, *own: Array | None) -> ImpedanceSignals:
        """Returns what `follow` writes to: new arrays, or given ones, see `ImpedanceSignals`."""
        return ImpedanceSignals(self.rotation.law, self.changing_gains.configured, *own)

    def follow(
        self,
        now: Now,
        wrench: Array,
        loop: InnerLoop,
        memory: Array,
        signals: ImpedanceSignals,
        arm: ArmSignals,
    ) -> tuple[Array, ...]:
        """Writes the motion of C (19,) in a whole controller; returns what else `energy` takes.

        Args:
            now: the inputs of the controller.
            wrench: at the end effector (6,).
            loop: from which C starts.
            memory: of the loop, with a reading.
            signals: where to write.
            arm: the signals of the loop.
        """
        state = now.state
        if not is_set(state):
            state = at_rest(loop.measured(memory, now, arm), now.port("estimated_state"))
        self.evaluate(now, now["desired_motion"], wrench, state, signals)
        return ()

    def evaluate(
        self, now: Now, desired: Array, wrench: Array, state: Array, signals: ImpedanceSignals
    ) -> None:
        """Does what `write_motion` does, in persistent arrays."""
        signals.take(desired, wrench, state, self.gains(now))
        if self.has_domain:
            self.check(now, desired, wrench, state)
        if not signals.law():
            self.check(now, desired, wrench, state)

    def write_motion(
        self, now: Now, desired: Array, wrench: Array, state: Array, motion: Array
    ) -> None:
        """Writes the motion of C, accelerations included.

        Args:
            now: has the signals that change the gains, and the ports' names.
            desired: motion of D (19,).
            wrench: at the end effector (6,).
            state: of C (13,).
            motion: where to write (19,).

        Raises:
            SignalError: a signal is not finite, a quaternion not unit, or C has diverged.
            SingularityError: the attitude leaves the domain of the family.
        """
        if self.has_domain:
            self.check(now, desired, wrench, state)
        if not self._law(state, desired, wrench, *self.gains(now), motion):
            self.check(now, desired, wrench, state)

    def motion_of(self, desired: Array, wrench: Array, state: Array) -> Array:
        """Returns the motion of C (19,) with the configured gains; NaN if an input is unusable.

        Args:
            desired: motion of D (19,).
            wrench: at the end effector (6,).
            state: of C (13,).
        """
        motion = np.full(FRAME_MOTION_SIZE, np.nan)
        self._law(state, desired, wrench, *self.gains(None), motion)
        return motion

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Starts C, or keeps its normalized quaternion."""
        slack = now["slack"] if now.has("slack") else NO_SLACK
        self.keep(memory, state, now, now.output("compliant_motion"), slack)

    def keep(self, memory: Array, state: Array, now: Now, motion: Array, slack: Array) -> None:
        """Keeps the motion of C as a step begins, and what holds C back.

        Args:
            memory: of this part, updated.
            state: of this part, updated.
            now: the inputs.
            motion: of C (19,).
            slack: acceleration of E that the limits leave undone (6,).
        """
        state[:] = motion[:FRAME_STATE_SIZE]
        if slack is not NO_SLACK and not np.count_nonzero(slack):  # which is faster than `any`
            slack = NO_SLACK
        # Compared: an `AutoDiffXd` counts as true whatever its value.
        if memory[self.holds] != 0.0 or slack is not NO_SLACK:
            self._hold(memory, now, motion, slack)
            slack = memory[self._slack]
        self.remember(memory, now, motion, slack)

    def remember(self, memory: Array, now: Now, motion: Array, slack: Array) -> None:
        """Keeps the motion of C in the memory; warns once if its family nears a singularity.

        Args:
            memory: of this part, updated.
            now: the inputs.
            motion: of C (19,).
            slack: what is added to its acceleration (6,).
        """
        memory[self.memory.last] = motion
        if slack is not NO_SLACK:
            memory[self._last_acceleration] += slack
        if self._checks.has_conditioning and not memory[self.memory.reported]:
            D = now["desired_motion"]
            memory[self.memory.reported] = self._checks.is_ill_conditioned(now, D, motion)

    def rate(self, now: Now, rate: Array) -> None:
        """Writes the derivative of C's state; a part without impedance follows D."""
        motion = np.zeros(FRAME_MOTION_SIZE, rate.dtype)
        self.find(now, motion)
        self._write_rate(motion, rate)
        self.hold_back(now.memory, rate)

    def hold_back(self, memory: Array, rate: Array) -> None:
        """Adds to the derivative of C's state what holds C back.

        Args:
            memory: of this part.
            rate: (13,).
        """
        if memory[self.holds] != 0.0:
            rate[VELOCITY] += memory[self._slack]

    def _hold(self, memory: Array, now: Now, C: Array, slack: Array) -> None:
        """Keeps the acceleration that holds C back from now on, see `HoldBack`."""
        energy = ImpedanceEnergy(self.energy(now, C, NO_SLACK))
        gained = energy.translational_dissipated_power + energy.rotational_dissipated_power
        held = memory[self.memory.held]
        attitudes = (quaternion.to_rotation(X[QUATERNION]) for X in (C, now["desired_motion"]))
        mass = self._masses.in_world(*attitudes)
        self._back.keep(held, slack, C[VELOCITY], mass, gained, now.time)

    def displacement(self, D: Array, C: Array) -> Array:
        """Returns the family's orientation displacement and Δp_dc (6,) of two motions (19,)."""
        rotation = self.rotation.displacement(D[QUATERNION], C[QUATERNION])
        return np.concatenate((rotation, D[POSITION] - C[POSITION]))

    def moved(self, before: tuple[Array, Array], after: tuple[Array, Array]) -> Array:
        """Returns the integral of the velocities that damping acts on (6,), in the damping's axes.

        Args:
            before: poses of D and of C (7,).
            after: the same, or motions, a step later.
        """
        (D, C), (later_D, later_C) = before, after
        turn = self.rotation.dual_step(
            (D[QUATERNION], C[QUATERNION]), (later_D[QUATERNION], later_C[QUATERNION])
        )
        way = later_D[POSITION] - later_C[POSITION] - (D[POSITION] - C[POSITION])
        if self._in_desired:
            way = quaternion.to_rotation(later_D[QUATERNION]).T @ way
        return np.concatenate((turn, way))

    def energy(self, now: Now, C: Array, wrench: Array) -> Array:
        """Returns ImpedanceEnergy (9,) [J, W].

        Args:
            now: the inputs, of which the motion of D and those that change the gains are used.
            C: motion of C (19,).
            wrench: at the end effector (6,).
        """
        return self.energies.evaluate(now["desired_motion"], C, wrench, self.gains(now))

    def _write_displacement(self, now: Now, value: Array) -> None:
        C = now.output("compliant_motion")
        value[:] = self.displacement(now["desired_motion"], C)

    def _write_energy(self, now: Now, value: Array) -> None:
        value[:] = self.energy(now, now.output("compliant_motion"), now["wrench"])
