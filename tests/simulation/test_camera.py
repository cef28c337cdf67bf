"""Where Meshcat's camera stands for models that are not the cell's."""

import numpy as np
import pytest
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import FixedOffsetFrame, SpatialInertia
from pydrake.systems.framework import DiagramBuilder

from geoimp_drake.simulation.visualization import frame_models

HALF_VIEW = np.deg2rad(37.5)  # upwards and downwards, Meshcat's own


class Camera:
    """Stands for Meshcat: keeps where its camera is put."""

    def SetCameraPose(self, camera, target):
        self.place, self.target = np.ravel(camera), np.ravel(target)


@pytest.mark.parametrize("size", [(0.1, 0.1, 0.3), (2.0, 2.0, 6.0), (5.0, 0.1, 0.1)])
def test_models_of_any_size_fill_the_view(size):
    """A box whose origin is at one of its ends, somewhere in the world."""
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
    body = plant.AddRigidBody("body", SpatialInertia.Zero())
    X_BG = RigidTransform([0.0, 0.0, size[2] / 2])
    plant.RegisterVisualGeometry(body, X_BG, Box(*size), "box", np.ones(4))
    X_WB = RigidTransform([3.0, -2.0, 1.0])
    plant.WeldFrames(plant.world_frame(), body.body_frame(), X_WB)
    X_BE = RigidTransform([0.0, 0.01, 0.0])
    E = plant.AddFrame(FixedOffsetFrame("E", body.body_frame(), X_BE))
    plant.Finalize()
    camera = Camera()
    frame_models(camera, plant, scene_graph, E)
    middle = X_WB.translation() + X_BG.translation()
    np.testing.assert_allclose(camera.target, middle, atol=1e-9)
    # The hand is at +y of the middle, the camera between that and +x.
    away = camera.place - camera.target
    assert np.arctan2(away[1], away[0]) == pytest.approx(np.pi / 4)
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
    corners = middle + signs * np.array(size) / 2
    towards = (camera.target - camera.place) / np.linalg.norm(camera.target - camera.place)
    sights = corners - camera.place
    angles = np.arccos(sights @ towards / np.linalg.norm(sights, axis=1))
    assert 0.4 * HALF_VIEW < angles.max() < 1.15 * HALF_VIEW
