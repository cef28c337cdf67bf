"""A surface to feel in MuJoCo: the plate on its mount of `surface`, its layer a bed of springs.

Drake's layer presses with k_h/(πr²) times depth on the triangles of the disk's polygon, at one
point of each. So here is a sphere in the middle of each, with its share of the stiffness, and the
press test measures the same. In MuJoCo a contact of impedance d pushes with

    f = d/((1 − d) A) (a_ref − a),   a_ref = −b v − k x

where A is the sum of both bodies' inverse weights. So k and b follow from stiffness and damping.
The term in the acceleration a is a mass, which a small d makes small.
"""

from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from geoimp_drake.diagrams.scene.mujoco_model import load_mujoco
from geoimp_drake.diagrams.scene.polyhedra import regular_polygon
from geoimp_drake.diagrams.scene.press import placed
from geoimp_drake.diagrams.scene.surface_config import DISK_RADIUS, SurfaceConfig, disk_sides
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.rotations import so3
from geoimp_drake.typing import Array

__all__ = ["MujocoPressRig", "add_disk", "add_plate", "stiffen"]

PLATE, _POINT, _LAYER = "plate", "disk", "layer"

_IMPEDANCE = 0.005  # d of every contact
_SPHERE = 1e-4  # radius of the points [m]
# Friction is no spring: it stops sliding within the cone, with the rate b [1/s]. A small
# regularization makes it an implicit force.
_STICKING, _FRICTION_OVER_NORMAL = 500.0, 1e4


def add_plate(spec: Any, config: SurfaceConfig, X_WS: RigidTransform) -> None:
    """Adds the plate with its mount to an MjSpec: three slides, then three hinges, in S.

    Args:
        spec: of the world.
        config: of the surface; it is mounted at S.
        X_WS: pose of the undeformed surface.

    Raises:
        ConfigurationError: the layer is too stiff for the time step.
    """
    mj = load_mujoco()
    _check_layer(config, spec.option.timestep)
    spec.option.cone = mj.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = _FRICTION_OVER_NORMAL
    quat = X_WS.rotation().ToQuaternion().wxyz()
    plate = spec.worldbody.add_body(name=PLATE, pos=X_WS.translation(), quat=quat, gravcomp=1.0)
    half = config.size / 2
    plate.mass, plate.explicitinertial = config.plate_mass, True
    plate.ipos = [0.0, 0.0, -half[2]]
    plate.inertia = config.plate_mass / 3.0 * (half @ half - half**2)
    slide, hinge = mj.mjtJoint.mjJNT_SLIDE, mj.mjtJoint.mjJNT_HINGE
    for kind, axes, stiffness, damping in (
        (slide, np.eye(3), config.mount_stiffness, config.mount_damping),
        # Like roll, pitch and yaw of Drake's bushing: the yaw first.
        (hinge, np.eye(3)[::-1], config.mount_tilt_stiffness, config.mount_tilt_damping),
    ):
        for axis in axes:
            # The first coefficients of polynomials in displacement and speed.
            springs = {"stiffness": [stiffness, 0.0, 0.0], "damping": [damping, 0.0, 0.0]}
            plate.add_joint(type=kind, axis=axis, **springs)
    plate.add_geom(
        name=_LAYER,
        type=mj.mjtGeom.mjGEOM_BOX,
        size=half,
        pos=np.append(config.centre, -half[2]),
        contype=0,
        conaffinity=0,
    )


def add_disk(
    spec: Any, body: str, X_BD: RigidTransform, config: SurfaceConfig, resolution: float
) -> None:
    """Adds the points of a disk to a body of an MjSpec.

    Args:
        spec: of the world.
        body: its name.
        X_BD: origin at the centre of the disk's face, z out of it.
        config: of the surface that the disk will touch.
        resolution: edge length of the disk [m], see `surface.add_disk_contact`.
    """
    mj = load_mujoco()
    sides = disk_sides(resolution, "disk_resolution_hint")
    for k, point in enumerate(_points(sides)):
        spec.body(body).add_geom(
            name=f"{_POINT}{k}",
            type=mj.mjtGeom.mjGEOM_SPHERE,
            size=[_SPHERE, 0.0, 0.0],
            pos=X_BD @ (point - [0.0, 0.0, _SPHERE]),
            contype=0,
            conaffinity=0,
            mass=0.0,
        )
        spec.add_pair(
            geomname1=_LAYER,
            geomname2=f"{_POINT}{k}",
            condim=3,
            friction=[config.friction, config.friction, 0.0, 0.0, 0.0],
            solimp=[_IMPEDANCE, _IMPEDANCE, 0.001, 0.5, 2.0],
            solreffriction=[0.0, -_IMPEDANCE * _STICKING],
        )


