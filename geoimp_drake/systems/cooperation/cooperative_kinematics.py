"""What two hands tell about the object that they hold: its motion, its wrench and the squeeze."""

from dataclasses import dataclass, field

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import (
    Context,
)

from geoimp_drake.compilation.compiled import compiled
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.cooperation.half_rotation import check_half_defined
from geoimp_drake.laws.cooperation.held_object import held_object_motion, held_object_wrenches
from geoimp_drake.laws.frame_motion import is_frame_motion
from geoimp_drake.systems.block import Block
from geoimp_drake.systems.declaring import declare_cache, declare_output, tickets_of
from geoimp_drake.systems.frame_motion import (
    FRAME_MOTION_SIZE,
    QUATERNION,
    check_frame_motion,
    check_signal,
    frame_motion_vector,
)
from geoimp_drake.typing import Array
from geoimp_drake.validation import (
    check,
    choice,
    finite_array,
    finite_vector,
    key,
    non_negative,
    symmetric,
)

__all__ = ["OBJECT_WRENCHES", "CooperativeKinematics", "ObjectLoad"]

OBJECT_WRENCHES = ("grasp-matrix", "printed")


@dataclass
class ObjectLoad:
    """What the hands carry besides the contact: removed from the object's wrench.

    A part of the object that hangs on a hand and is already removed from that hand's wrench is left
    out here.
    """

    mass: float = 0.0  # [kg]
    centre_of_mass: Array = field(default_factory=lambda: np.zeros(3))  # p_OG in O [m]
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))  # about G, in O [kg m²]
    inertial_load: str = "compliant"  # that of C's motion is removed, too; or none: weight alone

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        non_negative(self.mass, key(name, "mass"), "kg")
        finite_vector(self.centre_of_mass, key(name, "centre_of_mass"), 3)
        where = key(name, "inertia")
        inertia = symmetric(finite_array(self.inertia, where, (3, 3)), where)
        choice(self.inertial_load, key(name, "inertial_load"), ("compliant", "none"))
        smallest = float(np.linalg.eigvalsh(inertia)[0])
        if smallest < -1e-9:
            raise ConfigurationError(
                f"{where} is not that of a body: it must be without negative eigenvalues; the "
                f"smallest is {smallest:.4g} kg m²."
            )


