"""The looks of the parts. Nothing here has mass or touches anything.

The shapes of arm link i are given in the frame P_i. Its origin is on joint i's axis, z is along
that axis, x along the Denavit-Hartenberg a_i. The next joint's axis passes through (a_i, 0, d_i).
Lengths in metres, angles in degrees. A casting's mesh stands on its own z axis before it is placed.
"""

from geoimp_drake.models.loft import loft
from geoimp_drake.models.robot_data import SENSOR, TOOL, TRACK
from geoimp_drake.models.urdf import Shape

__all__ = [
    "BASE",
    "CARRIAGE",
    "CASTINGS",
    "FLOOR",
    "LINKS",
    "PLINTH",
    "RAIL",
    "SENSOR_HALVES",
    "STICK_AND_DISK",
]

_ALONG_X = (0.0, 90.0, 0.0)
_ALONG_Y = (90.0, 0.0, 0.0)  # turns +z into -y, the forearm's direction in P_3

# fmt: off
CASTINGS = {
    "base_casting.obj": loft(
        [(0.00, 0.27, 0.27, 0, 0), (0.05, 0.27, 0.27, 0, 0), (0.07, 0.225, 0.225, 0, 0),
         (0.34, 0.20, 0.20, 0, 0), (0.40, 0.215, 0.215, 0, 0)], squareness=3),
    "turret.obj": loft(
        [(0.45, 0.20, 0.20, 0, 0), (0.56, 0.20, 0.19, 0.01, 0.01), (0.68, 0.175, 0.15, 0.07, 0.09),
         (0.76, 0.16, 0.095, 0.12, 0.16), (0.90, 0.148, 0.088, 0.15, 0.155)], squareness=3.5),
    "upper_arm.obj": loft(
        [(0.00, 0.055, 0.110, 0, 0), (0.15, 0.055, 0.100, 0, 0), (0.50, 0.048, 0.072, 0, 0),
         (0.65, 0.050, 0.080, 0, 0)], squareness=5),
    "elbow_block.obj": loft(
        [(-0.16, 0.085, 0.075, -0.04, 0), (-0.14, 0.105, 0.085, -0.04, 0),
         (-0.04, 0.130, 0.088, -0.035, 0), (0.03, 0.110, 0.084, -0.015, 0),
         (0.07, 0.078, 0.078, 0, 0)]),
    "forearm.obj": loft(
        [(0.12, 0.070, 0.070, 0, 0), (0.20, 0.066, 0.066, 0, 0), (0.48, 0.046, 0.050, 0, 0),
         (0.54, 0.046, 0.050, 0, 0.004), (0.60, 0.044, 0.030, 0, 0.030),
         (0.65, 0.044, 0.028, 0, 0.030)], squareness=2.6),
}

PLINTH = (
    Shape("box", (0.70, 0.70, 0.03), "steel", (0, 0, -0.185)),
    Shape("box", (0.52, 0.52, 0.14), "dark", (0, 0, -0.100)),
    Shape("box", (0.64, 0.64, 0.03), "steel", (0, 0, -0.015)),
)

BASE = (
    Shape("mesh", ("base_casting.obj",), "dark"),
    Shape("box", (0.10, 0.22, 0.14), "black", (-0.25, 0, 0.16)),  # connectors
)

