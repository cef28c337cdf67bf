"""Whether a wrist sensor suits its controller, checked when they are made."""

import logging

import numpy as np
from pydrake.multibody.tree import Frame

from geoimp_drake.controllers.config import MotionConfig, SamplingConfig
from geoimp_drake.controllers.impedance_config import ImpedanceConfig
from geoimp_drake.controllers.scheme import SchemeConfig
from geoimp_drake.errors import ConfigurationError, ModelError
from geoimp_drake.laws.impedance.translational_impedance import turned
from geoimp_drake.laws.motion_control.orientation_control import ERROR_PER_ANGLE
from geoimp_drake.laws.prediction.sampled_loop import SampledLoop
from geoimp_drake.laws.sensing.sensed_inertia import SensedInertia
from geoimp_drake.laws.sensing.sensor_reading import filter_gain
from geoimp_drake.parts.wrist_sensor_config import WristSensor, WristSensorConfig
from geoimp_drake.typing import Array

__all__ = ["check_sensor", "linear_gains", "sampled_loop", "warn_of_sensed_inertia"]

_log = logging.getLogger("drake")

# Growth beyond one by which rounding changes modes that neither grow nor decay.
_GROWTH_TOLERANCE = 1e-6


def check_sensor(
    sensor: WristSensor,
    end_effector_frame: Frame,
    impedance: ImpedanceConfig,
    motion: MotionConfig,
    sampling: SamplingConfig,
    hands: int = 1,
    scheme: SchemeConfig | None = None,
) -> None:
    """Checks a controller's sensor, and warns where `warn_of_sensed_inertia` does.

    With natural inertia the wrench closes no loop, and only the frame is checked.

    Args:
        sensor: of a hand.
        end_effector_frame: E of this hand.
        impedance: of the controller.
        motion: of the same.
        sampling: of the same.
        hands: the number that carry what has this impedance.
        scheme: of the controller; by default with an inner loop.

    Raises:
        ModelError: the sensor was made for another frame.
        ConfigurationError: it is too slow.
    """
    measured, E = sensor.mounting.end_effector, end_effector_frame.scoped_name().get_full()
    if measured not in ("", E):
        raise ModelError(
            f"The sensor at {sensor.mounting.joint_name} gives the wrench at '{measured}', but the "
            f"end effector is '{E}'; give one from wrist_sensor_at(plant, joint, E) of this hand."
        )
    scheme = scheme or SchemeConfig()
    if scheme.is_natural:
        return
    loop = motion if scheme.uses_motion(impedance) else None
    _check_period(sensor.config.period, impedance, loop)
    direct = scheme.scheme == "direct"
    warn_of_sensed_inertia(sensor, impedance, motion, sampling, hands, is_direct=direct)


def _check_period(period: float, impedance: ImpedanceConfig, motion: MotionConfig | None) -> None:
    """Raises ConfigurationError if the sensor is slower than everything that responds to it."""
    longest = impedance.natural_period()
    said = f"the impedance moves within √(M/K) = {longest:.3g} s"
    if motion is not None:
        inner = 1.0 / min(motion.K_Dp, motion.K_Do)
        longest, said = (
            max(longest, inner),
            f"{said} and the inner loop within 1/K_D = {inner:.3g} s",
        )
    if longest < period:
        raise ConfigurationError(
            f"sensor.period is {period:g} s; {said}, which readings as rare as these do not "
            f"follow. Give at most {longest:.3g} s."
        )


