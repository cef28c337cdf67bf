"""The object's part of tight cooperation as one system: its blocks, sooner."""

from pydrake.systems.framework import Context, DiscreteValues

from geoimp_drake.systems.cooperation.object_control_base import ObjectBlocks, ObjectControlBase
from geoimp_drake.systems.declaring import tickets_of
from geoimp_drake.systems.frame_motion import check_frame_motion, frame_motion_vector
from geoimp_drake.typing import Array

__all__ = ["ObjectControl"]


class ObjectControl(ObjectControlBase):
    """Finds the references of two hands that make their object compliant: six blocks as one.

    It does what these do, connected with each other, with the same laws and the same numbers, in
    one compiled call for a state (laws/object_control.py), and one for a sample of the wrenches:

        CooperativeKinematics ─▶ ImpedanceIntegrator ─▶ CooperativeReferenceGenerator
                              ─▶ InternalImpedance   ─▶               │
                                         GraspMonitor ─▶ ReferenceHold ◀┘

    The continuous state is that of C, then that of the mutual pose of the references. Both start
    with a simulator's first step, at rest on the measured motions; so does the mutual pose of the
    grasp, unless it is prescribed.

    Args:
        blocks: whose work it does.

    Raises:
        SignalError: an input is NaN or infinite, a quaternion is not unit, or C has diverged.
        OutOfDomainError: the hands have turned by more than 355° against each other.

    Ports:
        input desired_motion: of D, the object's, in W (19)
        input stiffness_scale: factors of K_p and K_o, one each if not connected (2)
        input wrench_1: h = [μ; f] by the first hand on its environment, about Eo, in W (6)
        input wrench_2: the same by the second (6)
        input measured_motion_1: of the first hand in W (19)
        input measured_motion_2: of the second (19)
        output compliant_motion: of C, the object's, in W (19)
        output displacement: of D from C: [orientation displacement; Δp_dc] (6)
        output energy: energies and powers of the impedance, `ImpedanceEnergy` (9)
        output object_motion: of O in W as measured (19)
        output object_wrench: by the object on its environment, about Oo, in W (6)
        output internal_wrench: ½(h_2 − h_1), in W (6)
        output mutual_motion: the measured mutual pose, see `CooperativeKinematics` (19)
        output mutual_reference: the grasp's mutual pose ¹Q_21, ᵒΔp_21, at rest (19)
        output reference_motion_1: of the first hand in W (19)
        output reference_motion_2: of the second (19)
        output last_reference_motion_1: of the first hand when the last step began (19)
        output last_reference_motion_2: of the second (19)
        output opened: which grasps have opened, and when, see `GraspMonitor` (3)
        output release: which grippers are to open, see `ReferenceHold` (2)

        Without a watch there are no ports `opened` and `release`.
    """

    def __init__(self, blocks: ObjectBlocks):
        super().__init__(blocks)
        self._declare_object_inputs()
        self._measured = [
            self.DeclareVectorInputPort(f"measured_motion_{k}", frame_motion_vector())
            for k in (1, 2)
        ]
        self._declare_state()
        if self._watch is not None:
            # Without offset, so that its instants are those of the plant's steps to the last bit.
            self.DeclarePeriodicDiscreteUpdateEvent(self._watch[0].period, 0.0, self._sample)
        self._declare_outputs(tickets_of(self, *self._measured))

    def _sample(self, context: Context, state: DiscreteValues) -> None:
        if self._watch is not None:
            memory = state.get_mutable_value(self._memory)
            self._watch_grasps(self._watch, context, state, memory)

    def _hands(self, context: Context, memory: Array) -> tuple[Array, Array]:
        first, second = self._measured
        return first.Eval(context), second.Eval(context)

    def _check_hands(self, hands: tuple[Array, Array]) -> None:
        for k, motion in enumerate(hands, 1):
            check_frame_motion(motion, f"{self.get_name()}:measured_motion_{k}")
