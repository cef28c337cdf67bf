"""One sample of a wrist sensor: its reading, how far it is from the range, and the wrench h.

Frames: S the sensor, T the tool beyond it, E the end effector, W the world. Floats only.
"""

from typing import Any

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.laws.dynamics.path_motion import pose_along
from geoimp_drake.laws.sensing.sensed_wrench import sensed_wrench
from geoimp_drake.laws.sensing.sensor_reading import peak_reading, sensor_reading
from geoimp_drake.typing import Array

__all__ = ["sensor_sample", "sensor_sample_along"]


@compilable
def sensor_sample(
    X_WT: Array,
    raw: Array,
    motion: Array,
    gain: float,
    resolution: Array,
    limits: Array,
    X_TS: Array,
    p_TE: Array,
    mass: float,
    p_SC_S: Array,
    I_TC_S: Array,
    gravity: Array,
    reading: Array,
    peak: Array,
    h: Array,
) -> tuple[bool, bool]:
    """Writes reading, peak and h of one sample.

    Returns whether h is written, and whether an axis has just left its range. The former is false
    if the reaction or the motion is not finite.

    Args:
        X_WT: pose of the tool in W, [R p] (3, 4).
        raw: [moment; force] by the arm on the sensor and its tool, about So, in S, with the
            sensor's errors (6,).
        motion: of a point of the tool (19,); with zero rates only the weight is removed.
        gain: of the filter; 1 takes the sample as it is.
        resolution: quantisation steps (6,), zero for none.
        limits: half-width of the range, ±limits (6,).
        X_TS: pose of the sensor in T, [R p] (3, 4).
        p_TE: E's origin in T (3,) [m].
        mass: of the tool [kg].
        p_SC_S: the tool's centre of mass C in S (3,) [m].
        I_TC_S: its rotational inertia about C, in S (3, 3) [kg m²].
        gravity: in W (3,) [m/s²].
        reading: before this sample; afterwards the new one (6,).
        peak: largest |raw|/range before this sample; afterwards with it (6,).
        h: where to write the wrench about Eo, in W (6,).
    """
    if not sensor_reading(raw, reading, resolution, limits, gain, reading):
        return False, False
    saturates = peak_reading(raw, peak.copy(), limits, peak)
    sensed = sensed_wrench(reading, X_WT, X_TS, p_TE, mass, p_SC_S, I_TC_S, gravity, motion, h)
    return sensed, saturates


@compilable
def sensor_sample_along(path: Array, q: Array, *rest: Any) -> tuple[bool, bool]:
    """Does what `sensor_sample` does, for a tool whose pose follows from the joints before it.

    Args:
        path: from the world to the tool, see `path_motion.pose_along` (n + 1, 18).
        q: joint positions of the whole plant.
        rest: the arguments of `sensor_sample` after the pose.
    """
    return sensor_sample(pose_along(path, q), *rest)
