"""The controller's own model of an arm is the arm of the user's plant, or an error says why not."""

import numpy as np
import pytest
from arms import POSTURES, ArmPlant, add_arm, add_tool, arm_urdf, make_arm_plant
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import DiscreteContactApproximation, MultibodyPlant
from pydrake.multibody.tree import (
    BallRpyJoint,
    JacobianWrtVariable,
    ModelInstanceIndex,
    SpatialInertia,
)

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.dynamics import ChainDynamics
from geoimp_drake.arm.state import ArmState, evaluate_arm
from geoimp_drake.errors import ModelError
from geoimp_drake.laws.compositions.arm_quantities import measured_motion

KINDS = {
    "six": {"joints": 6},
    "seven": {"joints": 7},
    "six declared from the hand": {"joints": 6, "from_hand": True},
    "seven declared from the hand": {"joints": 7, "from_hand": True},
    "six among others": {"joints": 6, "company": True},
    "seven among others": {"joints": 7, "company": True, "actuator_order": [7, 2, 5, 1, 3, 4, 6]},
}

# Of an arm; not what a chain has found besides.
QUANTITIES = ArmState.__slots__[:-1]


def both_sides(rig: ArmPlant, seed: int = 0) -> tuple[ArmState, ArmState]:
    """Returns the arm at a random state by the control model and by the user's own plant."""
    rng = np.random.default_rng(seed)
    n = rig.num_joints
    q, v = rig.posture + rng.uniform(-0.5, 0.5, n), rng.uniform(-1, 1, n)
    model = ControlModel.of_arm(rig.plant, rig.arm, rig.E)
    state = np.concatenate((q, v))[model.state_order]
    return evaluate_arm(model, model.plant.CreateDefaultContext(), state), _by_plant(rig, q, v)


def _by_plant(rig: ArmPlant, q: np.ndarray, v: np.ndarray) -> ArmState:
    plant, W, origin = rig.plant, rig.plant.world_frame(), np.zeros(3)
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, rig.arm, q)
    plant.SetVelocities(context, rig.arm, v)
    rows = plant.GetVelocitiesFromArray(rig.arm, np.arange(plant.num_velocities())).astype(int)
    kV = JacobianWrtVariable.kV
    J = plant.CalcJacobianSpatialVelocity(context, kV, rig.E, origin, W, W)[:, rows]
    Jdot_v = plant.CalcBiasSpatialAcceleration(context, kV, rig.E, origin, W, W)
    X_WE = rig.E.CalcPoseInWorld(context)
    Q = X_WE.rotation().ToQuaternion().wxyz()
    damping = [
        plant.get_joint(index).default_damping()
        for index in plant.GetJointIndices(rig.arm)
        if plant.get_joint(index).num_velocities()
    ]
    return ArmState(
        q=q,
        v=v,
        Q_WE=Q * np.sign(Q[0]),
        R_WE=X_WE.rotation().matrix(),
        p_WE=X_WE.translation(),
        V_WE=rig.E.CalcSpatialVelocityInWorld(context).get_coeffs(),
        Jv_V_WE=J,
        Jdot_v=Jdot_v.get_coeffs(),
        # Friction is implicit in a discrete plant's step: so much more inertia.
        B=plant.CalcMassMatrix(context)[np.ix_(rows, rows)] + plant.time_step() * np.diag(damping),
        Cv=plant.CalcBiasTerm(context)[rows],
        Fv=np.array(damping) * v,
        g=-plant.CalcGravityGeneralizedForces(context)[rows],
    )