class CooperativeKinematics(Block):
    """Reads the motion and the wrench of an object from those of the two hands that hold it.

    Motion (4.1), (4.4), (4.5) and what the second hand does relative to the first (4.7), (4.8),
    (4.9),

        p_o = ½(p_1 + p_2),  Q_o = Q_1 * {cos(ϑ_21/4), sin(ϑ_21/4) ¹r_21},  v_o = ½(v_1 + v_2)
        Δp_21 = p_2 − p_1,   ¹Q_21 = Q_1⁻¹ * Q_2,                            Δv_21 = v_2 − v_1

    the wrench on the environment (4.6), by the full grasp matrix (or as printed, the sum), with the
    object's weight and inertial load removed, and the internal wrench,

        f_o = Σ f_k − m (a − g),   μ_o = Σ (μ_k + (p_k − p_o) × f_k) − p_OG × m (a − g) − …
        h_i = ½(h_2 − h_1),        each moment about its own hand.

    The internal wrench is given in W and also in the frames of the mutual pose, for
    `InternalImpedance`. The sign of ¹Q_21 is the one nearest to that of the mutual reference.

    Frames: W world, O object, G its centre of mass, 1 and 2 the end effectors.

    Args:
        load: mass, centre of mass and inertia of the object.
        gravity: g in W (3) [m/s²].
        wrench: `grasp-matrix` or `printed`.

    Raises:
        ConfigurationError: a field of the load, the gravity or the wrench's name cannot be used.
        SignalError: an input is NaN or infinite, or a quaternion is not unit.
        OutOfDomainError: the hands have turned by more than 355° against each other.

    Ports:
        input motion_1: of the first hand in W (19)
        input motion_2: of the second (19)
        input wrench_1: h = [μ; f] by the first hand on its environment, about its origin, in W (6)
        input wrench_2: the same by the second, about its own origin (6)
        input mutual_reference: ¹Q_21 of the grasp in its first four entries (19)
        input reference_motion: of O, for its inertial load; if not connected, the weight alone (19)
        output object_motion: of O in W; accelerations are the means of the hands' (19)
        output object_wrench: h_o = [μ; f] by the object on its environment, about Oo, in W (6)
        output internal_wrench: h_i = [μ; f], in W (6)
        output mutual_motion: ¹Q_21, ᵒΔp_21, ¹ω_21, ᵒΔṗ_21, see `InternalImpedance` (19)
        output mutual_wrench: the internal wrench [¹μ; ᵒf] (6)
    """

    def __init__(
        self,
        load: ObjectLoad | None = None,
        gravity: Array | None = None,
        wrench: str = "grasp-matrix",
    ):
        super().__init__()
        load = load or ObjectLoad()
        check(load, "load")
        self._inertia = (
            float(load.mass),
            np.array(load.centre_of_mass, dtype=float),
            np.array(load.inertia, dtype=float),
        )
        self._at_rest = np.zeros(FRAME_MOTION_SIZE)
        self._gravity = finite_vector(
            np.array([0.0, 0.0, -9.81]) if gravity is None else gravity, "gravity", 3
        )
        choice(wrench, "object wrench", OBJECT_WRENCHES)
        self._printed = wrench == "printed"
        motions = [
            self.DeclareVectorInputPort(f"motion_{k}", frame_motion_vector()) for k in (1, 2)
        ]
        wrenches = [self.DeclareVectorInputPort(f"wrench_{k}", 6) for k in (1, 2)]
        self._motions, self._wrenches = motions, wrenches
        self._nearby = self.DeclareVectorInputPort("mutual_reference", frame_motion_vector())
        self._reference = self.DeclareVectorInputPort("reference_motion", frame_motion_vector())
        self._motion_law = compiled(held_object_motion)
        self._wrench_law = compiled(held_object_wrenches)
        self._is_motion = compiled(is_frame_motion)
        poses = tickets_of(self, *motions, self._nearby)
        both = poses | tickets_of(self, *wrenches, self._reference)
        self._found_motions = declare_cache(self, "motions", self._calc_motions, poses)
        self._found_wrenches = declare_cache(self, "wrenches", self._calc_wrenches, both)
        declare_output(self, "object_motion", 19, lambda c: self._found_motions.Eval(c)[0], poses)
        declare_output(self, "object_wrench", 6, lambda c: self._found_wrenches.Eval(c)[0], both)
        declare_output(self, "internal_wrench", 6, lambda c: self._found_wrenches.Eval(c)[1], both)
        declare_output(self, "mutual_motion", 19, lambda c: self._found_motions.Eval(c)[1], poses)
        declare_output(self, "mutual_wrench", 6, lambda c: self._found_wrenches.Eval(c)[2], both)

    @property
    def load_arguments(self) -> tuple[bool, float, Array, Array, Array]:
        """Whether (4.6) is taken as printed; the object's mass, p_OG and I about G in O; g in W."""
        return self._printed, *self._inertia, self._gravity

    def _calc_motions(self, context: Context, value: AbstractValue) -> None:
        first, second = (port.Eval(context) for port in self._motions)
        if not (self._is_motion(first) and self._is_motion(second)):
            check_frame_motion(first, f"{self.get_name()}:motion_1")
            check_frame_motion(second, f"{self.get_name()}:motion_2")
        motions = np.empty((2, FRAME_MOTION_SIZE))
        self._motion_law(first, second, self._nearby.Eval(context)[QUATERNION], motions)
        check_half_defined(motions[1])
        value.set_value(motions)

    def _calc_wrenches(self, context: Context, value: AbstractValue) -> None:
        h_1, h_2 = (port.Eval(context) for port in self._wrenches)
        check_signal(h_1, f"{self.get_name()}:wrench_1")
        check_signal(h_2, f"{self.get_name()}:wrench_2")
        wrenches = np.empty((3, 6))
        self._wrench_law(
            h_1,
            h_2,
            self._motions[0].Eval(context)[QUATERNION],
            self._found_motions.Eval(context),
            self._printed,
            *self._inertia,
            self._gravity,
            self._reference_motion(context),
            wrenches,
        )
        value.set_value(wrenches)

    def _reference_motion(self, context: Context) -> Array:
        """Returns the motion whose inertial load is removed; zeros if there is none."""
        if not self._reference.HasValue(context):
            return self._at_rest
        motion: Array = self._reference.Eval(context)
        check_signal(motion, f"{self.get_name()}:reference_motion")
        return motion
