"""Tries published robots as a user does and prints a row of a table for each.

python docs/validation/studies/published_robots.py FOLDER [ROBOT ...]

FOLDER holds the packages of `published_robots.yaml`, each unpacked into a folder of its own name:
`pip download --no-deps rtb-data==2.0.0` and `unzip rtb_data*.whl -d FOLDER/rtb-data`. Inertia and
gravity are compared with Drake's reading of the file as it is, and with pinocchio's and MuJoCo's
where these are installed. Each robot has a process of its own.
"""

import argparse
import html
import logging
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import PackageMap, Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import PrismaticJoint, RevoluteJoint

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.diagrams.experiments.catalogue import get_experiment
from geoimp_drake.diagrams.setups.own_robot import OwnRobot, propose_scenario, said_of
from geoimp_drake.diagrams.setups.single_arm import build_single_arm
from geoimp_drake.errors import GeoimpError, one_line
from geoimp_drake.robot_files.loading import load_robot
from geoimp_drake.robot_files.parsing import trial_plant
from geoimp_drake.simulation.experiment import run_experiment
from geoimp_drake.typing import Array

ROBOTS = Path(__file__).with_suffix(".yaml")
PROCESSES, LONGEST = 2, 600.0  # [s] for one robot
# What is said of a robot by kinds; the rest is Drake's on what it does not support.
KINDS = {
    "Links touch in every": "links that always touch",
    "Links touch at the start": "links touch at the start",
    "saturates": "torques beyond limits in that contact",
    "cannot be held": "start not held",
    "names the package": "package of its meshes not found",
    "which no body can have": "inertia of no body",
    "without mass there is no inertia": "inertia without mass",
}
NO_MASS = 1e-12  # [kg m² or kg]
Dynamics = tuple[Array, Array]  # M (n×n) and g (n) at a posture


def main(folder: Path, names: list[str]) -> None:
    """Prints the rows of the robots of these names, of all without any."""
    robots = yaml.safe_load(ROBOTS.read_text(encoding="utf-8"))
    chosen = [robot for robot in robots if not names or robot["name"] in names]
    if len(chosen) == 1:
        print(_row(chosen[0], folder), flush=True)
        return
    with ThreadPoolExecutor(PROCESSES) as pool:
        for row in pool.map(lambda robot: _in_a_process(folder, robot["name"]), chosen):
            print(row, flush=True)


def _in_a_process(folder: Path, name: str) -> str:
    command = [sys.executable, "-W", "ignore", __file__, str(folder), name]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST, check=False)
    except subprocess.TimeoutExpired:
        return f"| {name} | not done within {LONGEST:g} s |"
    lines = done.stdout.splitlines()
    return lines[-1] if lines else f"| {name} | {done.stderr.strip().splitlines()[-1]} |"


def _row(robot: dict[str, Any], folder: Path) -> str:
    logging.getLogger("drake").setLevel(logging.WARNING)
    cells = [robot["name"], robot["package"]]
    unpacked = folder / robot["package"].partition(" ")[0]
    file = _find(unpacked, robot["file"])
    packages = {name: unpacked / part for name, part in robot.get("packages", {}).items()}
    try:
        own = propose_scenario(file, packages=packages)
        cells += [_joints(robot, own, file), f"{own.mass:.3g}", *_run(own)]
        cells += [_compared(own, file), _kinds(own.changes), _kinds(_warned(own))]
    except GeoimpError as error:
        cells += ["", "", _without_folders(one_line(error), folder), "", "", "", ""]
    return "| " + " | ".join(cells) + " |"


def _find(package: Path, ending: str) -> Path:
    """Returns the one file below a folder whose path ends so."""
    found = [f for f in package.rglob(Path(ending).name) if str(f).endswith(f"/{ending}")]
    if len(found) != 1:
        sys.exit(f"{package} has {len(found)} files {ending}; unpack the package there.")
    return found[0]


