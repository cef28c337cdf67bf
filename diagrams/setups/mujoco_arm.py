"""The six-joint arm of a scenario in MuJoCo, with its surface, its wrist sensor and its pushes."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from pydrake.math import RotationMatrix
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import AddMultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.controllers.wrist_sensor import wrist_sensor_at
from geoimp_drake.diagrams.scene.cell import WRIST_SENSOR
from geoimp_drake.diagrams.scene.mujoco_model import (
    END_EFFECTOR_SITE,
    cell_spec,
    load_mujoco,
    scoped,
)
from geoimp_drake.diagrams.scene.mujoco_surface import add_disk, add_plate, stiffen
from geoimp_drake.diagrams.scene.surface import surface_plane
from geoimp_drake.diagrams.scene.surface_placement import check_clear
from geoimp_drake.diagrams.setups.posture import start_posture
from geoimp_drake.diagrams.setups.single_arm import add_single_arm
from geoimp_drake.diagrams.setups.single_arm_scenario import SingleArmScenario
from geoimp_drake.parts.counted_noise import CountedNoise
from geoimp_drake.parts.signals import AT_REST
from geoimp_drake.parts.wrist_sensor import Sensor
from geoimp_drake.parts.wrist_sensor_config import WristSensorConfig
from geoimp_drake.rotations import quaternion, so3
from geoimp_drake.systems.sources.external_wrench import WrenchRamp
from geoimp_drake.typing import Array

__all__ = ["MujocoArm", "MujocoWristSensor"]


class MujocoArm:
    """The arm of a scenario in MuJoCo, with its surface and its external wrench.

    Args:
        scenario: its start posture is filled in.

    Attributes:
        plant: Drake's, with the same arm, for its controller's model.
        end_effector: E in that plant.
        sensor_joint: the weld in that plant that the wrist sensor reads.
        name: of the arm.
        X_WE: pose of E at the start.
        model: MuJoCo's.
        data: MuJoCo's; positions and velocities are the present ones, forces and accelerations
            those of the last step.

    Raises:
        ConfigurationError: the scenario cannot be used, or MuJoCo is not installed.
    """

    def __init__(self, scenario: SingleArmScenario):
        self._mj = load_mujoco()
        self.name = scenario.arm
        self.plant, _ = AddMultibodyPlant(scenario.plant, DiagramBuilder())
        self.end_effector, self.sensor_joint = add_single_arm(self.plant, scenario)
        self._instance = self.plant.GetModelInstanceByName(scenario.arm)
        self._control = ControlModel.of_arm(self.plant, self._instance, self.end_effector)
        is_regular = scenario.limits is None
        posture, self.X_WE = start_posture(self._control, scenario.start, regular=is_regular)
        scenario.start.posture = posture.tolist()
        self.model = self._compiled(scenario)
        self.data = self._mj.MjData(self.model)
        names = [f"{scenario.arm}/{name}" for name in self._control.joint_names]
        self._q = np.array([self.model.joint(name).qposadr[0] for name in names])
        self._v = np.array([self.model.joint(name).dofadr[0] for name in names])
        self._site = self.model.site(END_EFFECTOR_SITE).id
        self._hand = self.model.body(scoped(self.end_effector.body())).id
        self._push = _push(scenario.external, self.X_WE.rotation())
        self.data.qpos[self._q] = posture
        self._mj.mj_step1(self.model, self.data)

    def _compiled(self, scenario: SingleArmScenario) -> Any:
        """Returns the model of arm and surface."""
        E, surface = self.end_effector, scenario.surface
        spec = cell_spec(self.plant, scenario.arm, E, self.sensor_joint)
        if surface is None:
            return spec.compile()
        check_clear(self.X_WE, surface_plane(surface.pose()), "start.position")
        add_plate(spec, surface.properties, surface.pose())
        hand, X_BD = scoped(E.body()), E.GetFixedPoseInBodyFrame()
        add_disk(spec, hand, X_BD, surface.properties, scenario.disk_resolution_hint)
        model = spec.compile()
        stiffen(model, surface.properties)
        return model

    @property
    def state(self) -> tuple[Array, Array]:
        """Positions and velocities of the joints, from base to hand (n)."""
        return self.data.qpos[self._q], self.data.qvel[self._v]

    def plant_state(self) -> Array:
        """Returns [q; v] of Drake's plant with the arm's present state; all else in it is zero."""
        state, nq = np.zeros(self.plant.num_multibody_states()), self.plant.num_positions()
        own = self._control.in_plant_order(self.state[0])
        self.plant.SetPositionsInArray(self._instance, own, state[:nq])
        return state

    def step(self, torque: Array) -> None:
        """Moves on by a time step under torques of the joints, from base to hand (n)."""
        mj, model, data, hand = self._mj, self.model, self.data, self._hand
        data.qfrc_applied[self._v] = torque
        h = self._push(data.time)
        # MuJoCo's wrench acts at the body's centre of mass, with the force first.
        lever = data.site_xpos[self._site] - data.xipos[hand]
        data.xfrc_applied[hand] = np.concatenate((h[3:], h[:3] + so3.cross(lever, h[3:])))
        mj.mj_step2(model, data)
        mj.mj_step1(model, data)

    def reaction(self) -> SpatialForce:
        """Returns the wrench of the arm on the tool through the sensor, about So, in S."""
        torque, force = self.data.sensordata[:3], self.data.sensordata[3:]
        return SpatialForce(tau=torque, f=force)

    def motion(self) -> Array:
        """Returns the motion of E (19); its acceleration is that of the last step."""
        mj, model, data, site = self._mj, self.model, self.data, self._site
        V, A, kind = np.empty(6), np.empty(6), mj.mjtObj.mjOBJ_SITE
        mj.mj_objectVelocity(model, data, kind, site, V, 0)
        mj.mj_objectAcceleration(model, data, kind, site, A, 0)
        if data.time > 0.0:
            A[3:] += model.opt.gravity  # MuJoCo's is an accelerometer's: it contains −g
        Q = quaternion.from_rotation(data.site_xmat[site].reshape(3, 3))
        return np.concatenate((Q, data.site_xpos[site], V, A))


def _push(ramp: WrenchRamp | None, R_WE: RotationMatrix) -> Callable[[float], Array]:
    """Returns the wrench that pushes the hand at E, [moment; force] in W (6), over time."""
    if ramp is None:
        return lambda time: np.zeros(6)
    R = R_WE.matrix() if ramp.axes == "frame" else np.eye(3)
    final, profile = np.concatenate((R @ ramp.moment, R @ ramp.force)), ramp.profile()
    return lambda time: profile(time) * final


class MujocoWristSensor:
    """The wrist sensor of an arm in MuJoCo: the part that Drake's diagram has, and its inputs.

    Args:
        arm: in MuJoCo.
        config: errors, and the source of the tool's inertial load.
    """

    def __init__(self, arm: MujocoArm, config: WristSensorConfig):
        self._arm, self._load = arm, config.inertial_load
        self.system = f"{arm.name}_{WRIST_SENSOR}"
        # The motion that gives the inertial load comes from here, whatever its frame.
        config = replace(config, inertial_load="reference")
        joint, E = arm.sensor_joint, arm.end_effector
        sensor = wrist_sensor_at(arm.plant, joint, E, config, name=self.system)
        self._part, self._joint = Sensor(sensor, ""), int(sensor.mounting.joint)
        self._memory = self._part.memory.start.copy()
        self._noise, self._count = CountedNoise(self._part.seed), 0
        self._followed = AT_REST

    @property
    def time(self) -> float:
        """The present time [s]."""
        return float(self._arm.data.time)

    def sample(self, compliant: Array) -> Array:
        """Returns h of one more sample (6); `compliant` is the motion of C that was followed."""
        self._count += 1
        motions = {"reference": compliant, "none": AT_REST}
        self._followed = self._arm.motion() if self._load == "plant" else motions[self._load]
        seen: Any = self
        self._part.sample(
            self._memory,
            seen,
            self._count,
            self._noise,
            self["reaction_forces"],
            self["state"],
            self._followed,
        )
        return self._memory[self._part.memory.h].copy()

    def true_wrench(self) -> Array:
        """Returns h without the sensor's errors (6); before the first sample it is zero."""
        h = np.zeros(6)
        seen: Any = self
        if self._count:
            self._part.write_true_wrench(seen, self._followed, h)
        return h

    def __getitem__(self, name: str) -> Any:
        """Returns an input of the part."""
        if name == "reaction_forces":
            return {self._joint: self._arm.reaction()}
        return self._arm.plant_state()

    def port(self, name: str) -> str:
        """Returns the full name of an input, for errors."""
        return f"{self.system}:{name}"
