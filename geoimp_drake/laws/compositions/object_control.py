"""The object's part of tight cooperation in one call: from hands and wrenches to their references.

The laws are those of the blocks, in the same order. Motion and wrenches of the object (4.1)-(4.9)
come first, then its impedance (3.1), (3.30) and the same law for the internal wrench. The
references (4.10)-(4.15) are last. A call from Python costs more than these laws, so they share one.
Floats only.
"""

from collections.abc import Callable
from functools import cache

import numpy as np

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.compilation.small_arrays import local, sized
from geoimp_drake.laws.cooperation.half_rotation import is_half_defined
from geoimp_drake.laws.cooperation.hand_references import moving_references, rigid_references
from geoimp_drake.laws.cooperation.held_object import held_object_motion, held_object_wrenches
from geoimp_drake.laws.frame_motion import (
    FRAME_MOTION_SIZE,
    FRAME_STATE_SIZE,
    POSE_SIZE,
    QUATERNION,
    is_finite,
    is_frame_motion,
)
from geoimp_drake.laws.impedance.compliant_motion import (
    compliant_motion,
    frame_state_rate,
    has_diverged,
)
from geoimp_drake.laws.impedance.quaternion_impedance import angular_acceleration
from geoimp_drake.typing import Array

__all__ = ["COMPLIANT", "HANDS", "MEASURED_MUTUAL", "MUTUAL", "OBJECT", "object_control"]

# The rows of the motions (6, 19): O and the mutual pose as measured, C, the mutual pose of the
# references, and both references.
OBJECT, MEASURED_MUTUAL, COMPLIANT, MUTUAL, HANDS = 0, 1, 2, 3, slice(4, 6)

_NOWHERE = np.zeros(FRAME_MOTION_SIZE)

# The law of the mutual pose.
_internal_impedance = compilable(compliant_motion(angular_acceleration))


@compilable
def _at_rest(motions: Array) -> Array:
    """Returns the state (26,) of C and of the mutual pose at rest, where O and the hands are."""
    state = np.zeros(2 * FRAME_STATE_SIZE)
    state[:POSE_SIZE] = sized(motions[0, :POSE_SIZE], POSE_SIZE)
    state[FRAME_STATE_SIZE:][:POSE_SIZE] = sized(motions[1, :POSE_SIZE], POSE_SIZE)
    return state


@cache
def object_control(family_law: Callable[..., Array]) -> Callable[..., bool]:
    """Returns the law of an object with the impedance of an orientation family.

    Args:
        family_law: see `orientation_impedance.OrientationImpedance.law`.
    """
    impedance = compilable(compliant_motion(family_law))

    def law(
        first: Array,
        second: Array,
        h_1: Array,
        h_2: Array,
        desired: Array,
        state: Array,
        pose: Array,
        reference: Array,
        motions: Array,
        wrenches: Array,
        rates: Array,
        translation: Array,
        rotation: Array,
        coupling: Array,
        parts: Array,
        internal: bool,
        internal_translation: Array,
        internal_rotation: Array,
        internal_coupling: Array,
        internal_parts: Array,
        printed: bool,
        mass: float,
        p_OG_O: Array,
        I_G_O: Array,
        gravity: Array,
    ) -> bool:
        """Writes motions, wrenches and rates.

        Returns False unless every signal is plausible, quaternions are unit, and half of the mutual
        orientation is defined.

        Args:
            first: motion of the first hand (19,), in W.
            second: the same of the second (19,).
            h_1: wrench of the first hand (6,), about its own origin, in W.
            h_2: the same of the second (6,).
            desired: motion of D (19,).
            state: of C and of the mutual pose, without accelerations (26,); zeros mean at rest at
                the measured poses. Afterwards the state of the motions written, with unit
                quaternions.
            pose: ¹Q_21 and ᵒΔp_21 of the grasp (7,).
            reference: motion whose inertial load is removed (19,); with zeros only the weight is.
            motions: where to write the motions (6, 19).
            wrenches: where to write what `held_object_wrenches` returns (3, 6).
            rates: where to write the derivative of the state (26,).
            translation: this and the following three are those of `compliant_motion`.
            rotation: see there.
            coupling: see there.
            parts: see there.
            internal: whether the mutual pose gives way to the internal wrench.
            internal_translation: this and the following three are the same of the mutual pose.
            internal_rotation: see there.
            internal_coupling: see there.
            internal_parts: see there.
            printed: this and the following four are those of `held_object_wrenches`.
            mass: see there.
            p_OG_O: see there.
            I_G_O: see there.
            gravity: see there.
        """
        n = FRAME_STATE_SIZE
        if not (is_frame_motion(first) and is_frame_motion(second) and is_finite(reference)):
            return False
        if has_diverged(h_1) or has_diverged(h_2):
            return False
        held_object_motion(first, second, pose[QUATERNION], motions[:2])
        if not is_half_defined(motions[MEASURED_MUTUAL]):
            return False
        held_object_wrenches(
            h_1,
            h_2,
            first[QUATERNION],
            motions[:2],
            printed,
            mass,
            p_OG_O,
            I_G_O,
            gravity,
            reference,
            wrenches,
        )
        C, mutual = motions[COMPLIANT], motions[MUTUAL]
        if not np.any(state):
            state[:] = _at_rest(motions[:2])
        if not impedance(
            state[:n], desired, wrenches[0], translation, rotation, coupling, parts, C
        ):
            return False
        mutual[POSE_SIZE:] = 0.0
        mutual[:POSE_SIZE] = sized(pose, POSE_SIZE)
        if internal:
            grasp = local(sized(_NOWHERE, FRAME_MOTION_SIZE))
            grasp[:POSE_SIZE] = sized(pose, POSE_SIZE)
            if not _internal_impedance(
                state[n:],
                grasp,
                wrenches[2],
                internal_translation,
                internal_rotation,
                internal_coupling,
                internal_parts,
                mutual,
            ):
                return False
            if not is_half_defined(mutual):
                return False
            moving_references(C, mutual, motions[HANDS])
        else:
            rigid_references(C, pose, motions[HANDS])
        frame_state_rate(C, rates[:n])
        frame_state_rate(mutual, rates[n:])
        state[:n] = C[:n]
        state[n:] = mutual[:n]
        return True

    return law
