"""The motion that a signal had when the last step began, as a held state."""

from pydrake.systems.framework import Context, DiscreteValues, State

from geoimp_drake.systems.block import Block
from geoimp_drake.systems.frame_motion import frame_motion_vector

__all__ = ["LastMotion"]


class LastMotion(Block):
    """Holds what a frame motion was when the last step began.

    A reaction force belongs to the step that it followed from, and so does the motion whose
    inertial load is to be removed from it: see `ForceTorqueSensor`, `reference_is_held`.

    Ports:
        input motion: of a frame, in W (19)
        output last_motion: the same when the last step began; of no input directly (19)
    """

    def __init__(self) -> None:
        super().__init__()
        self._motion = self.DeclareVectorInputPort("motion", frame_motion_vector())
        self._last = self.declare_state(frame_motion_vector())
        self.declare_state_output("last_motion", self._last)
        self.DeclareInitializationDiscreteUpdateEvent(self._forget)
        # Together with the step of a plant with sampled output ports.
        self.DeclarePerStepUnrestrictedUpdateEvent(self._keep)

    def _forget(self, context: Context, state: DiscreteValues) -> None:
        state.set_value(self._last, frame_motion_vector().value())

    def _keep(self, context: Context, state: State) -> None:
        state.get_mutable_discrete_state().set_value(self._last, self._motion.Eval(context))
