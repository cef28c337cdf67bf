"""Notices from the hands' wrenches that a grasp has opened."""

from geoimp_drake.parts.grasp_watch import GraspMonitorConfig, GraspWatch
from geoimp_drake.systems.part_system import PartSystem

__all__ = ["GraspMonitor"]


class GraspMonitor(PartSystem):
    """Reports a hand whose wrench suddenly falls to nothing: its grasp has opened.

    The size of a hand's wrench is s = max(‖f‖/f_t, ‖μ‖/μ_t). Its grasp counts as opened when s has
    fallen from `loaded` to below 1 within `fall_time` and has stayed below 1 for `dwell`. A force
    that passes steadily through zero, as when a contact takes over the weight, is never reported. A
    slow passage takes longer than `fall_time`, and a fast one is over within `dwell`. Detection
    takes the fall, `dwell` and one sample: at most `fall_time` + `dwell` + one period.

    A grasp that carries nothing cannot be distinguished from an open one: if s is below `loaded`
    when the grasp opens, nothing is reported.

    The report is latched until the simulator is initialized again, and logged by Drake's logger.

    Args:
        config: thresholds.
        period: sampling period [s].

    Raises:
        ConfigurationError: a field cannot be used.
        SignalError: a wrench is NaN or infinite.

    Ports:
        input wrench_1: h = [μ; f] by the first hand on the object, about its own origin (6)
        input wrench_2: the same by the second (6)
        output opened: 1 for a hand whose grasp has opened, else 0; and the time, −1 for none (3)
    """

    def __init__(self, config: GraspMonitorConfig | None = None, period: float = 1e-3):
        super().__init__(GraspWatch(config, period))
