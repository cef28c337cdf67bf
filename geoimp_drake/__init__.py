"""Geometrically consistent six-DOF impedance control for Drake.

The control laws of Caccavale, Natale, Siciliano and Villani, "Interaction Control", each as a
Drake `LeafSystem`. Equation numbers in this package are that chapter's.

Conventions, everywhere:

- Spatial vectors are in Drake's order [angular; linear]; the chapter writes [linear; angular].
- Quaternions are [η, ε] = [w, x, y, z].
- Every frame motion, wrench and gain is expressed in the world frame W unless its name says
  otherwise.
- A wrench is exerted **by the end effector on the environment**, about the end effector's origin.
- SI units throughout.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from geoimp_drake.arm.start_posture import find_start_posture
    from geoimp_drake.controllers.config import ImpedanceControllerConfig
    from geoimp_drake.controllers.cooperative_config import CooperativeControllerConfig
    from geoimp_drake.controllers.cooperative_controller import make_cooperative_controller
    from geoimp_drake.controllers.impedance_controller import make_impedance_controller
    from geoimp_drake.controllers.wrist_sensor import (
        add_wrist_sensor,
        add_wrist_sensors,
        connect_wrist_sensors,
        wrist_sensor_at,
    )
    from geoimp_drake.parts.wrist_sensor_config import ToolLoad, WristSensorConfig
    from geoimp_drake.robot_files.loading import EndEffector, load_robot
    from geoimp_drake.simulation.log_data import load_log
    from geoimp_drake.systems.arm.industrial_controller import make_industrial_controller
    from geoimp_drake.systems.sources.desired_motion import DesiredMotion, MotionSegment
    from geoimp_drake.systems.sources.smooth_target import SmoothTarget

__version__ = "0.1.0"

__all__ = [
    "CooperativeControllerConfig",
    "DesiredMotion",
    "EndEffector",
    "ImpedanceControllerConfig",
    "MotionSegment",
    "SmoothTarget",
    "ToolLoad",
    "WristSensorConfig",
    "__version__",
    "add_wrist_sensor",
    "add_wrist_sensors",
    "connect_wrist_sensors",
    "find_start_posture",
    "load_log",
    "load_robot",
    "make_cooperative_controller",
    "make_impedance_controller",
    "make_industrial_controller",
    "wrist_sensor_at",
]

# Each is imported on demand: the command line starts without Drake.
_MODULES = {
    "CooperativeControllerConfig": "controllers.cooperative_config",
    "DesiredMotion": "systems.sources.desired_motion",
    "EndEffector": "robot_files.loading",
    "ImpedanceControllerConfig": "controllers.config",
    "MotionSegment": "systems.sources.desired_motion",
    "SmoothTarget": "systems.sources.smooth_target",
    "ToolLoad": "parts.wrist_sensor_config",
    "WristSensorConfig": "parts.wrist_sensor_config",
    "add_wrist_sensor": "controllers.wrist_sensor",
    "add_wrist_sensors": "controllers.wrist_sensor",
    "connect_wrist_sensors": "controllers.wrist_sensor",
    "find_start_posture": "arm.start_posture",
    "load_log": "simulation.log_data",
    "load_robot": "robot_files.loading",
    "make_cooperative_controller": "controllers.cooperative_controller",
    "make_impedance_controller": "controllers.impedance_controller",
    "make_industrial_controller": "systems.arm.industrial_controller",
    "wrist_sensor_at": "controllers.wrist_sensor",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_MODULES[name]}"), name)


def __dir__() -> list[str]:
    return __all__
