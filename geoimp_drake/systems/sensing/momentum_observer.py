"""External joint torques and the wrench at the end effector from q, v and τ, without a sensor."""

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.parts.momentum_observer import MomentumObserver as Observer
from geoimp_drake.parts.momentum_observer import MomentumObserverConfig
from geoimp_drake.systems.part_system import PartSystem

__all__ = ["MomentumObserver", "MomentumObserverConfig"]


class MomentumObserver(PartSystem):
    """Observes the external torques and wrench on an arm by its generalized momentum.

    At every sample each joint's residual r follows its external torque behind a low-pass. The
    wrench by the end effector on its environment follows from it by least squares,

        ṙ = K (τ_ext − r),   h = −(JJᵀ)⁻¹ J r,   p = B q̇.

    A joint's own friction, and an error of the model, count as external torques; `tare` subtracts
    their values at rest. The wrench lags behind the true one by 1/K and a sample. If `torque` is a
    tick off the torque that acted, an impedance with little mass is unstable: see
    `controllers.observer_checks.warn_of_late_torque`.

    Source: A. De Luca, R. Mattone (2003); see `geoimp_drake.laws.sensing.momentum_observer`.

    Args:
        model: the arm; without gravity if the torques do not hold its weight.
        config: gain, tare and thresholds.
        period: of the samples, those of readings and torques [s].

    Raises:
        ConfigurationError: a field of the configuration cannot be used.
        SignalError: a reading or a torque is NaN or infinite.

    Ports:
        input estimated_state: [q; v] of the arm, in its plant's order (2n)
        input torque: over the step that led to the reading, in the order of the actuators (n)
        output external_torque: from base to hand, less the tare (n) [Nm or N]
        output wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6)
        output collision: 1 while an external torque is above its threshold, else 0 (1)
    """

    def __init__(
        self,
        model: ControlModel,
        config: MomentumObserverConfig | None = None,
        period: float = 1e-3,
    ):
        super().__init__(Observer(model, config, period))
