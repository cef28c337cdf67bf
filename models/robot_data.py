"""The numbers of the arms, the track, the sensor and the tool; PROVENANCE.md says whose they are.

Angles in degrees as the sources print them, otherwise SI. Standard Denavit-Hartenberg: frame i is
frame i-1 moved by Rot_z(q) Trans_z(d) Trans_x(a) Rot_x(alpha). The joint coordinates of the models
are the **manufacturer's**, q_joint = q_DH + zero; on the track arm the track's travel comes first.
"""

from dataclasses import dataclass

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.typing import Array

__all__ = [
    "ARM",
    "BASE_MASS",
    "LINK_BOXES",
    "SENSOR",
    "TOOL",
    "TRACK",
    "JointData",
    "SensorData",
    "ToolData",
    "TrackData",
    "dh_to_joint",
    "joint_to_dh",
]


@dataclass(frozen=True, kw_only=True)
class JointData:
    """One revolute joint and the link that it moves.

    Attributes:
        name: the joint's name, by function.
        a, alpha, d: Denavit-Hartenberg length [m], twist [deg] and offset [m].
        zero: manufacturer's coordinate where the Denavit-Hartenberg angle is zero [deg].
        lower, upper: range in the manufacturer's coordinate [deg].
        gear_ratio: motor turns per joint turn; the sign is the sense of rotation.
        effort: peak torque at the joint [Nm].
        speed: greatest speed [deg/s].
        viscous: viscous friction at the joint [Nm s/rad].
        coulomb: Coulomb friction at the joint [Nm]; not in the model files, joints there have none.
        mass: of the link [kg].
        rotor_inertia: of the motor, before the gear [kg m²].
    """

    name: str
    a: float
    alpha: float
    d: float
    zero: float
    lower: float
    upper: float
    gear_ratio: float
    effort: float
    speed: float
    viscous: float
    coulomb: float
    mass: float
    rotor_inertia: float


# fmt: off
ARM = (
    JointData(name="waist",        a=0.150, alpha=90,  d=0.900,  zero=0,
              lower=-152.5, upper=152.5, gear_ratio=81.869,  effort=719,  speed=160, viscous=34.4,
              coulomb=26.1, mass=61.34, rotor_inertia=3.97e-4),
    JointData(name="shoulder",     a=0.650, alpha=0,   d=0,      zero=-90,
              lower=-105, upper=105, gear_ratio=207.114, effort=1424, speed=115, viscous=190.5,
              coulomb=24.2, mass=27.96, rotor_inertia=4.53e-4),
    JointData(name="elbow",        a=0.100, alpha=90,  d=0.147,  zero=90,
              lower=-155, upper=125, gear_ratio=-60.004, effort=413,  speed=200, viscous=21.0,
              coulomb=18.1, mass=20.63, rotor_inertia=3.97e-4),
    JointData(name="forearm_roll", a=0,     alpha=-90, d=0.650,  zero=0,
              lower=-420, upper=420, gear_ratio=-37.152, effort=53.5, speed=430, viscous=4.66,
              coulomb=3.7,  mass=19.70, rotor_inertia=3e-5),
    JointData(name="wrist_pitch",  a=0,     alpha=90,  d=-0.037, zero=0,
              lower=-125, upper=125, gear_ratio=37.152,  effort=38.9, speed=360, viscous=4.66,
              coulomb=9.4,  mass=2.02,  rotor_inertia=3e-5),
    JointData(name="tool_roll",    a=0,     alpha=0,   d=0.130,  zero=-90,
              lower=-2700, upper=2700, gear_ratio=-80,     effort=83.8, speed=500, viscous=4.66,
              coulomb=5.6,  mass=0.24,  rotor_inertia=3e-5),
)
# fmt: on


@dataclass(frozen=True)
class TrackData:
    """The sliding track: a prismatic joint that carries the arm. All of it is ours."""

    travel: float = 1.25  # the joint's range is ± this [m]
    effort: float = 3000.0  # peak thrust [N]
    speed: float = 1.5  # [m/s]
    viscous: float = 500.0  # [N s/m]
    mass: float = 150.0  # of the carriage with its drive [kg]
    rail_mass: float = 400.0  # fixed to the floor: it moves nothing [kg]
    gear_ratio: float = 200.0  # rack and pinion behind a gear: motor angle per travel [rad/m]
    rotor_inertia: float = 1e-3  # [kg m²]


@dataclass(frozen=True)
class SensorData:
    """The wrist sensor: a disc in two halves."""

    length: float = 0.035  # from the flange to the tool's mounting face [m]
    radius: float = 0.050  # [m]
    mount_mass: float = 0.20  # the half on the flange [kg]
    tool_side_mass: float = 0.10  # the half whose load is measured [kg]


@dataclass(frozen=True)
class ToolData:
    """The steel stick with its mounting plate and the wooden disk."""

    disk_radius: float = 0.055  # [m]
    disk_thickness: float = 0.015  # [m]
    stick_length: float = 0.200  # mounting plate included [m]
    stick_radius: float = 0.008  # [m]
    plate_radius: float = 0.030  # [m]
    plate_thickness: float = 0.008  # [m]
    steel_density: float = 7850.0  # [kg/m³]
    wood_density: float = 700.0  # [kg/m³]


# The uniform solids that stand for the links: (sides, centre) [m] of the box that spans each
# casting. They are in the frame P_i: origin on joint i's axis, z along it, x along a_i.
LINK_BOXES = (
    ((0.42, 0.36, 0.50), (0.06, 0.0, 0.70)),
    ((0.80, 0.16, 0.12), (0.325, 0.0, 0.0)),
    ((0.22, 0.30, 0.26), (0.08, 0.06, 0.12)),
    ((0.14, 0.14, 0.60), (0.0, 0.0, 0.33)),
    ((0.10, 0.14, 0.10), (0.0, -0.02, -0.02)),
    ((0.09, 0.09, 0.03), (0.0, 0.0, 0.115)),
)
BASE_MASS = 60.0  # of the arm's foot [kg]; fixed, or carried by the track
TRACK = TrackData()
SENSOR = SensorData()
TOOL = ToolData()

_ZEROS = np.radians([joint.zero for joint in ARM])


def dh_to_joint(q_dh: Array) -> Array:
    """Turns six Denavit-Hartenberg angles [rad] into the models' joint coordinates [rad]."""
    return _six(q_dh) + _ZEROS


def joint_to_dh(q_joint: Array) -> Array:
    """Turns the models' six joint coordinates [rad] into Denavit-Hartenberg angles [rad]."""
    return _six(q_joint) - _ZEROS


def _six(q: Array) -> Array:
    q = np.asarray(q)
    if q.shape != (len(ARM),):
        raise ConfigurationError(
            f"the arm has {len(ARM)} revolute joints, but an array of shape {q.shape} was given; "
            "leave the track's travel out"
        )
    return q
