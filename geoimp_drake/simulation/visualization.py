"""Additions to the models in Meshcat: contact patches, the frames D, C, E and the wrench."""

import itertools
from collections.abc import Mapping

import numpy as np
from pydrake.geometry import (
    Cylinder,
    Meshcat,
    MeshcatCone,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    Rgba,
    Role,
    SceneGraph,
    SceneGraphInspector,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.meshcat import ContactVisualizer, ContactVisualizerParams
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, Frame
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort

from geoimp_drake.systems.frame_motion import POSITION, frame_motion_vector, pose_of
from geoimp_drake.systems.naming import unused_name
from geoimp_drake.systems.part_system import Block
from geoimp_drake.typing import Array

__all__ = [
    "FRAME_PERIOD",
    "FrameTriads",
    "WrenchArrow",
    "add_visualization",
    "frame_models",
    "frame_period",
]

FRAME_PERIOD = 1 / 32  # [s]; at least
_AXIS_COLOURS = (Rgba(0.84, 0.15, 0.16), Rgba(0.17, 0.63, 0.17), Rgba(0.12, 0.47, 0.71))
_AXIS_ROTATIONS = (
    RotationMatrix.MakeYRotation(np.pi / 2),
    RotationMatrix.MakeXRotation(-np.pi / 2),
    RotationMatrix(),
)
_TRIAD_SIZES = {"D": (0.16, 0.0025), "C": (0.13, 0.004), "E": (0.10, 0.006), "O": (0.10, 0.006)}
_FORCE_SCALE, _MOMENT_SCALE = 0.005, 0.05  # [m/N, m/Nm]
_FORCE_COLOUR, _MOMENT_COLOUR = Rgba(0.9, 0.62, 0.0), Rgba(0.8, 0.47, 0.65)
_SMALLEST_ARROW = 1e-3  # [m]
_SIGNS = np.array(list(itertools.product((-1.0, 1.0), repeat=3))).T  # of a box's corners (3×8)
# Direction of the camera for a hand at +x, and its distance in radii: Meshcat shows ±37.5°.
_VIEW_FROM, _VIEW_DISTANCE = np.array([0.68, -0.68, 0.28]), 1.6


def add_visualization(
    builder: DiagramBuilder,
    scene_graph: SceneGraph,
    meshcat: Meshcat,
    plant: MultibodyPlant,
    frames: Mapping[str, OutputPort],
    wrench: OutputPort,
    at: str = "E",
    *,
    step: float | None = None,
) -> None:
    """Adds the models, the contact patches, a triad for each frame, arrows for force and moment.

    Args:
        builder: of the diagram, which contains `scene_graph`.
        scene_graph: has the models.
        meshcat: shows them.
        plant: the one whose contacts are drawn.
        frames: ports with frame motions, by the frames' names.
        wrench: port with [moment; force] on the environment in W.
        at: name of the frame whose origin carries the arrows.
        step: of the simulation [s], by default the plant's; see `frame_period`.
    """
    period = frame_period(plant.time_step() if step is None else step)
    parameters = MeshcatVisualizerParams(role=Role.kIllustration, publish_period=period)
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat, parameters)
    ContactVisualizer.AddToBuilder(
        builder, plant, meshcat, ContactVisualizerParams(publish_period=period)
    )
    triads = builder.AddNamedSystem(
        unused_name(builder, "frame_triads"), FrameTriads(meshcat, tuple(frames), period)
    )
    for name, port in frames.items():
        builder.Connect(port, triads.GetInputPort(name))
    arrow = builder.AddNamedSystem(
        unused_name(builder, "wrench_arrow"), WrenchArrow(meshcat, period)
    )
    builder.Connect(frames[at], arrow.GetInputPort("motion_E"))
    builder.Connect(wrench, arrow.GetInputPort("wrench"))


def frame_period(step: float) -> float:
    """Returns the time between frames [s], at least 1/32 s: 2ⁿ steps.

    The simulation stops for each frame. A frame changes nothing if the simulation stops at that
    time anyway, to the bit. That holds here, since 2ⁿ · step times k is 2ⁿ k times the step without
    rounding.

    Args:
        step: between times at which the simulation stops anyway [s]; 0 if there are none.
    """
    period = step or FRAME_PERIOD
    while period < FRAME_PERIOD:
        period *= 2.0
    return period


def frame_models(
    meshcat: Meshcat, plant: MultibodyPlant, scene_graph: SceneGraph, E: Frame
) -> None:
    """Places Meshcat's camera beside the hand, so that all bodies except the world fill the view.

    Args:
        meshcat: the one whose camera is placed.
        plant: finalized, seen at its default positions.
        scene_graph: has the bodies' shapes.
        E: frame of the hand, which is turned towards the camera by 45°.
    """
    context = plant.CreateDefaultContext()
    corners = _corners(plant, context, scene_graph.model_inspector())
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    reach = E.CalcPoseInWorld(context).translation() - middle
    R_WR = RotationMatrix.MakeZRotation(np.arctan2(reach[1], reach[0]))
    away: Array = R_WR @ (_VIEW_DISTANCE * max(radius, 0.1) * _VIEW_FROM)
    meshcat.SetCameraPose(middle + away, middle)


