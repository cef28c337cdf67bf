"""The internal impedance for two arms: gains left open, and whether it holds a stiff grasp.

- stiffness: 2000 N/m and 100 Nm/rad; a squeeze of K times the error of the grasp remains.
- mass: at least twice the largest apparent inertia of the hands against each other.
- damping: enough for a stable grasp by hands of any weight.

See `laws.cooperation.internal_loop` for mass and damping.
"""

import logging
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.start_posture import find_start_posture
from geoimp_drake.arm.state import ArmState, evaluate_arm
from geoimp_drake.controllers.config import MotionConfig
from geoimp_drake.controllers.cooperative_config import CooperativeControllerConfig
from geoimp_drake.laws.cooperation.internal_loop import (
    growth_rate,
    least_damping,
    least_mass,
    relative_inertia,
)
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.internal_impedance import InternalGains, InternalImpedanceConfig, is_open
from geoimp_drake.typing import Array
from geoimp_drake.validation import spd_matrix

__all__ = ["fill_open_gains", "hands_against_each_other", "make_internal"]

_log = logging.getLogger("drake")

# Places in [angular; linear].
_PARTS = {"rotation": slice(0, 3), "translation": slice(3, 6)}
_STIFFNESS = {"rotation": 100.0, "translation": 2000.0}  # [Nm/rad, N/m]
# The factor of the apparent inertia for which the check is made: it may grow during the task.
_ON_THE_WAY = 1.1
# A posture with a smaller singular value says nothing about the arm at work.
_SMALLEST_SINGULAR_VALUE = 1e-2


def make_internal(config: CooperativeControllerConfig, models: Sequence[ControlModel]) -> Impedance:
    """Returns the internal impedance for two arms; warns if it cannot hold a stiff grasp.

    Args:
        config: of the whole controller.
        models: the arms.

    Raises:
        ConfigurationError: a gain cannot be used, or not with the period.
        SingularityError: an arm has no regular posture.
    """
    period, motion = config.sampling.period, config.motion
    inertia = hands_against_each_other(models)
    internal = fill_open_gains(config.internal, inertia, motion, period)
    _log.info(f"Internal impedance: {_text(internal)}.")
    rate = _growth_rate(internal, _ON_THE_WAY * inertia, motion, period)
    if rate <= 0.0:
        return internal.make("internal", period)
    usual = fill_open_gains(InternalImpedanceConfig(), inertia, motion, period)
    M_o, M = (np.linalg.eigvalsh(inertia[place, place])[-1] for place in _PARTS.values())
    remedy = (
        f"A stiff grasp cannot be held at steps of {period:g} s: against each other the hands have "
        f"up to {M_o:.3g} kg m² and {M:.3g} kg, and with an internal impedance of "
        f"{_text(internal)} a disturbance grows at {rate:.3g} 1/s. Leave its mass and damping open "
        f"to have {_text(usual)}, or make the grasp softer."
    )
    _log.warning(remedy)
    return internal.make("internal", period, remedy)


def hands_against_each_other(models: Sequence[ControlModel]) -> Array:
    """Returns the apparent inertia of two hands against each other (6, 6), see `relative_inertia`.

    It is that in the models' default positions, or in the best posture that is found if these are
    singular.

    Args:
        models: the arms.
    """
    first, second = (_at_work(model) for model in models)
    return relative_inertia(first.Jv_V_WE, first.B, second.Jv_V_WE, second.B)


def _at_work(model: ControlModel) -> ArmState:
    context = model.plant.CreateDefaultContext()
    rest = np.zeros(model.num_joints)
    arm = evaluate_arm(model, context, np.append(model.plant.GetPositions(context), rest))
    if np.linalg.svd(arm.Jv_V_WE, compute_uv=False)[-1] > _SMALLEST_SINGULAR_VALUE:
        return arm
    return evaluate_arm(model, context, np.append(find_start_posture(model), rest))


def fill_open_gains(
    config: InternalImpedanceConfig, inertia: Array, motion: MotionConfig, period: float
) -> InternalImpedanceConfig:
    """Returns a configuration in which the open gains have values, rounded to three digits.

    Args:
        config: some gains are open.
        inertia: of the hands against each other (6, 6).
        motion: of both motion loops.
        period: of the readings [s].
    """
    filled: dict[str, InternalGains] = {}
    for part, place in _PARTS.items():
        gains, (K_P, K_D) = getattr(config, part), _motion_gains(motion, part)
        largest = float(np.linalg.eigvalsh(inertia[place, place])[-1])
        K = _given(gains.stiffness, _STIFFNESS[part])
        M = _given(gains.mass, least_mass(largest, _largest(K), K_D, period))
        D = _given(gains.damping, least_damping(_largest(M), _largest(K), K_P, K_D))
        filled[part] = InternalGains(M, D, K)
    return replace(config, rotation=filled["rotation"], translation=filled["translation"])


def _given(gain: Array, usual: float) -> Array:
    return np.array(float(f"{usual:.3g}")) if is_open(gain) else gain


def _largest(gain: Array) -> float:
    return float(np.linalg.eigvalsh(spd_matrix(gain, "internal"))[-1])


def _motion_gains(motion: MotionConfig, part: str) -> tuple[float, float]:
    return (motion.K_Po, motion.K_Do) if part == "rotation" else (motion.K_Pp, motion.K_Dp)


def _growth_rate(
    config: InternalImpedanceConfig, inertia: Array, motion: MotionConfig, period: float
) -> float:
    """Returns the rate at which a disturbance grows in a stiff grasp [1/s]."""
    parts = [part for part in _PARTS if config.axes in ("both", part)]
    if not parts:
        return 0.0
    size = 3 * len(parts)
    gains, loops = np.zeros((3, size, size)), np.zeros((2, size))
    for k, part in enumerate(parts):
        here = slice(3 * k, 3 * k + 3)
        gains[:, here, here] = getattr(config, part).matrices(f"internal.{part}")
        loops[:, here] = np.array(_motion_gains(motion, part))[:, None]
    places = np.r_[tuple(_PARTS[part] for part in parts)]
    return growth_rate(inertia[np.ix_(places, places)], gains, loops, period)


def _text(config: InternalImpedanceConfig) -> str:
    """Returns mass and damping of both parts in words."""
    M_o, D_o, _ = (_largest(gain) for gain in config.rotation.matrices("internal.rotation"))
    M, D, _ = (_largest(gain) for gain in config.translation.matrices("internal.translation"))
    return f"{M_o:.3g} kg m² and {M:.3g} kg, {D_o:.3g} Nms/rad and {D:.3g} Ns/m"