def stiffen(model: Any, config: SurfaceConfig) -> None:
    """Gives the disk's points the layer's stiffness; inverse weights exist once it is compiled."""
    bodies = {int(model.geom_bodyid[geom[0]]) for geom in (model.pair_geom1, model.pair_geom2)}
    inverse_weight = sum(float(model.body_invweight0[body][0]) for body in bodies)
    corner = 2.0 * np.pi / model.npair
    # The polygon's area over the disk's, divided among the points.
    stiffness = config.layer_stiffness * np.sin(corner) / corner / model.npair
    k = stiffness * (1.0 - _IMPEDANCE) * inverse_weight
    model.pair_solref[:] = -k, -k * config.relaxation_time


def _points(sides: int) -> Array:
    """Returns the centres of the triangles (sides, 3) of a polygon."""
    corners = np.array(regular_polygon(sides, DISK_RADIUS, 0.0))
    return (corners + np.roll(corners, -1, axis=0)) / 3.0


def _check_layer(config: SurfaceConfig, step: float) -> None:
    """Raises ConfigurationError if the layer's springs, explicit forces, diverge at a step [s]."""
    k, m = config.layer_stiffness, config.plate_mass
    if not (load := k * step**2 + 2 * config.relaxation_time * k * step) < 4 * m:
        raise ConfigurationError(
            f"surface.properties.layer_stiffness {k:g} with relaxation_time "
            f"{config.relaxation_time:g} diverges in MuJoCo at a time step of {step:g} s: lower "
            f"them, or raise plate_mass, until k h² + 2 k τ h, now {load:.3g}, is below "
            f"{4 * m:.3g}."
        )


class MujocoPressRig:
    """The rig of `press.measure` in MuJoCo: a disk is held against a surface, where S is W.

    Args:
        config: of the surface; the disk has the same friction.
        time_step: [s].
        disk_mesh: resolution hint of the disk [m].
    """

    def __init__(self, config: SurfaceConfig, *, time_step: float = 1e-3, disk_mesh: float = 0.05):
        self._mj = mj = load_mujoco()
        spec = mj.MjSpec()
        spec.option.timestep = time_step
        spec.option.integrator = mj.mjtIntegrator.mjINT_IMPLICITFAST
        add_plate(spec, config, RigidTransform())
        spec.worldbody.add_body(name=_POINT, mocap=True)
        add_disk(spec, _POINT, RigidTransform(), config, disk_mesh)
        self._model = spec.compile()
        stiffen(self._model, config)

    def press(self, depth: float, tilt: Array | None = None, duration: float = 0.25) -> Array:
        """Returns the wrench on the surface about the disk's centre, like `PressRig.press`."""
        mj, model = self._mj, self._model
        data, (X_SP, X_PD) = mj.MjData(model), placed(depth, tilt)
        X_WD = X_SP @ X_PD
        data.mocap_pos[0] = X_WD.translation()
        data.mocap_quat[0] = X_WD.rotation().ToQuaternion().wxyz()
        # The plate begins at rest against the disk: its slides, then yaw, pitch and roll.
        data.qpos[:3] = X_SP.translation()
        data.qpos[3:] = RollPitchYaw(X_SP.rotation()).vector()[::-1]
        for _ in range(round(duration / model.opt.timestep)):
            mj.mj_step(model, data)
        return sum(
            (self._wrench_of(data, k, X_WD.translation()) for k in range(data.ncon)),
            start=np.zeros(6),
        )

    def _wrench_of(self, data: Any, k: int, p_WD: Array) -> Array:
        """Returns the wrench of a contact on the plate about a point, in W."""
        own, contact = np.zeros(6), data.contact[k]
        self._mj.mj_contactForce(self._model, data, k, own)
        # MuJoCo's normal goes from the first body to the second, on which the force acts.
        is_second = self._model.geom_bodyid[contact.geom2] == self._model.body(PLATE).id
        axes = contact.frame.reshape(3, 3) * (1.0 if is_second else -1.0)
        force = own[:3] @ axes
        return np.concatenate((own[3:] @ axes + so3.cross(contact.pos - p_WD, force), force))
