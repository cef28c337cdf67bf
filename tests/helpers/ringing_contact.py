"""A hand that presses on a stiff wall while its wrench comes late: contacts that ring."""

from dataclasses import dataclass

import numpy as np
from limited_arm import POSTURES, arm_plant, pose_at
from pydrake.common.value import AbstractValue
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce, MultibodyPlant
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from signal_sources import Source, fixed_step

from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.impedance_controller import make_impedance_controller
from geoimp_drake.systems.frame_motion import frame_motion_at_rest

STEP = 1e-3


class Wall(LeafSystem):
    """Pushes E up along Z, K_e and D_e times depth and speed, held for a step; it is read late.

    The wrench sampled as a step ends is that of the step; it is put out `delay` samples later. The
    memory is the work on the wall so far, the force of the step, and the readings on their way.
    """

    def __init__(
        self, plant: MultibodyPlant, stiffness: float, damping: float, height: float, delay: int
    ):
        super().__init__()
        self._plant, self._E = plant, plant.GetFrameByName("flange")
        self._scratch = plant.CreateDefaultContext()
        self._stiffness, self._damping, self._height = stiffness, damping, height
        self.DeclareVectorInputPort("state", plant.num_multibody_states())
        self._memory = self.DeclareDiscreteState(np.array([0.0, np.nan, *[0.0] * (delay + 2)]))
        self.DeclarePeriodicDiscreteUpdateEvent(STEP, 0.0, self._sample)
        self.DeclareAbstractOutputPort(
            "push", lambda: AbstractValue.Make([ExternallyAppliedSpatialForce()]), self._push
        )
        self.DeclareVectorOutputPort("wrench", 6, self._read, {self.xd_ticket()})

    def _depth(self, context) -> float:
        self._plant.SetPositionsAndVelocities(self._scratch, self.get_input_port().Eval(context))
        z = self._E.CalcPoseInWorld(self._scratch).translation()[2]
        return self._height - z

    def _force(self, context) -> float:
        depth = self._depth(context)
        speed = -self._E.CalcSpatialVelocityInWorld(self._scratch).translational()[2]
        return max(self._stiffness * depth + self._damping * speed, 0.0) if depth > 0.0 else 0.0

    def _sample(self, context, state) -> None:
        work, before, *forces = context.get_discrete_state(self._memory).value()
        depth = self._depth(context)
        # forces[0] has pushed since the last sample; it is read now.
        if np.isfinite(before):
            work += forces[0] * (depth - before)
        state.set_value(self._memory, [work, depth, self._force(context), *forces[:-1]])

    def _push(self, context, output) -> None:
        push = ExternallyAppliedSpatialForce()
        push.body_index = self._E.body().index()
        push.p_BoBq_B = self._E.GetFixedPoseInBodyFrame().translation()
        push.F_Bq_W = SpatialForce(np.zeros(3), [0.0, 0.0, self._force(context)])
        output.set_value([push])

    def _read(self, context, output) -> None:
        force = context.get_discrete_state(self._memory).value()[-1]
        output.SetFromVector([0.0, 0.0, 0.0, 0.0, 0.0, -force])


@dataclass
class Rung:
    """A row a step: time, true force, work on the wall, and what the controller puts out."""

    t: np.ndarray
    force: np.ndarray
    work: np.ndarray
    outputs: dict[str, np.ndarray]

    def swing(self, begin: float, end: float = np.inf) -> float:
        """Returns the range of the force in a time [N]."""
        rows = (self.t >= begin) & (self.t < end)
        return float(np.ptp(self.force[rows]))


def press(
    config: ImpedanceControllerConfig,
    stiffness: float,
    delay: int,
    duration: float,
    damping: float = 0.0,
) -> Rung:
    """Lets D move 5 cm into a wall 5 mm below the hand, within half a second."""
    plant, q = arm_plant(), POSTURES[6]
    X = pose_at(plant, q)
    builder = DiagramBuilder()
    builder.AddSystem(plant)
    E = plant.GetFrameByName("flange")
    arm = E.model_instance()
    controller = builder.AddSystem(make_impedance_controller(plant, arm, E, config))
    wall = builder.AddSystem(Wall(plant, stiffness, damping, X.translation()[2] - 0.005, delay))
    still = frame_motion_at_rest(X)

    def desired(t: float) -> np.ndarray:
        motion, s = still.copy(), np.clip(t / 0.5, 0.0, 1.0)
        motion[6] -= 0.055 * s * s * (3 - 2 * s)
        motion[12] = -0.055 * 6 * s * (1 - s) / 0.5
        return motion

    source = builder.AddSystem(Source(desired))
    for output, target in (
        (plant.get_state_output_port(arm), controller.GetInputPort("estimated_state")),
        (wall.GetOutputPort("wrench"), controller.GetInputPort("wrench")),
        (source.get_output_port(), controller.GetInputPort("desired_motion")),
        (controller.GetOutputPort("actuation"), plant.get_actuation_input_port(arm)),
        (plant.get_state_output_port(), wall.get_input_port()),
        (wall.GetOutputPort("push"), plant.get_applied_spatial_force_input_port()),
    ):
        builder.Connect(output, target)
    simulator = fixed_step(builder.Build())
    root = simulator.get_mutable_context()
    plant.SetPositions(plant.GetMyMutableContextFromRoot(root), q)
    names = ("damping_scale", "given_out", "alternating") if config.passivity.damping else ()
    rows = []

    def look(root) -> None:
        memory = wall.GetMyContextFromRoot(root).get_discrete_state_vector().value()
        own = controller.GetMyContextFromRoot(root)
        values = [controller.GetOutputPort(name).Eval(own)[0] for name in names]
        rows.append((root.get_time(), memory[2], memory[0], *values))

    simulator.set_monitor(look)
    simulator.AdvanceTo(duration)
    t, force, work, *columns = np.array(rows).T
    return Rung(t, force, work, dict(zip(names, columns, strict=True)))
