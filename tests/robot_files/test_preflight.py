"""What is said of an arm before it runs: links that touch by themselves, a start that falls."""

from pathlib import Path

import numpy as np
import pytest
from pydrake.geometry import HalfSpace, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.framework import DiagramBuilder

from geoimp_drake import load_robot
from geoimp_drake.robot_files.preflight import preflight

SPHERES = (Path(__file__).parent / "cases" / "spheres.urdf").read_text()
STRAIGHT, FOLDED = [0.0] * 6, [0.0, 0.0, 0.0, 0.0, 2.8, 0.0]
# Links 4 and 6 are 100 and 60 mm from joint 5, each with a ball of 30 mm.
FOLDED_BY = 60.0 - 1e3 * np.sqrt(0.1**2 + 0.06**2 + 2 * 0.1 * 0.06 * np.cos(2.8))
FRICTION = CoulombFriction(0.5, 0.5)


@pytest.fixture
def findings(tmp_path):
    def of(description: str, q=STRAIGHT, add=lambda plant: None) -> list[str]:
        """Returns what is found of a robot at joint positions q, something else beside it."""
        file = tmp_path / "robot.urdf"
        file.write_text(description)
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
        robot = load_robot(file, plant, end_effector="l6")
        add(plant)
        plant.Finalize()
        arm = robot.model_instance
        plant.SetDefaultPositions(arm, q)
        found = preflight(plant, arm, robot.end_effector_frame, scene_graph)
        builder.Build()  # asking the scene graph has left no trace
        assert found == preflight(plant, arm, robot.end_effector_frame, scene_graph)
        return found

    return of


def test_an_arm_that_can_be_held_and_does_not_touch_itself_needs_no_word(findings):
    assert findings(SPHERES) == []


def test_links_that_touch_in_every_posture_are_named_with_what_to_do(findings):
    """Balls of 100 mm, 160 mm apart at the farthest."""
    (found,) = findings(SPHERES.replace('radius="0.03"', 'radius="0.1"'))
    assert "in every one of 50 random postures: l4 and l6 by 40 mm at the least." in found
    assert "collision_filter_group" in found
    assert "geometry 'visual' or 'leave-out'" in found


def test_links_that_touch_at_the_start_alone_are_named(findings):
    (found,) = findings(SPHERES, FOLDED)
    assert f"at the start: l4 and l6 by {FOLDED_BY:.3g} mm. Start in another posture" in found


def with_ball(x, radius):
    """Returns what welds a ball, a model of its own, to link 6 at x; 160 mm before is link 4."""

    def add(plant):
        tool = plant.AddModelInstance("tool")
        ball = plant.AddRigidBody("ball", tool, SpatialInertia.SolidSphereWithMass(0.1, 0.01))
        plant.RegisterCollisionGeometry(ball, RigidTransform(), Sphere(radius), "ball", FRICTION)
        plant.WeldFrames(plant.GetFrameByName("l6"), ball.body_frame(), RigidTransform([x, 0, 0]))

    return add


def test_what_the_arm_carries_counts_though_it_is_another_model(findings):
    (found,) = findings(SPHERES, add=with_ball(-0.2, 0.05))
    assert "at the start: ball and l4 by 40 mm" in found


def test_balls_that_meet_in_a_point_do_not_touch(findings):
    """Link 5 and what is at link 6, 60 mm apart: only rounding has them overlap."""
    assert findings(SPHERES, add=with_ball(0.0, 0.03 + 1e-12)) == []
    assert findings(SPHERES, add=with_ball(0.0, 0.03 + 1e-4)) != []


def test_contact_with_the_surroundings_is_left_to_the_user(findings):
    def add_ground(plant):
        world = plant.world_body()
        plant.RegisterCollisionGeometry(
            world, RigidTransform([0, 0, 0.5]), HalfSpace(), "ground", FRICTION
        )

    assert findings(SPHERES, add=add_ground) == []


def test_a_start_that_cannot_be_held_is_said_with_joint_torque_and_limit(findings):
    """The arm stretched out: gravity on each mass by its distance from the shoulder."""
    weak = SPHERES.replace('effort="100"', 'effort="40"')
    masses = np.array([2.6, 2.2, 1.8, 1.4, 1.0])
    places = np.array([0.0, 0.4, 0.7, 0.8, 0.86]) + 0.02
    torque = 9.81 * masses @ places
    (found,) = findings(weak)
    assert torque > 40.0
    assert f"gravity asks {torque:.4g} Nm of joint 'j2', whose effort limit is 40 Nm" in found
    assert findings(weak, [0.0, -np.pi / 2, 0.0, 0.0, 0.0, 0.0]) == []
