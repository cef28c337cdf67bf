"""A Franka arm that nobody here wrote, franky-sim, with a box below its hand; run as a program.

It prints `ready`, and ten times a second the force of the hand on the box along W's z axis.
"""

import sys
import time
import xml.etree.ElementTree as ET

import mujoco
import numpy as np
from franky_sim import SimulationServer
from franky_sim.mujoco_simulator import MujocoSimulator

BOX = "box_below_the_hand"


def force_on_box(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Returns the sum of the contact forces on the box, in W [N]."""
    total, wrench = np.zeros(3), np.zeros(6)
    for k in range(data.ncon):
        contact = data.contact[k]
        names = [
            mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, geom)
            for geom in (contact.geom1, contact.geom2)
        ]
        if BOX in names:
            mujoco.mj_contactForce(model, data, k, wrench)
            # The normal points from the first to the second.
            sign = 1.0 if names[1] == BOX else -1.0
            total += sign * (contact.frame.reshape(3, 3).T @ wrench[:3])
    return total


def main() -> None:
    """Serves until it is ended."""
    steps = 0
    with MujocoSimulator(enable_visualization=False) as simulator:
        robot = simulator.add_robot()
        body = ET.SubElement(simulator.worldbody, "body", name=BOX, pos="0.554 0 0.2")
        ET.SubElement(body, "geom", name=BOX, type="box", size="0.2 0.2 0.2")

        def report() -> None:
            nonlocal steps
            steps += 1
            if steps % 100 == 0:
                force = force_on_box(simulator.model, simulator.data)
                print(f"force {force[2]:.3f}", flush=True)

        simulator.register_post_step_callback(lambda *_: report())
        with SimulationServer(simulator) as server:
            server.run_async()
            print(f"ready {robot.hostname}", flush=True)
            while True:
                time.sleep(1.0)


if __name__ == "__main__":
    sys.exit(main())
