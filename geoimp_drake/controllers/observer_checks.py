"""Whether a momentum observer suits its controller, checked before an arm is driven."""

import logging
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.state import evaluate_arm
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.sensor_checks import linear_gains
from geoimp_drake.laws.sensing.observed_loop import ObservedLoop
from geoimp_drake.parts.momentum_observer import MomentumObserverConfig
from geoimp_drake.typing import Array

__all__ = ["observed_loop", "warn_of_late_torque"]

_log = logging.getLogger("drake")

# Growth beyond one by which rounding changes modes that neither grow nor decay.
_GROWTH_TOLERANCE = 1e-6

# The largest factor by which a mass is made larger, or a gain smaller.
_LARGEST_FACTOR = 1e6


def warn_of_late_torque(
    model: ControlModel,
    q: Array,
    config: ImpedanceControllerConfig,
    observer: MomentumObserverConfig,
) -> None:
    """Warns if a torque that acts a tick late makes the impedance on an observer unstable.

    The check is about small motions in free space, at a posture. Natural inertia takes no wrench
    and is not checked. Nobody knows whether torques are late on a robot with a clock of its own, so
    this is a warning, never an error.

    Args:
        model: the arm.
        q: the posture, from base to hand (n) [rad, m].
        config: of the controller, which ticks with the robot.
        observer: the one that gives it the wrench.
    """
    if config.is_natural:
        return
    loop = observed_loop(model, q, config, observer)
    growth = loop.growth()
    if growth <= 1.0 + _GROWTH_TOLERANCE:
        return
    remedies = {
        "divide observer.gain by": _factor(lambda k: replace(loop, gain=loop.gain / k)),
        "multiply the masses of the impedance by": _factor(
            lambda k: replace(loop, mass_inverse=loop.mass_inverse / k)
        ),
    }
    said = ", or ".join(f"{do} {k:.3g}" for do, k in remedies.items() if k < math.inf)
    _log.warning(
        f"The impedance on a momentum observer of gain {loop.gain:g} is unstable in this posture "
        f"if the robot's torques act a tick of {1e3 * loop.step:g} ms late: motions grow "
        f"{growth:.3g}-fold in a tick. To be stable, {said or 'tick more often'}."
    )


def observed_loop(
    model: ControlModel,
    q: Array,
    config: ImpedanceControllerConfig,
    observer: MomentumObserverConfig,
) -> ObservedLoop:
    """Returns the loop of hand, impedance, inner loop and observer about a posture.

    Args:
        model: this and the others are those of `warn_of_late_torque`.
        q: see there.
        config: see there.
        observer: see there.
    """
    state = np.concatenate((q, np.zeros_like(q)))
    arm = evaluate_arm(model, model.plant.CreateDefaultContext(), state)
    J = arm.Jv_V_WE
    return ObservedLoop(
        J @ np.linalg.solve(arm.B, J.T),
        *linear_gains(config.impedance, config.motion, arm.R_WE),
        config.sampling.period,
        observer.gain,
        config.scheme == "direct",
    )


def _factor(changed: Callable[[float], ObservedLoop]) -> float:
    """Returns the least factor with which the loop is stable, rounded up; infinite if none is."""
    least, enough = 0.0, math.log(_LARGEST_FACTOR)
    if changed(_LARGEST_FACTOR).growth() > 1.0 + _GROWTH_TOLERANCE:
        return math.inf
    while enough - least > 1e-3:
        middle = 0.5 * (least + enough)
        if changed(math.exp(middle)).growth() > 1.0 + _GROWTH_TOLERANCE:
            least = middle
        else:
            enough = middle
    digit = 10.0 ** (math.floor(enough / math.log(10.0)) - 1)
    return digit * math.ceil(math.exp(enough) / digit)
