"""The press test: a disk held still against a surface measures its quasi-static stiffnesses."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ContactModel,
    DiscreteContactApproximation,
    HydroelasticContactInfo,
    MultibodyPlant,
)
from pydrake.multibody.tree import RigidBody, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder

from geoimp_drake.diagrams.scene.surface import (
    DISK_RADIUS,
    SurfaceConfig,
    add_disk_contact,
    add_surface,
)
from geoimp_drake.typing import Array

__all__ = ["PressResult", "PressRig", "Rig", "measure", "placed", "press_test"]


@dataclass
class PressResult:
    """The results of a press test, about its preload."""

    normal_stiffness: float  # [N/m]
    tilt_stiffness: Array  # [Nm/rad] about x and y of S, shape (2,)
    preload: float  # [N]
    depth: float  # [m] of the disk's centre behind the undeformed surface


class Rig(Protocol):
    """The rig with which `measure` presses."""

    def press(self, depth: float, tilt: Array | None = None) -> Array:
        """Returns the settled wrench on the surface about the disk's centre, in S (6).

        Args:
            depth: of the disk's centre along −z of S [m].
            tilt: rotation vector of the disk in S [rad], shape (3,), about the disk's centre.
        """


class PressRig:
    """A plant with one surface and a disk that is held at a given pose.

    Frames: S is the undeformed surface, z outward; D is the disk, z out of its face. If the disk is
    not tilted, D is S turned by π about x.

    Args:
        config: of the surface; the disk has the same friction.
        X_WS: pose of the undeformed surface.
        pivot: p_SM [m], the mount's centre; the origin of S unless given.
        time_step: of the plant [s].
        disk_mesh: resolution hint of the disk [m].
    """

    def __init__(
        self,
        config: SurfaceConfig,
        X_WS: RigidTransform | None = None,
        *,
        pivot: Array | None = None,
        time_step: float = 1e-3,
        disk_mesh: float = 0.05,
    ) -> None:
        self.X_WS = RigidTransform() if X_WS is None else X_WS
        builder = DiagramBuilder()
        self.plant, _ = AddMultibodyPlantSceneGraph(builder, time_step)
        self.plant.set_contact_model(ContactModel.kHydroelastic)
        self.plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
        self.surface = add_surface(self.plant, config, self.X_WS, pivot=pivot)
        self.disk = _add_disk(self.plant, config.friction, disk_mesh)
        self.plant.Finalize()
        self.simulator = Simulator(builder.Build())

    @property
    def plant_context(self) -> Context:
        """The plant's part of the simulator's context."""
        return self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())

    def place(self, depth: float, tilt: Array | None = None) -> None:
        """Resets: holds the disk `depth` [m] behind S, with the plate at rest against its face.

        The disk would strike a plate that starts at S. Friction would keep the effect of the blow:
        newtons along the surface, a twentieth of the tilt stiffness.

        Args:
            depth: of the disk's centre along −z of S.
            tilt: rotation vector of the disk in S [rad], shape (3,), about the disk's centre.
        """
        self.simulator.get_mutable_context().SetTime(0.0)
        self.simulator.get_system().SetDefaultContext(self.simulator.get_mutable_context())
        context = self.plant_context
        X_SP, X_PD = placed(depth, tilt)
        self._set_pose(context, self.disk, self.X_WS @ X_SP @ X_PD)
        if depth > 0:
            self._set_pose(context, self.surface.body, self.X_WS @ X_SP)
        self.plant.GetJointByName("disk").Lock(context)
        self.simulator.Initialize()

    def settle(self, duration: float) -> None:
        """Advances by `duration` [s]."""
        self.simulator.AdvanceTo(self.simulator.get_context().get_time() + duration)

    def wrench(self) -> Array:
        """Returns the contact's wrench on the surface about the disk's centre, in S, shape (6,)."""
        context = self.plant_context
        results = self.plant.get_contact_results_output_port().Eval(context)
        p_WD = self.plant.EvalBodyPoseInWorld(context, self.disk).translation()
        contacts = (
            self._wrench_of(results.hydroelastic_contact_info(i), p_WD)
            for i in range(results.num_hydroelastic_contacts())
        )
        return sum(contacts, start=np.zeros(6))

    def press(self, depth: float, tilt: Array | None = None, duration: float = 0.25) -> Array:
        """Returns the settled `wrench` of the disk at `depth` and `tilt`, see `place`."""
        self.place(depth, tilt)
        self.settle(duration)
        return self.wrench()

    def plate_pose(self) -> RigidTransform:
        """Returns the present X_WS of the plate."""
        return self.plant.EvalBodyPoseInWorld(self.plant_context, self.surface.body)

    def _set_pose(self, context: Context, body: RigidBody, X_WB: RigidTransform) -> None:
        self.plant.SetFloatingBaseBodyPoseInWorldFrame(context, body, X_WB)

    def _wrench_of(self, info: HydroelasticContactInfo, p_WD: Array) -> Array:
        contact = info.contact_surface()
        F_Mc_W = info.F_Ac_W()
        sign = 1.0 if contact.id_M() == self.surface.geometry else -1.0
        F_MDo_W = F_Mc_W.Shift(p_WD - contact.centroid())
        R_SW = self.X_WS.rotation().inverse()
        return sign * np.concatenate((R_SW @ F_MDo_W.rotational(), R_SW @ F_MDo_W.translational()))


def press_test(
    config: SurfaceConfig,
    X_WS: RigidTransform | None = None,
    *,
    preload: float = 30.0,
    step: float = 2e-4,
    tilt: float = np.deg2rad(0.5),
    pivot: Array | None = None,
    disk_mesh: float = 0.05,
) -> PressResult:
    """Measures a surface's stiffnesses by central differences about a preload.

    Args:
        config: of the surface.
        X_WS: pose of the undeformed surface.
        preload: normal force [N] about which it measures; the whole disk must press at `tilt`.
        step: of the depth [m].
        tilt: of the disk about its own centre [rad].
        pivot: p_SM [m] of the mount, see `add_surface`.
        disk_mesh: resolution hint of the disk [m].
    """
    rig = PressRig(config, X_WS, pivot=pivot, disk_mesh=disk_mesh)
    return measure(rig, config, preload=preload, step=step, tilt=tilt)


def measure(
    rig: Rig,
    config: SurfaceConfig,
    *,
    preload: float = 30.0,
    step: float = 2e-4,
    tilt: float = np.deg2rad(0.5),
) -> PressResult:
    """Measures with any rig, see `press_test`.

    Args:
        rig: with the surface.
        config: of the surface.
        preload: see `press_test`.
        step: see there.
        tilt: see there.
    """
    depth = _depth_of(rig, preload, guess=preload / config.mount_stiffness)
    force = [-rig.press(depth + sign * step)[5] for sign in (1, -1)]
    moments = [[rig.press(depth, s * tilt * e)[:2] for s in (1, -1)] for e in np.eye(3)[:2]]
    return PressResult(
        normal_stiffness=float(force[0] - force[1]) / (2 * step),
        tilt_stiffness=np.array([(m[0] - m[1])[i] for i, m in enumerate(moments)]) / (2 * tilt),
        preload=float(np.mean(force)),
        depth=depth,
    )


def _depth_of(rig: Rig, preload: float, guess: float) -> float:
    """Returns the depth [m] that gives `preload` [N]: the force is nearly linear in it."""
    depth = guess
    for _ in range(3):
        depth *= preload / -rig.press(depth)[5]
    return float(depth)


def placed(depth: float, tilt: Array | None = None) -> tuple[RigidTransform, RigidTransform]:
    """Returns X_SP of a plate's face against a disk, see `PressRig.place`, and X_PD of the disk."""
    X_SP = RigidTransform(_rotation(tilt), np.array([0.0, 0.0, -depth]))
    return X_SP, RigidTransform(RotationMatrix.MakeXRotation(np.pi))


def _rotation(vector: Array | None) -> RotationMatrix:
    if vector is None or not np.any(vector):
        return RotationMatrix()
    angle = float(np.linalg.norm(vector))
    return RotationMatrix(AngleAxis(angle, np.asarray(vector) / angle))


def _add_disk(plant: MultibodyPlant, friction: float, mesh: float) -> RigidBody:
    instance = plant.AddModelInstance("disk")
    inertia = SpatialInertia.SolidCylinderWithMass(
        0.2, DISK_RADIUS, 0.01, np.array([0.0, 0.0, 1.0])
    )
    disk = plant.AddRigidBody("disk", instance, inertia)
    plant.set_gravity_enabled(instance, False)
    add_disk_contact(plant, disk, RigidTransform(), friction=friction, resolution_hint=mesh)
    return disk
