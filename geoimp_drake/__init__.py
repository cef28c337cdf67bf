"""Geometrically consistent six-DOF impedance control for Drake.

The control laws of Caccavale, Natale, Siciliano and Villani, "Interaction Control", each as a
Drake `LeafSystem`. Equation numbers in this package are that chapter's.

Conventions, everywhere: spatial vectors are in Drake's order [angular; linear] (the chapter writes
[linear; angular]); quaternions are [η, ε] = [w, x, y, z]; every frame motion, wrench and gain is
expressed in the world frame W unless its name says otherwise; a wrench is exerted **by the end
effector on the environment**, about the end effector's origin. SI units throughout.
"""

from geoimp_drake.config import ImpedanceControllerConfig
from geoimp_drake.controllers import make_impedance_controller
from geoimp_drake.systems.desired_motion import DesiredMotion, MotionSegment
from geoimp_drake.systems.force_torque_sensor import ToolLoad, WristSensorConfig
from geoimp_drake.wrist_sensor import add_wrist_sensor

__version__ = "0.1.0"

__all__ = [
    "DesiredMotion",
    "ImpedanceControllerConfig",
    "MotionSegment",
    "ToolLoad",
    "WristSensorConfig",
    "__version__",
    "add_wrist_sensor",
    "make_impedance_controller",
]