def _joints(robot: dict[str, Any], own: OwnRobot, file: Path) -> str:
    """Returns how many joints the arm has, and those of all arms loaded together, if several."""
    if "arms" not in robot:
        return str(len(own.joints))
    plant = MultibodyPlant(time_step=1e-3)
    inertia = own.robot.inertia
    arms = load_robot(
        file, plant, end_effectors=robot["arms"], geometry="leave-out", inertia=inertia
    )
    plant.Finalize()
    counts = [plant.num_positions(arm.model_instance) for arm in arms]
    return f"{len(own.joints)} ({' + '.join(map(str, counts))})"


def _run(own: OwnRobot) -> list[str]:
    """Runs what is proposed; returns the push's error in parts of f/K, and |E-C| at most [µm]."""
    scenario = own.scenario
    with tempfile.TemporaryDirectory() as out:
        result = run_experiment(get_experiment("custom"), scenario, Path(out), figures=False)
    if result.failure is not None:
        return [one_line(result.failure), ""]
    E, C, D = (result.log[f"arm/motion_{frame}"][:, 4:7] for frame in "ECD")
    off = float(np.linalg.norm(E - C, axis=1).max())
    broken = [claim.claim for claim in result.claims if claim.holds is False]
    error = "no push"
    if scenario.external is not None:
        f, (_, _, K) = scenario.external.force, scenario.impedance.gains("translation")
        wanted = np.linalg.solve(K, f)
        error = f"{np.linalg.norm(E[-1] - D[-1] - wanted) / np.linalg.norm(wanted):.0e}"
    return ["; ".join([error, *broken]), f"{1e6 * off:.2g}"]


def _compared(own: OwnRobot, file: Path) -> str:
    """Returns by how much M and g differ from what others read, in parts of their largest entry."""
    plant, _ = trial_plant()
    loaded = replace(own.robot, geometry="leave-out").load(plant)
    plant.Finalize()
    model = ControlModel.of_arm(plant, loaded.model_instance, loaded.end_effector_frame)
    q = np.asarray(own.scenario.start.posture)
    posture = dict(zip(model.joint_names, q, strict=True))
    context = model.plant.CreateDefaultContext()
    model.plant.SetPositions(context, q)
    _take_rotors_out(model.plant, context)
    M, g = _of_plant(model.plant, context)
    found = []
    for name, read in READERS.items():
        try:
            others = read(file, posture)
        except (Exception, SystemExit):  # whatever a library says of a file that it cannot read
            found.append(f"not {name}")
            continue
        if others is not None:
            differences = [_difference(a, b) for a, b in zip((M, g), others, strict=True)]
            found.append(
                f"{name} {max(differences):.0e}" if others[0].any() else f"{name}: no mass"
            )
    return ", ".join(filter(None, found))


def _difference(ours: Array, theirs: Array) -> float:
    return float(np.abs(ours - theirs).max() / max(np.abs(theirs).max(), 1e-300))


def _of_plant(plant: MultibodyPlant, context: Any) -> Dynamics:
    return plant.CalcMassMatrix(context), -plant.CalcGravityGeneralizedForces(context)


def _take_rotors_out(plant: MultibodyPlant, context: Any) -> None:
    for k in plant.GetJointActuatorIndices():
        plant.get_joint_actuator(k).SetRotorInertia(context, 0.0)


def _drake(file: Path, posture: dict[str, float]) -> Dynamics | None:
    """Drake's reading of the file as it is, the base on the world and other joints locked."""
    plant = MultibodyPlant(time_step=1e-3)
    parser = Parser(plant)
    _add_packages(parser.package_map(), file)
    (instance,) = parser.AddModels(str(file))
    joints = [plant.get_joint(k) for k in plant.GetJointIndices(instance)]
    children = {int(joint.child_body().index()) for joint in joints}
    for b in plant.GetBodyIndices(instance):
        if int(b) not in children:
            plant.WeldFrames(plant.world_frame(), plant.get_body(b).body_frame(), RigidTransform())
    plant.Finalize()
    context = plant.CreateDefaultContext()
    _take_rotors_out(plant, context)
    for joint in joints:
        if isinstance(joint, RevoluteJoint | PrismaticJoint):
            low, high = joint.position_lower_limit(), joint.position_upper_limit()
            kept = float(np.clip(joint.default_positions()[0], low, high))
            plant.SetPositions(context, _at(plant, context, joint, posture.get(joint.name(), kept)))
    M, g = _of_plant(plant, context)
    rows = [plant.GetJointByName(name, instance).velocity_start() for name in posture]
    return M[np.ix_(rows, rows)], g[rows]


