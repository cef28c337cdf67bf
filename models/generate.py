"""Writes the model files from the tables: `python -m geoimp_drake.models.generate`.

The joint frame of joint i has its z axis on the Denavit-Hartenberg axis z_{i-1}. At the
manufacturer's zero it coincides with the Denavit-Hartenberg frame i-1. Link i and its joint share
that frame. The link's contents are described in P_i, which is the link's frame turned about z so
that x lies along a_i.
"""

from collections.abc import Sequence
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from pydrake.multibody.tree import SpatialInertia

from geoimp_drake.models import looks, urdf
from geoimp_drake.models.robot_data import (
    ARM,
    BASE_MASS,
    LINK_BOXES,
    SENSOR,
    TOOL,
    TRACK,
    JointData,
)

__all__ = ["model_files", "write"]

_Triple = tuple[float, float, float]

_UP = (0.0, 0.0, 1.0)


def model_files() -> dict[str, str]:
    """Returns the text of every generated file, by its name."""
    return {
        "six_joint_arm.urdf": urdf.to_text("six_joint_arm", _fixed_base() + _arm("base")),
        "seven_joint_arm.urdf": urdf.to_text("seven_joint_arm", _track() + _arm("carriage")),
        "wrist_sensor.urdf": urdf.to_text("wrist_sensor", _sensor()),
        "stick_and_disk.urdf": urdf.to_text("stick_and_disk", _tool()),
        "floor.urdf": urdf.to_text("floor", _floor()),
        **looks.CASTINGS,
    }


def write(folder: Path) -> None:
    """Writes every generated file into `folder`."""
    for name, content in model_files().items():
        (folder / name).write_text(content, encoding="utf-8")


def _floor() -> list[Element]:
    return [urdf.link("floor", _box(100.0, (5.0, 5.0, 0.02), (0, 0, -0.01)), looks.FLOOR)]


def _fixed_base() -> list[Element]:
    return [urdf.link("base", _foot(), looks.PLINTH + looks.BASE)]


def _foot() -> SpatialInertia:
    return _box(BASE_MASS, (0.44, 0.44, 0.40), (0, 0, 0.20))


def _track() -> list[Element]:
    """Makes the rail and the carriage; at travel zero the arm's base is the rail's frame."""
    carriage = _box(TRACK.mass, (0.76, 0.64, 0.10), (0, 0, -0.03))
    carriage += _foot()
    track = urdf.joint("track", "rail", "carriage", kind="prismatic", axis=(1, 0, 0))
    drive = urdf.motor(
        track,
        limits=(-TRACK.travel, TRACK.travel),
        effort=TRACK.effort,
        speed=TRACK.speed,
        viscous=TRACK.viscous,
        rotor_inertia=TRACK.rotor_inertia,
        gear_ratio=TRACK.gear_ratio,
    )
    return [
        urdf.link("rail", _box(TRACK.rail_mass, (3.4, 0.5, 0.12), (0, 0, -0.12)), looks.RAIL),
        urdf.link("carriage", carriage, looks.CARRIAGE + looks.BASE),
        track,
        drive,
        urdf.frame("base", "carriage"),
    ]


def _arm(parent: str) -> list[Element]:
    """Makes the six revolute joints on the link `parent`, and the frame `flange`."""
    elements = []
    xyz = rpy = (0.0, 0.0, 0.0)
    for number, data in enumerate(ARM, start=1):
        child = f"link{number}"
        elements += [_link(number, data), *_revolute(data, parent, child, xyz, rpy)]
        parent, (xyz, rpy) = child, _distal_frame(data)
    return [*elements, urdf.frame("flange", parent, xyz, rpy)]


def _link(number: int, data: JointData) -> Element:
    size, centre = LINK_BOXES[number - 1]
    inertia = _box(data.mass, size, centre)
    return urdf.link(f"link{number}", inertia, looks.LINKS[number - 1], yaw=-data.zero)


def _revolute(
    data: JointData, parent: str, child: str, xyz: Sequence[float], rpy: Sequence[float]
) -> tuple[Element, Element]:
    joint = urdf.joint(data.name, parent, child, xyz=xyz, rpy=rpy)
    drive = urdf.motor(
        joint,
        limits=(np.radians(data.lower), np.radians(data.upper)),
        effort=data.effort,
        speed=np.radians(data.speed),
        viscous=data.viscous,
        rotor_inertia=data.rotor_inertia,
        gear_ratio=data.gear_ratio,
    )
    return joint, drive


def _distal_frame(data: JointData) -> tuple[_Triple, _Triple]:
    """Places frame i in link i: Rot_z(-zero) Trans_z(d) Trans_x(a) Rot_x(alpha), as xyz and rpy."""
    yaw = -np.radians(data.zero)
    return (data.a * np.cos(yaw), data.a * np.sin(yaw), data.d), (np.radians(data.alpha), 0.0, yaw)


def _sensor() -> list[Element]:
    """Makes the two halves; the weld between them measures the wrench."""
    half = SENSOR.length / 2
    masses = (SENSOR.mount_mass, SENSOR.tool_side_mass)
    inertias = [SpatialInertia.SolidCylinderWithMass(m, SENSOR.radius, half, _UP) for m in masses]
    mount = urdf.inertia_of([(inertias[0], (0, 0, half / 2))])
    tool_side = urdf.inertia_of([(inertias[1], (0, 0, -half / 2))])
    return [
        urdf.link("mount", mount, looks.SENSOR_HALVES[0]),
        urdf.link("tool_side", tool_side, looks.SENSOR_HALVES[1]),
        urdf.joint("wrist_sensor", "mount", "tool_side", kind="fixed", xyz=(0, 0, SENSOR.length)),
    ]


def _tool() -> list[Element]:
    """Makes the stick and the disk; the surface that it presses on gives the disk its contact."""
    plate = (TOOL.steel_density, TOOL.plate_radius, 0.0, TOOL.plate_thickness)
    stick = (TOOL.steel_density, TOOL.stick_radius, TOOL.plate_thickness, TOOL.stick_length)
    tip = TOOL.stick_length + TOOL.disk_thickness
    disk = (TOOL.wood_density, TOOL.disk_radius, TOOL.stick_length, tip)
    inertia = urdf.inertia_of([_cylinder(*solid) for solid in (plate, stick, disk)])
    return [
        urdf.link("tool", inertia, looks.STICK_AND_DISK),
        urdf.frame("disk", "tool", xyz=(0, 0, tip)),
    ]


def _box(mass: float, size: Sequence[float], centre: Sequence[float] = (0, 0, 0)) -> SpatialInertia:
    return urdf.inertia_of([(SpatialInertia.SolidBoxWithMass(mass, *size), centre)])


def _cylinder(
    density: float, radius: float, bottom: float, top: float
) -> tuple[SpatialInertia, _Triple]:
    """Returns a cylinder along z from `bottom` to `top`: its central inertia and its centre."""
    inertia = SpatialInertia.SolidCylinderWithDensity(density, radius, top - bottom, _UP)
    return inertia, (0.0, 0.0, (bottom + top) / 2)


if __name__ == "__main__":
    write(Path(__file__).resolve().parent)
