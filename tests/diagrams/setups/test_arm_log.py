"""What the log has of an arm: which of its positions are lengths, whatever its joints are."""

import numpy as np
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import (
    PlanarJoint,
    PrismaticJoint,
    RevoluteJoint,
    SpatialInertia,
)
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from geoimp_drake.diagrams.setups.arm_log import record_arm
from geoimp_drake.simulation.recorder import Recorder


def test_lengths_are_told_from_angles():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    axis, damping = np.array([0.0, 0.0, 1.0]), np.zeros(3)
    made = {
        "arm": (
            lambda name, a, b: PlanarJoint(name, a, b, damping),
            lambda name, a, b: RevoluteJoint(name, a, b, axis),
            lambda name, a, b: PrismaticJoint(name, a, b, axis),
        ),
        # Before and after it in the plant there may be others.
        "other": (lambda name, a, b: PrismaticJoint(name, a, b, axis),),
    }
    for arm in ("other", "arm"):
        instance = plant.AddModelInstance(arm)
        parent = plant.world_frame()
        for k, joint in enumerate(made[arm]):
            body = plant.AddRigidBody(
                f"{arm}_{k}", instance, SpatialInertia.SolidSphereWithMass(1, 1)
            )
            plant.AddJoint(joint(f"{arm}_joint_{k}", parent, body.body_frame()))
            parent = body.body_frame()
    plant.Finalize()
    recorder = Recorder(builder, 0.1)
    for arm in made:
        record_arm(recorder, plant, arm, {})
    log = recorder.collect(Simulator(recorder.build()).get_context())
    np.testing.assert_array_equal(log["arm/prismatic"], [1, 1, 0, 0, 1])
    np.testing.assert_array_equal(log["other/prismatic"], [1])
    assert log["arm/q"].shape[1] == 5
