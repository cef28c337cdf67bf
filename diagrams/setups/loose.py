"""Loose cooperation: one arm brings a peg by a motion program, the other holds the hole.

An industrial control unit, which knows nothing of forces, runs the arm with the peg. The other arm
is compliant about the remote centre of compliance E, a point fixed in its hand.

```
 program ─▶ industrial controller ◀──▶ plant: arm ═ sensor ═ peg ▷ hole ═ sensor ═ arm
                                                                 desired motion ─▶ compliant arm
```

Frames: P is at the peg's tip, z out of it. T is where the arm's control unit believes P to be. H is
at the hole's mouth, z out of it. S is the hand's mounting face behind the wrist sensor, z forward.
"""

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, Frame

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.diagrams.scene.cell import add_cell
from geoimp_drake.diagrams.scene.insertion import insertion
from geoimp_drake.diagrams.scene.peg_hole import add_block, add_peg
from geoimp_drake.diagrams.scene.rod import add_rod, mounting_face
from geoimp_drake.diagrams.setups.arm_log import record_arm
from geoimp_drake.diagrams.setups.compliant_arm import add_compliant_arm, sensor_joint_of
from geoimp_drake.diagrams.setups.insertion_end import InsertionWatch
from geoimp_drake.diagrams.setups.loose_scenario import (
    LooseScenario,
    PlannedInsertion,
    TaughtPose,
)
from geoimp_drake.diagrams.setups.posture import start_posture
from geoimp_drake.diagrams.setups.setup import Setup
from geoimp_drake.diagrams.setups.setup_builder import SetupBuilder
from geoimp_drake.diagrams.setups.true_plant import add_friction
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.motion_program.pdl import read_program
from geoimp_drake.motion_program.plan import MotionPlan, plan
from geoimp_drake.motion_program.taught import taught_values
from geoimp_drake.rotations import euler
from geoimp_drake.simulation.recorder import Recorder
from geoimp_drake.systems.arm.industrial_controller import (
    IndustrialController,
    make_industrial_controller,
)

__all__ = ["build_loose"]


@dataclass
class _Frames:
    """P the peg's tip, T where it is believed to be, H the mouth, E the remote centre."""

    P: Frame
    T: Frame
    H: Frame
    E: Frame


def build_loose(
    scenario: LooseScenario,
    meshcat: Meshcat | None = None,
    *,
    live: bool = False,
    logged: bool = True,
) -> Setup:
    """Builds the diagram of a scenario.

    Args:
        scenario: its open fields are filled in.
        meshcat: draws the run; None for no drawing.
        live: add sliders there, see `SetupBuilder`.
        logged: with its log, see there.

    Raises:
        ConfigurationError: the scenario cannot be used; the message says why.
    """
    setup = SetupBuilder(
        scenario, lambda plant: _add_models(plant, scenario), meshcat, live=live, logged=logged
    )
    plant, frames = setup.plant, setup.models
    X_WH = _hold_still(plant, frames, scenario)
    motion_plan = _plan(plant, frames, scenario, X_WH)
    if scenario.duration is None:
        scenario.duration = motion_plan.trajectory.end_time() + scenario.hold

    X_WE = X_WH @ scenario.pose_of_mouth().inverse() @ RigidTransform(scenario.remote_centre)
    desired = setup.add_desired_motion(X_WE)
    sensor_joint = sensor_joint_of(plant, scenario.compliant)
    hand = add_compliant_arm(setup, scenario.compliant, frames.E, sensor_joint, desired, scenario)
    servo = _add_servo(setup, scenario, motion_plan)
    setup.add_external_wrench(frames.H, X_WH.rotation(), scenario.external)
    if setup.is_logged:
        hand.record(setup)
        _record_peg(setup, scenario.peg_arm, servo)
        _end_early(setup, scenario)
    _record_program(setup.recorder, motion_plan)
    wrench = hand.controller.GetOutputPort("wrench")
    setup.add_views(hand.name, "DCE", wrench, hand.controller, frames.H)
    return setup.build(loop=hand.loop)


def _record_peg(setup: SetupBuilder[_Frames], arm: str, servo: IndustrialController) -> None:
    """Logs the arm with the peg, and the hole."""
    true, frames = setup.true_plant, setup.models
    motion_P = true.motion(frames.P, "motion_of_P")
    ports = {"u": servo.GetOutputPort("actuation"), "motion_E": motion_P}
    record_arm(setup.recorder, setup.plant, arm, ports)
    setup.recorder.record(f"{arm}/set_point", servo.GetOutputPort("set_point"))
    setup.recorder.record("hole/motion_H", true.motion(frames.H, "motion_of_H"))


def _end_early(setup: SetupBuilder[_Frames], scenario: LooseScenario) -> None:
    """Lets the run end with the insertion, if it is to; it reads the logged signals."""
    if scenario.until is None:
        return
    watch = InsertionWatch(scenario.until, scenario.log_period)
    system = setup.builder.AddNamedSystem("insertion_watch", watch)
    keys = (f"{scenario.peg_arm}/motion_E", "hole/motion_H", f"{scenario.compliant}/wrench_true")
    for k, key in enumerate(keys):
        setup.builder.Connect(setup.recorder.port(key), system.get_input_port(k))