LINKS = (
    (  # turret: the upper arm turns on its left side
        Shape("cylinder", (0.215, 0.05), "red", (0, 0, 0.425)),
        Shape("mesh", ("turret.obj",), "red"),
        Shape("cylinder", (0.150, 0.178), "red", (0.15, 0.154, 0.9), _ALONG_Y),
        Shape("cylinder", (0.115, 0.03), "dark", (0.15, 0.255, 0.9), _ALONG_Y),
        Shape("cylinder", (0.080, 0.12), "black", (0.15, 0.325, 0.9), _ALONG_Y),
        Shape("cylinder", (0.065, 0.26), "black", (-0.17, -0.09, 0.58)),
    ),
    (  # upper arm
        Shape("mesh", ("upper_arm.obj",), "red", rpy=_ALONG_X),
        Shape("cylinder", (0.125, 0.120), "red"),
        Shape("cylinder", (0.080, 0.136), "black"),
        Shape("cylinder", (0.095, 0.115), "red", (0.65, 0, 0)),
        Shape("cylinder", (0.060, 0.130), "black", (0.65, 0, 0)),
    ),
    (  # elbow, with the motors of the wrist behind it
        Shape("cylinder", (0.085, 0.04), "dark", (0, 0, 0.078)),
        Shape("mesh", ("elbow_block.obj",), "red", (0.1, 0, 0.147), _ALONG_Y),
        Shape("cylinder", (0.042, 0.13), "black", (0.105, 0.22, 0.147), _ALONG_Y),
        Shape("cylinder", (0.036, 0.11), "black", (0.015, 0.21, 0.108), _ALONG_Y),
        Shape("cylinder", (0.036, 0.11), "black", (0.015, 0.21, 0.186), _ALONG_Y),
    ),
    (  # forearm, ending in a one-sided fork
        Shape("cylinder", (0.076, 0.05), "dark", (0, 0, 0.095)),
        Shape("mesh", ("forearm.obj",), "red"),
        Shape("cylinder", (0.048, 0.058), "red", (0, 0.031, 0.65), _ALONG_Y),
        Shape("cylinder", (0.036, 0.012), "black", (0, 0.064, 0.65), _ALONG_Y),
    ),
    (  # wrist
        Shape("cylinder", (0.046, 0.080), "dark", (0, 0, -0.040)),
        Shape("cylinder", (0.034, 0.008), "black", (0, 0, -0.083)),
        Shape("cylinder", (0.037, 0.100), "dark", (0, -0.050, -0.037), _ALONG_Y),
    ),
    (  # flange, with a mark that shows its turning
        Shape("cylinder", (0.040, 0.010), "black", (0, 0, 0.106)),
        Shape("cylinder", (0.045, 0.018), "steel", (0, 0, 0.121)),
        Shape("box", (0.010, 0.012, 0.014), "yellow", (0.045, 0, 0.121)),
    ),
)

_BED = 2 * TRACK.travel + 0.9
_END = _BED / 2 - 0.02
RAIL = (
    Shape("box", (_BED, 0.62, 0.05), "dark", (0, 0, -0.175)),
    *(Shape("box", (_BED, 0.10, 0.09), "dark", (0, y, -0.105)) for y in (-0.22, 0.22)),
    *(Shape("box", (_BED, 0.04, 0.02), "steel", (0, y, -0.050)) for y in (-0.22, 0.22)),
    Shape("box", (_BED, 0.04, 0.05), "steel", (0, 0, -0.125)),  # rack
    *(Shape("box", (0.04, 0.56, 0.10), "yellow", (x, 0, -0.10)) for x in (-_END, _END)),
)
CARRIAGE = (
    Shape("box", (0.76, 0.64, 0.036), "yellow", (0, 0, -0.018)),
    *(Shape("box", (0.14, 0.11, 0.04), "black", (x, y, -0.055))
      for x in (-0.28, 0.28) for y in (-0.22, 0.22)),
    Shape("cylinder", (0.055, 0.18), "black", (-0.31, 0.23, 0.09)),  # drive
)
FLOOR = (
    Shape("box", (5.0, 5.0, 0.02), "floor", (0, 0, -0.010)),
)

SENSOR_HALVES = (
    (
        Shape("cylinder", (SENSOR.radius, 0.018), "black", (0, 0, 0.009)),
        Shape("box", (0.030, 0.026, 0.014), "black", (SENSOR.radius + 0.010, 0, 0.009)),
        Shape("cylinder", (0.006, 0.030), "steel", (SENSOR.radius + 0.038, 0, 0.009), _ALONG_X),
    ),
    (
        Shape("cylinder", (0.046, SENSOR.length - 0.018), "steel",
              (0, 0, 0.009 - SENSOR.length / 2)),
    ),
)

STICK_AND_DISK = (
    Shape("cylinder", (TOOL.plate_radius, TOOL.plate_thickness), "steel",
          (0, 0, TOOL.plate_thickness / 2)),
    Shape("cylinder", (TOOL.stick_radius, TOOL.stick_length), "steel",
          (0, 0, TOOL.stick_length / 2)),
    Shape("cylinder", (TOOL.disk_radius, TOOL.disk_thickness), "wood",
          (0, 0, TOOL.stick_length + TOOL.disk_thickness / 2)),
    Shape("box", (TOOL.disk_radius - 0.012, 0.006, 0.002), "black",  # shows the disk's turning
          (TOOL.disk_radius / 2 + 0.004, 0, TOOL.stick_length)),
)
# fmt: on