@pytest.mark.parametrize("kind", KINDS)
def test_kinematics_and_dynamics_are_those_of_the_users_plant(kind: str) -> None:
    for seed in range(5):
        ours, theirs = both_sides(make_arm_plant(**KINDS[kind]), seed)
        for name in QUANTITIES:
            value, expected = getattr(ours, name), getattr(theirs, name)
            np.testing.assert_allclose(value, expected, rtol=0, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("gravity", [True, False], ids=["weight", "no weight"])
@pytest.mark.parametrize("kind", KINDS)
def test_arrays_of_the_model_are_the_same_arm(kind: str, gravity: bool) -> None:
    """What the compiled chain computes is what Drake does."""
    rig = make_arm_plant(**KINDS[kind], gravity=gravity)
    model = ControlModel.of_arm(rig.plant, rig.arm, rig.E)
    dynamics, n = ChainDynamics(model), rig.num_joints
    for seed in range(5):
        drakes, _ = both_sides(rig, seed)
        ours = dynamics.evaluate(None, np.concatenate((drakes.q, drakes.v)))
        for name in QUANTITIES:
            value, expected = getattr(ours, name), getattr(drakes, name)
            scale = np.abs(expected).max()
            np.testing.assert_allclose(value, expected, rtol=0, atol=1e-12 * scale, err_msg=name)
        assert bool(drakes.g.any()) == gravity
        reading, motion = np.empty(2 * n), np.empty(19)
        reading[model.state_order] = np.concatenate((drakes.q, drakes.v))
        assert measured_motion(*dynamics.arguments, model.state_order, reading, motion)
        expected = np.concatenate((drakes.Q_WE, drakes.p_WE, drakes.V_WE, np.zeros(6)))
        np.testing.assert_allclose(motion, expected, rtol=0, atol=1e-12)


def test_model_holds_one_body_a_joint_whatever_else_the_plant_contains() -> None:
    rig = make_arm_plant(company=True)
    model = ControlModel.of_arm(rig.plant, rig.arm, rig.E)
    assert model.plant.num_bodies() == 1 + rig.num_joints
    assert model.joint_names == tuple(f"joint{k}" for k in range(1, 7))
    assert model.effort_limits == pytest.approx(np.full(6, 400.0))


def test_posture_of_the_plant_when_the_model_is_made_does_not_matter() -> None:
    near, far = make_arm_plant(), make_arm_plant()
    far.plant.SetDefaultPositions(far.arm, far.posture + 0.7)
    (a, _), (b, _) = both_sides(near), both_sides(far)
    np.testing.assert_allclose(a.B, b.B, atol=1e-12)
    np.testing.assert_allclose(a.Jv_V_WE, b.Jv_V_WE, atol=1e-12)


def test_actuators_are_told_apart_from_joints() -> None:
    rig = make_arm_plant(actuator_order=[4, 2, 6, 1, 3, 5])
    model = ControlModel.of_arm(rig.plant, rig.arm, rig.E)
    tau = np.arange(1.0, 7.0)
    forces = rig.plant.MakeActuationMatrix() @ tau[model.actuation_order]
    np.testing.assert_array_equal(forces, tau)


def test_a_load_that_is_named_stays_out_of_the_model() -> None:
    rig = make_arm_plant(company=True)
    gripper = rig.plant.GetModelInstanceByName("gripper")
    q = np.concatenate((rig.posture, np.zeros(6)))

    def mass(without: list) -> float:
        model = ControlModel.of_arm(rig.plant, rig.arm, rig.E, without)
        context = model.plant.CreateDefaultContext()
        model.plant.SetPositionsAndVelocities(context, q)
        return model.plant.CalcTotalMass(context)

    assert mass([]) - mass([gripper]) == pytest.approx(0.6)


# Plants without such an arm, and what the error must say.


def _unfinished() -> tuple:
    plant = MultibodyPlant(1e-3)
    arm, hand = add_arm(plant)
    return plant, arm, hand.body_frame()


def _floating() -> tuple:
    plant = MultibodyPlant(1e-3)
    (arm,) = Parser(plant).AddModelsFromString(arm_urdf(), "urdf")
    plant.Finalize()
    return plant, arm, plant.GetFrameByName("link6")


def _five() -> tuple:
    plant = MultibodyPlant(1e-3)
    arm, hand = add_arm(plant, 5)
    plant.Finalize()
    return plant, arm, hand.body_frame()


def _two_without_motor() -> tuple:
    rig = make_arm_plant(actuator_order=[1, 2, 3, 6])
    return rig.plant, rig.arm, rig.E


def _frame_of_the_other_arm() -> tuple:
    rig = make_arm_plant(company=True)
    other = rig.plant.GetModelInstanceByName("other")
    return rig.plant, rig.arm, rig.plant.GetFrameByName("link6", other)


def _frame_before_the_last_joint() -> tuple:
    rig = make_arm_plant(joints=7)
    return rig.plant, rig.arm, rig.plant.GetFrameByName("link6", rig.arm)


def _frame_of_the_base() -> tuple:
    rig = make_arm_plant()
    return rig.plant, rig.arm, rig.plant.GetFrameByName("base", rig.arm)


def _frame_on_a_finger() -> tuple:
    rig = make_arm_plant(company=True)
    return rig.plant, rig.arm, rig.plant.GetFrameByName("finger1")


def _ball_joint_in_the_arm() -> tuple:
    plant = MultibodyPlant(1e-3)
    arm, hand = add_arm(plant)
    ball = plant.AddRigidBody("wobbling", arm, SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    plant.AddJoint(BallRpyJoint("socket", hand.body_frame(), ball.body_frame()))
    plant.Finalize()
    return plant, arm, ball.body_frame()


def _weightless_tool() -> tuple:
    plant = MultibodyPlant(1e-3)
    arm, hand = add_arm(plant)
    _, E = add_tool(plant, hand)
    plant.set_gravity_enabled(plant.GetModelInstanceByName("tool"), False)
    plant.Finalize()
    return plant, arm, E


def _foreign_frame() -> tuple:
    rig = make_arm_plant()
    return rig.plant, rig.arm, make_arm_plant().E


def _foreign_instance() -> tuple:
    rig = make_arm_plant()
    return rig.plant, ModelInstanceIndex(77), rig.E


ERRORS = {
    _unfinished: ["not finalized", "plant.Finalize()"],
    _floating: ["'base'", "quaternion_floating", "WeldFrames", "'link6'"],
    _five: ["5 joints", "at least 6", "joint1, joint2, joint3, joint4, joint5"],
    _two_without_motor: ["no actuator", "joint4, joint5", "AddJointActuator"],
    _frame_of_the_other_arm: ["'link6'", "do not belong to 'arm", "'joint1'", "'joint6'"],
    _frame_before_the_last_joint: ["'link6'", "'joint7'", "do not move"],
    _frame_of_the_base: ["'base'", "'joint1'", "'joint6'", "do not move"],
    _frame_on_a_finger: ["'finger1'", "do not belong", "'slide1'"],
    _ball_joint_in_the_arm: ["'socket'", "ball_rpy", "revolute and prismatic"],
    _weightless_tool: ["Gravity is off", "tool", "set_gravity_enabled"],
    _foreign_frame: ["'E'", "another plant"],
    _foreign_instance: ["Model instance 77", "has 4"],
}


@pytest.mark.parametrize("case", ERRORS, ids=lambda case: case.__name__.strip("_"))
def test_a_plant_without_such_an_arm_is_refused_with_what_is_missing(case) -> None:
    plant, arm, E = case()
    with pytest.raises(ModelError) as error:
        ControlModel.of_arm(plant, arm, E)
    for text in ERRORS[case]:
        assert text in str(error.value)


def test_a_floating_body_in_the_arms_instance_is_refused() -> None:
    plant = MultibodyPlant(1e-3)
    arm, hand = add_arm(plant)
    plant.AddRigidBody("loose", arm, SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    plant.Finalize()
    with pytest.raises(ModelError, match=r"loose"):
        ControlModel.of_arm(plant, arm, hand.body_frame())


def test_gravity_of_the_plant_is_that_of_the_model() -> None:
    plant = MultibodyPlant(1e-3)
    plant.mutable_gravity_field().set_gravity_vector([1.0, -2.0, -3.7])
    ours, theirs = both_sides(make_arm_plant(plant))
    np.testing.assert_allclose(ours.g, theirs.g, atol=1e-9)
    assert np.linalg.norm(ours.g) > 1.0


def test_an_arm_without_gravity_needs_no_torque_to_hold_it() -> None:
    plant = MultibodyPlant(1e-3)
    arm, hand = add_arm(plant, X_WB=RigidTransform())
    plant.set_gravity_enabled(arm, False)
    plant.Finalize()
    model = ControlModel.of_arm(plant, arm, hand.body_frame())
    state = np.concatenate((POSTURES[6], np.zeros(6)))
    g = evaluate_arm(model, model.plant.CreateDefaultContext(), state).g
    np.testing.assert_array_equal(g, np.zeros(6))


# Newer Drakes have no TAMSI.
@pytest.mark.parametrize("approximation", sorted(DiscreteContactApproximation.__members__))
@pytest.mark.parametrize("damping", [0.0, 10.0])
def test_a_discrete_plant_steps_with_the_acceleration_that_the_model_asks_for(
    damping: float, approximation: str
) -> None:
    """Friction is taken at the end of a step; without Δt F the last joint would miss by a tenth."""
    plant = MultibodyPlant(1e-3)
    plant.set_discrete_contact_approximation(
        DiscreteContactApproximation.__members__[approximation]
    )
    arm, hand = add_arm(plant)
    for joint in map(plant.get_joint, plant.GetJointIndices(arm)):
        if joint.type_name() == "revolute":
            joint.set_default_damping(damping)
    _, E = add_tool(plant, hand)
    plant.Finalize()
    model = ControlModel.of_arm(plant, arm, E)
    rng = np.random.default_rng(3)
    context = plant.CreateDefaultContext()
    q, v, alpha = rng.uniform(-1, 1, 6), rng.uniform(-1, 1, 6), rng.uniform(-5, 5, 6)
    state = evaluate_arm(model, model.plant.CreateDefaultContext(), np.concatenate((q, v)))
    torque = state.B @ alpha + state.Cv + state.Fv + state.g
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)
    plant.get_actuation_input_port().FixValue(context, torque)
    # A plant with sampled output ports steps by an event.
    after = context.Clone()
    plant.ExecuteForcedEvents(after)
    moved = (plant.GetVelocities(after) - v) / plant.time_step()
    np.testing.assert_allclose(moved, alpha, atol=1e-6)