def _record_program(recorder: Recorder, motion_plan: MotionPlan) -> None:
    """Puts the moves and their times into the log."""
    moves = motion_plan.segments
    recorder.constant("program/moves", np.array([move.name for move in moves]))
    recorder.constant("program/times", np.array([(move.begin, move.end) for move in moves]))


def _add_models(plant: MultibodyPlant, scenario: LooseScenario) -> _Frames:
    """Adds arms, sensors, peg and block."""
    add_cell(plant, "two_arms")
    parts, forward = scenario.peg_hole, RotationMatrix()
    add_rod(plant, scenario.peg_arm, scenario.tip - parts.peg_length, forward)
    add_rod(plant, scenario.compliant, scenario.mouth - parts.block_length, forward)
    hand = mounting_face(plant, scenario.compliant)
    gripper, X_ST = mounting_face(plant, scenario.peg_arm), RigidTransform([0, 0, scenario.tip])
    peg = add_peg(plant, gripper, X_ST @ scenario.grasp.pose(), parts)
    T = peg.body_frame()
    if not scenario.grasp.is_none():
        T = plant.AddFrame(FixedOffsetFrame("taught_tip", gripper, X_ST))
    block = add_block(plant, hand, scenario.pose_of_mouth(), parts)
    E = plant.AddFrame(
        FixedOffsetFrame("remote_centre", hand, RigidTransform(scenario.remote_centre))
    )
    add_friction(plant, scenario.world)
    plant.Finalize()
    return _Frames(peg.body_frame(), T, block.body_frame(), E)


def _hold_still(plant: MultibodyPlant, frames: _Frames, scenario: LooseScenario) -> RigidTransform:
    """Puts the compliant arm into the posture in which it holds the hole; returns X_WH."""
    arm = plant.GetModelInstanceByName(scenario.compliant)
    start = scenario.roles(scenario.compliant).hold
    posture, X_WH = start_posture(
        ControlModel.of_arm(plant, arm, frames.H),
        start,
        f"{scenario.compliant}.hold",
        regular=scenario.limits is None,
    )
    plant.SetDefaultPositions(arm, posture)
    start.posture = posture.tolist()
    return X_WH


def _plan(
    plant: MultibodyPlant, frames: _Frames, scenario: LooseScenario, X_WH: RigidTransform
) -> MotionPlan:
    """Plans the program of the arm with the peg and puts the arm at its start."""
    arm = plant.GetModelInstanceByName(scenario.peg_arm)
    role, planned = scenario.roles(scenario.peg_arm), scenario.planned()
    poses = {
        name: _taught_pose(X_WH, pose, planned) for name, pose in scenario.program.poses.items()
    }
    constants = {scenario.program.path_constant: 1e3 * planned.path}
    program = read_program(
        scenario.program.path(),
        {**taught_values(role.taught), **poses},
        {**constants, **scenario.program.constants},
    )
    motion_plan = plan(plant, arm, frames.T, program, np.array(role.start), scenario.speeds)
    plant.SetDefaultPositions(arm, role.start)
    _check_outside(plant, frames, X_WH)
    return motion_plan


def _taught_pose(
    X_WH: RigidTransform, pose: TaughtPose, planned: PlannedInsertion
) -> RigidTransform:
    """Returns X_WP as it was taught: in line with the hole, except for the errors of the plan.

    The tool is turned about the peg's tip.
    """
    R_HP = RotationMatrix.MakeXRotation(np.pi)  # the peg looks into the hole
    R_WW = euler.to_rotation(np.deg2rad(planned.rotation_deg))
    R_WP = RotationMatrix(R_WW) @ X_WH.rotation() @ R_HP
    return RigidTransform(R_WP, X_WH.translation() + pose.offset + planned.offset)


def _check_outside(plant: MultibodyPlant, frames: _Frames, X_WH: RigidTransform) -> None:
    """Raises ConfigurationError if the peg starts behind the hole's mouth."""
    X_WP = frames.P.CalcPoseInWorld(plant.CreateDefaultContext())
    depth = insertion(X_WP, X_WH).depth
    if depth > 0:
        raise ConfigurationError(
            f"The peg's tip starts {1e3 * depth:.1f} mm behind the hole's mouth; start the arm "
            f"that brings it farther away."
        )


def _add_servo(
    setup: SetupBuilder[_Frames], scenario: LooseScenario, motion_plan: MotionPlan
) -> IndustrialController:
    """Adds the industrial control unit of the arm with the peg, connected to the plant."""
    builder, plant, frames = setup.builder, setup.plant, setup.models
    arm = plant.GetModelInstanceByName(scenario.peg_arm)
    servo = builder.AddSystem(
        make_industrial_controller(plant, arm, frames.T, motion_plan.trajectory, scenario.servo)
    )
    setup.true_plant.connect_readings(arm, servo.GetInputPort("estimated_state"))
    setup.true_plant.connect_torques(servo.GetOutputPort("actuation"), arm)
    return servo
