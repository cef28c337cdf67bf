"""A closed loop of blocks in continuous time: an arm, its controller and a spring as a wall."""

import numpy as np
from impedance_rig import D_O, D_P, K_O, K_P, M_O, M_P
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, System
from redundant_arms import FACING

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.diagrams.scene.cell import END_EFFECTOR, SEVEN, SIX, add_cell
from geoimp_drake.laws.frame_motion import FRAME_STATE_SIZE, POSE_SIZE
from geoimp_drake.laws.impedance.families import make_family
from geoimp_drake.parts.part import Memory, Output
from geoimp_drake.systems.arm.arm_model import ArmModel
from geoimp_drake.systems.arm.inverse_dynamics_inner_loop import InverseDynamicsInnerLoop
from geoimp_drake.systems.arm.motion_controller import MotionController
from geoimp_drake.systems.arm.redundancy_resolver import RedundancyResolver
from geoimp_drake.systems.frame_motion import frame_motion_at_rest
from geoimp_drake.systems.impedance_integrator import ImpedanceIntegrator
from geoimp_drake.systems.part_system import PartSystem

# Away from singularities, in the model's order.
POSTURES = {6: np.array([0.1, 0.3, -0.5, 0.7, 0.4, 0.6]), 7: FACING}
CELLS = {6: ("single_arm", SIX), 7: ("track_arm", SEVEN)}

# Of the wall [N/m].
K_W = np.diag([0.0, 0.0, 2e4])


class SpringWall:
    """A part: the wrench of E on a spring about a point, and the torques of its reaction."""

    def __init__(self, n: int, stiffness: np.ndarray, p_W: np.ndarray):
        self._stiffness, self._p_W = stiffness, p_W
        self.inputs = {"arm": object()}
        self.memory = Memory()
        self.outputs = (
            Output("wrench", 6, self._write_wrench, ("arm",)),
            Output("generalized_force", n, self._write_force, ("arm",)),
        )

    def _write_wrench(self, now, h):
        h[:3] = 0.0
        h[3:] = self._stiffness @ (now["arm"].p_WE - self._p_W)

    def _write_force(self, now, force):
        force[:] = -now["arm"].Jv_V_WE.T @ now.output("wrench")


class ContinuousLoop:
    """The loop at rest, with C and D on E and the wall's spring relaxed.

    Args:
        joints: of the arm, 6 or 7.
        family: of the impedance, and the law of motion control.
        time_step: of the plant [s].
        desired: source of D's motion; D rests on E by default.
    """

    def __init__(
        self,
        joints: int = 6,
        family: str = "quaternion",
        time_step: float = 0.0,
        desired: System | None = None,
    ):
        builder, plant, (cell, name) = DiagramBuilder(), MultibodyPlant(time_step), CELLS[joints]
        instances = add_cell(plant, cell)
        plant.Finalize()
        E = plant.GetFrameByName(END_EFFECTOR, instances[f"{name}_tool"])
        self.plant, self.model = plant, ControlModel.of_arm(plant, instances[name], E)
        self._q = self.model.in_plant_order(POSTURES[joints])
        at_rest = plant.CreateDefaultContext()
        plant.SetPositions(at_rest, self._q)
        self.X_WE: RigidTransform = E.CalcPoseInWorld(at_rest)

        add, connect = builder.AddNamedSystem, builder.Connect
        add("plant", plant)
        arm = add("arm", ArmModel(self.model))
        rotation = make_family(family, M_O, D_O, K_O)
        self.impedance = add("impedance", ImpedanceIntegrator(M_P, D_P, K_P, rotation))
        motion = add("motion_control", MotionController(orientation=family))
        resolver = add("resolver", RedundancyResolver(self.model))
        torque = add("inverse_dynamics", InverseDynamicsInnerLoop(self.model))
        wall = add("wall", PartSystem(SpringWall(joints, K_W, self.X_WE.translation())))

        connect(plant.get_state_output_port(instances[name]), arm.GetInputPort("state"))
        for block in (motion, resolver, torque, wall):
            connect(arm.GetOutputPort("arm"), block.GetInputPort("arm"))
        for block in (self.impedance, torque):
            connect(wall.GetOutputPort("wrench"), block.GetInputPort("wrench"))
        measured = self.impedance.GetInputPort("measured_motion")
        connect(arm.GetOutputPort("motion_E"), measured)
        force = plant.get_applied_generalized_force_input_port()
        connect(wall.GetOutputPort("generalized_force"), force)
        for source, target, port in (
            (self.impedance.GetOutputPort("compliant_motion"), motion, "reference_motion"),
            (motion.GetOutputPort("task_acceleration"), resolver, "task_acceleration"),
            (resolver.GetOutputPort("joint_acceleration"), torque, "joint_acceleration"),
        ):
            connect(source, target.GetInputPort(port))
        actuation = plant.get_actuation_input_port(instances[name])
        connect(torque.GetOutputPort("actuation"), actuation)
        self._is_open = desired is None
        if desired is None:
            builder.ExportInput(self.impedance.GetInputPort("desired_motion"), "desired_motion")
        else:
            add("desired", desired)
            connect(desired.get_output_port(), self.impedance.GetInputPort("desired_motion"))
        builder.ExportOutput(wall.GetOutputPort("wrench"), "wrench")
        self.diagram: Diagram = builder.Build()
        self.diagram.set_name("loop")

    def context(self) -> Context:
        """Returns a context at rest."""
        context = self.diagram.CreateDefaultContext()
        motion = frame_motion_at_rest(self.X_WE)
        self.plant.SetPositions(self.plant.GetMyMutableContextFromRoot(context), self._q)
        C = np.concatenate((motion[:POSE_SIZE], np.zeros(FRAME_STATE_SIZE - POSE_SIZE)))
        self.impedance.GetMyMutableContextFromRoot(context).SetContinuousState(C)
        if self._is_open:
            self.diagram.get_input_port().FixValue(context, motion)
        return context
