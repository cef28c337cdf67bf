"""Arms of six, seven and eight joints, the arm on the track, and the resolver by itself."""

from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, PrismaticJoint, RevoluteJoint, SpatialInertia

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.state import ArmState, evaluate_arm
from geoimp_drake.diagrams.scene.cell import END_EFFECTOR, SEVEN, add_cell
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import smallest_singular_value
from geoimp_drake.systems.arm.redundancy_resolver import RedundancyResolver

# The track arm faces along its track (+y), with the disk level before it at (0, 1.1, 0.9). Its
# elbow is 0.4 rad short of the 1.1 rad of the chapter's experiment.
FACING = np.array([0.0136, 0.1571, -0.4176, 0.702, 0.1635, 1.29, -0.0457])

AXES = {
    6: "zyyxyx",
    7: "xzyyxyx",
    8: "xzxyyxyx",
}


def generated_arm(joints: int, seed: int = 0) -> ControlModel:
    """Returns an arm with offsets everywhere; with more than six joints the first one slides."""
    axes = [np.eye(3)["xyz".index(name)] for name in AXES[joints]]
    return arm_with(axes, {0} if joints > 6 else set(), seed)


def skewed_arm(joints: int = 8) -> ControlModel:
    """Returns the same with axes in any direction, and joints in the middle that slide."""
    axes = np.random.default_rng(joints).standard_normal((joints, 3))
    return arm_with(list(axes / np.linalg.norm(axes, axis=1, keepdims=True)), {2, 5}, 0)


def arm_with(axes: list[np.ndarray], sliding: set[int], seed: int) -> ControlModel:
    rng = np.random.default_rng([len(axes), seed])
    plant = MultibodyPlant(1e-3)
    arm = plant.AddModelInstance("arm")
    frame = plant.world_frame()
    for k, axis in enumerate(axes):
        mass = 12.0 * 0.7**k + 0.5
        inertia = SpatialInertia.SolidBoxWithMass(mass, 0.1, 0.15, 0.3).Shift([0.02, -0.01, -0.1])
        body = plant.AddRigidBody(f"link{k + 1}", arm, inertia)
        X = RigidTransform(RollPitchYaw(*rng.uniform(-0.3, 0.3, 3)), rng.uniform(0.05, 0.35, 3))
        place = plant.AddFrame(FixedOffsetFrame(f"place{k + 1}", frame, X, arm))
        kind = PrismaticJoint if k in sliding else RevoluteJoint
        joint = kind(f"joint{k + 1}", place, body.body_frame(), axis, -2.0, 2.0, 0.3 * k)
        motor = plant.AddJointActuator(f"motor{k + 1}", plant.AddJoint(joint), 500.0)
        # Geared motors: 0.36 kg m² at the joint, so that K_n of some Nms/rad is not stiff.
        motor.set_default_rotor_inertia(1e-4)
        motor.set_default_gear_ratio(60.0)
        frame = body.body_frame()
    X_LE = RigidTransform(RollPitchYaw(0.2, 0.5, -0.3), [0.02, -0.05, 0.13])
    E = plant.AddFrame(FixedOffsetFrame("E", frame, X_LE, arm))
    plant.Finalize()
    return ControlModel.of_arm(plant, arm, E)


def track_arm() -> ControlModel:
    """Returns the project's seven-joint arm with sensor and tool."""
    plant = MultibodyPlant(1e-3)
    instances = add_cell(plant, "track_arm")
    plant.Finalize()
    E = plant.GetFrameByName(END_EFFECTOR, instances[f"{SEVEN}_tool"])
    return ControlModel.of_arm(plant, instances[SEVEN], E)


def random_state(model: ControlModel, rng: np.random.Generator) -> np.ndarray:
    """Returns [q; v] up to 1 rad from zero and up to 1 rad/s, away from singularities."""
    while True:
        state = rng.uniform(-1.0, 1.0, 2 * model.num_joints)
        if smallest_singular_value(arm_at(model, state).Jv_V_WE) > 0.05:
            return state


def random_states(model: ControlModel, count: int, seed: int = 0) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [random_state(model, rng) for _ in range(count)]


def arm_at(model: ControlModel, state: np.ndarray) -> ArmState:
    return evaluate_arm(model, model.plant.CreateDefaultContext(), state)


@dataclass
class Resolver:
    """A resolver fed by hand."""

    model: ControlModel
    system: RedundancyResolver

    @staticmethod
    def of(model: ControlModel, *args, **options) -> "Resolver":
        return Resolver(model, RedundancyResolver(model, *args, **options))

    def __post_init__(self):
        self.context = self.system.CreateDefaultContext()
        self._scratch = self.model.plant.CreateDefaultContext()

    def at(self, state: np.ndarray, a: np.ndarray, time: float = 0.0) -> np.ndarray:
        """Returns α."""
        arm = evaluate_arm(self.model, self._scratch, state)
        self.context.SetTime(time)
        self.system.GetInputPort("arm").FixValue(self.context, AbstractValue.Make(arm))
        self.system.GetInputPort("task_acceleration").FixValue(self.context, a)
        return self.read("joint_acceleration")

    def start_at(self, posture: np.ndarray) -> None:
        """Does what initialization does."""
        places = self.system.part.memory
        memory = places.start.copy()
        memory[places.start_posture] = posture
        self.context.SetDiscreteState(memory)

    def read(self, port: str) -> np.ndarray:
        return self.system.GetOutputPort(port).Eval(self.context).copy()


def simulate(resolver: Resolver, state: np.ndarray, a, duration: float, step: float) -> np.ndarray:
    """Integrates q̈ = α(q, q̇, t) by Runge-Kutta 4; returns t, q and v, one instant a row."""
    n = len(state) // 2

    def rate(t: float, x: np.ndarray) -> np.ndarray:
        return np.concatenate((x[n:], resolver.at(x, a(t), t)))

    rows, x = [], state.copy()
    for t in np.arange(round(duration / step) + 1) * step:
        rows.append(np.concatenate(([t], x)))
        k1 = rate(t, x)
        k2 = rate(t + step / 2, x + step / 2 * k1)
        k3 = rate(t + step / 2, x + step / 2 * k2)
        k4 = rate(t + step, x + step * k3)
        x = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return np.array(rows)