def _at(plant: MultibodyPlant, context: Any, joint: Any, value: float) -> Array:
    q = plant.GetPositions(context).copy()
    q[joint.position_start()] = value
    return q


def _add_packages(packages: PackageMap, file: Path) -> None:
    """Adds the packages that the file names by the folders above it, as ROS would know them."""
    text = file.read_text(encoding="utf-8", errors="replace")
    for name in set(re.findall(r"package://([^/\"]+)", text)):
        folder = next((f for f in file.parents for f in (f, f / name) if f.name == name), None)
        if folder is not None and folder.is_dir() and not packages.Contains(name):
            packages.Add(name, str(folder))


def _pinocchio(file: Path, posture: dict[str, float]) -> Dynamics | None:
    if file.suffix != ".urdf":
        return None
    import pinocchio

    model = pinocchio.buildModelFromUrdf(str(file))
    data, q = model.createData(), pinocchio.neutral(model)
    rows = []
    for name in model.names[1:]:
        joint = model.joints[model.getJointId(name)]
        k, low, high = joint.idx_q, model.lowerPositionLimit, model.upperPositionLimit
        value = posture.get(name, 0.0)
        if joint.nq == 1:
            q[k] = value if name in posture else np.clip(value, low[k], high[k])
        elif joint.nq == 2:  # a continuous joint on the circle
            q[k : k + 2] = np.cos(value), np.sin(value)
    rows = [model.joints[model.getJointId(name)].idx_v for name in posture]
    M = pinocchio.crba(model, data, q)
    M = np.triu(M) + np.triu(M, 1).T
    g = pinocchio.computeGeneralizedGravity(model, data, q)
    return M[np.ix_(rows, rows)], g[rows]


def _mujoco(file: Path, posture: dict[str, float]) -> Dynamics | None:
    if file.suffix != ".xml":
        return None
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    for k in range(model.njnt):
        value = posture.get(model.joint(k).name, float(data.qpos[model.jnt_qposadr[k]]))
        if model.jnt_limited[k]:
            value = float(np.clip(value, *model.jnt_range[k]))
        data.qpos[model.jnt_qposadr[k]] = value
    mujoco.mj_forward(model, data)
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    rows = [int(model.jnt_dofadr[model.joint(name).id]) for name in posture]
    M -= np.diag(model.dof_armature)
    return M[np.ix_(rows, rows)], data.qfrc_bias[rows]


READERS: dict[str, Callable[[Path, dict[str, float]], Dynamics | None]] = {
    "Drake": _drake,
    "pinocchio": _pinocchio,
    "MuJoCo": _mujoco,
}


def _warned(own: OwnRobot) -> Iterable[str]:
    """Returns the kinds of what `geoimp check` warns of, all shapes included if there are any."""
    if own.robot.geometry != "leave-out":
        own.robot.geometry = "convert"
    _, warnings = said_of(build_single_arm, own.scenario)
    said = [*own.problems, *warnings]
    return [kind for part, kind in KINDS.items() if any(part in text for text in said)]


def _kinds(changes: Iterable[str]) -> str:
    """Returns phrases with a count in the place of a list."""
    parts = (change.partition(": ") for change in changes)
    return "; ".join(f"{p} ({t.count(', ') + 1})" if t else p for p, _, t in parts)


def _without_folders(text: str, folder: Path) -> str:
    return html.escape(re.sub(rf"{re.escape(str(folder))}[^\s:]*/", "", text), quote=False)


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("robots", nargs="*")
    chosen = arguments.parse_args()
    main(chosen.folder, chosen.robots)