def _corners(plant: MultibodyPlant, context: Context, inspector: SceneGraphInspector) -> Array:
    """Returns the origins of all bodies in W, and the corners of boxes around their shapes."""
    corners = []
    for body in (plant.get_body(BodyIndex(k)) for k in range(1, plant.num_bodies())):
        X_WB = plant.EvalBodyPoseInWorld(context, body)
        corners.append(X_WB.translation()[np.newaxis])
        for shape in plant.GetVisualGeometriesForBody(body):
            if (box := inspector.GetObbInGeometryFrame(shape)) is not None:
                p_OCs = box.half_width()[:, np.newaxis] * _SIGNS
                X_WO = X_WB @ inspector.GetPoseInFrame(shape) @ box.pose()
                corners.append((X_WO @ p_OCs).T)
    return np.concatenate(corners)


class FrameTriads(Block):
    """Draws frames as triads, x red, y green, z blue; D is the thinnest, E the thickest.

    Ports:
        input NAME: motion of the frame of that name in W (19), one port a frame
    """

    def __init__(self, meshcat: Meshcat, names: tuple[str, ...], period: float = FRAME_PERIOD):
        super().__init__()
        self._meshcat = meshcat
        self._names = names
        for name in names:
            self.DeclareVectorInputPort(name, frame_motion_vector())
            _draw_triad(meshcat, f"frames/{name}", *_TRIAD_SIZES.get(name, _TRIAD_SIZES["E"]))
        self.DeclarePeriodicPublishEvent(period, 0.0, self._draw)
        self.DeclareForcedPublishEvent(self._draw)

    def _draw(self, context: Context) -> None:
        for name in self._names:
            X_WF = pose_of(self.GetInputPort(name).Eval(context))
            self._meshcat.SetTransform(f"frames/{name}", X_WF, context.get_time())


class WrenchArrow(Block):
    """Draws force and moment on the environment as arrows at E: 5 mm for 1 N, 50 mm for 1 Nm.

    Ports:
        input motion_E: of E in W (19)
        input wrench: [moment; force] on the environment in W (6)
    """

    def __init__(self, meshcat: Meshcat, period: float = FRAME_PERIOD):
        super().__init__()
        self._meshcat = meshcat
        self._motion = self.DeclareVectorInputPort("motion_E", frame_motion_vector())
        self._wrench = self.DeclareVectorInputPort("wrench", 6)
        for path, colour in (("wrench", _FORCE_COLOUR), ("moment", _MOMENT_COLOUR)):
            meshcat.SetObject(f"{path}/shaft", Cylinder(0.006, 1.0), colour)
            meshcat.SetObject(f"{path}/tip", MeshcatCone(0.03, 0.014, 0.014), colour)
        self.DeclarePeriodicPublishEvent(period, 0.0, self._draw)
        self.DeclareForcedPublishEvent(self._draw)

    def _draw(self, context: Context) -> None:
        p_WE = self._motion.Eval(context)[POSITION]
        wrench = self._wrench.Eval(context)
        self._draw_arrow("wrench", p_WE, _FORCE_SCALE * wrench[3:], context.get_time())
        self._draw_arrow("moment", p_WE, _MOMENT_SCALE * wrench[:3], context.get_time())

    def _draw_arrow(self, path: str, p_WE: Array, arrow: Array, time: float) -> None:
        """Draws a vector [m] from E; hides a short one."""
        length = float(np.linalg.norm(arrow))
        visible = length > _SMALLEST_ARROW
        self._meshcat.SetProperty(path, "visible", visible, time)
        if not visible:
            return
        R_WA = RotationMatrix.MakeFromOneVector(arrow, 2)
        direction = R_WA.col(2)
        middle = RigidTransform(R_WA, p_WE + 0.5 * length * direction)
        # A Meshcat cone has its tip at the origin and opens along +z.
        tip = RigidTransform(
            R_WA @ RotationMatrix.MakeXRotation(np.pi), p_WE + (length + 0.03) * direction
        )
        self._meshcat.SetTransform(f"{path}/shaft", middle, time)
        self._meshcat.SetProperty(f"{path}/shaft", "scale", [1.0, 1.0, length], time)
        self._meshcat.SetTransform(f"{path}/tip", tip, time)


def _draw_triad(meshcat: Meshcat, path: str, length: float, radius: float) -> None:
    for axis, colour, R_FA in zip("xyz", _AXIS_COLOURS, _AXIS_ROTATIONS, strict=True):
        offset: Array = R_FA.col(2) * (length / 2)
        meshcat.SetObject(f"{path}/{axis}", Cylinder(radius, length), colour)
        meshcat.SetTransform(f"{path}/{axis}", RigidTransform(R_FA, offset))