def warn_of_sensed_inertia(
    sensor: WristSensor,
    impedance: ImpedanceConfig | None = None,
    motion: MotionConfig | None = None,
    sampling: SamplingConfig | None = None,
    hands: int = 1,
    *,
    is_direct: bool = False,
) -> None:
    """Warns if what a sensor leaves of its tool's inertial load makes the loop unstable.

    Args:
        sensor: of a hand.
        impedance: of the controller that gets the wrench; None takes the default gains.
        motion: of the same.
        sampling: of the same.
        hands: the number that carry what has this impedance.
        is_direct: whether it has no inner loop.
    """
    seen, load = sensor.inertia, sensor.config.inertial_load
    if seen is None or load == "plant" or sensor.tool.mass == 0:
        return
    loop = sampled_loop(
        seen,
        impedance or ImpedanceConfig(),
        motion or MotionConfig(),
        sampling or SamplingConfig(),
        sensor.config,
        hands=hands,
        is_direct=is_direct,
    )
    growth = loop.growth()
    if growth <= 1.0 + _GROWTH_TOLERANCE:
        return
    gains = "" if impedance else " at a controller's default gains"
    _log.warning(
        f"The sensor at {sensor.mounting.joint_name} carries {100 * seen.share():.1f} % of the "
        f"inertia that its arm moves there, and its inertial_load is '{load}': what the reading "
        f"keeps of the last acceleration makes the loop unstable{gains}; motions grow by "
        f"{100 * (growth - 1):.2g} % in a step of {1e3 * loop.step:g} ms. Set inertial_load to "
        f"'plant', or put the sensor where less of the last link is beyond it."
    )


def sampled_loop(
    seen: SensedInertia,
    impedance: ImpedanceConfig,
    motion: MotionConfig,
    sampling: SamplingConfig,
    sensor: WristSensorConfig,
    *,
    hands: int = 1,
    is_direct: bool = False,
) -> SampledLoop:
    """Returns the loop of hand, impedance and inner loop about the posture of `seen`, in free air.

    Args:
        seen: what the sensor carries, and the arm behind it.
        impedance: of what the hands carry.
        motion: of the inner loop.
        sampling: of the joints.
        sensor: how the wrench is read.
        hands: the number that carry what has this impedance.
        is_direct: whether it has no inner loop.
    """
    step = seen.time_step or min(sampling.period, sensor.period)
    read_every, sense_every = (
        max(1, round(period / step)) for period in (sampling.period, sensor.period)
    )
    return SampledLoop(
        seen.mobility,
        seen.tool,
        *linear_gains(impedance, motion, seen.R_WE, hands),
        step,
        sensor.inertial_load,
        is_direct,
        read_every=read_every,
        sense_every=sense_every,
        sense_late=sensor.late_samples,
        filter_gain=filter_gain(sensor.filter_cutoff, sensor.period),
    )


def linear_gains(
    impedance: ImpedanceConfig, motion: MotionConfig, R_WE: Array, hands: int = 1
) -> tuple[Array, Array, Array, Array, Array]:
    """Returns M⁻¹, D, K, K_D, K_P for small motions (6×6 each) at E in W; M⁻¹ is zero where C is D.

    Args:
        impedance: of what the hands carry.
        motion: of the inner loop.
        R_WE: orientation of the end effector (3×3).
        hands: the number that carry what has this impedance.
    """
    # D equals E when the loop begins, so gains in D's axes are in E's.
    in_axes_of_D = impedance.translation.axes == "desired"
    frames = [
        R_WE if in_desired else np.eye(3)
        for in_desired in (in_axes_of_D, in_axes_of_D, impedance.stiffness_is_in_desired())
    ]
    mass, damping, stiffness = (
        _block_diagonal(turned(rotation, R_WE), turned(translation, R_WD)) / hands
        for rotation, translation, R_WD in zip(
            impedance.gains("rotation"), impedance.gains("translation"), frames, strict=True
        )
    )
    free = [float(impedance.axes in ("both", part)) for part in ("rotation", "translation")]
    K_Po = motion.K_Po * ERROR_PER_ANGLE[motion.orientation]
    return (
        np.linalg.inv(mass) * np.repeat(free, 3)[:, None],
        damping,
        stiffness,
        np.diag(np.repeat([motion.K_Do, motion.K_Dp], 3)),
        np.diag(np.repeat([K_Po, motion.K_Pp], 3)),
    )


def _block_diagonal(rotation: Array, translation: Array) -> Array:
    none = np.zeros((3, 3))
    return np.block([[rotation, none], [none, translation]])
