"""The impedance between two hands: squeezing gives way instead of growing with an error of pose."""

from dataclasses import dataclass, field

import numpy as np

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.impedance.families import QuaternionImpedance
from geoimp_drake.systems.impedance_integrator import AXES, ImpedanceIntegrator
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, choice, key, spd_matrix

__all__ = ["InternalGains", "InternalImpedance", "InternalImpedanceConfig"]

# A damper that is integrated in steps of dt diverges at D dt/M = 2; the grasp in series with it and
# the age of the wrench take their part of that.
_LARGEST_DECAY_PER_STEP = 1.5


@dataclass
class InternalGains:
    """Gains of one part: one number for k I, three for the diagonal, or a 3×3 matrix."""

    mass: Array  # [kg or kg m²]
    damping: Array  # [Ns/m or Nms/rad]
    stiffness: Array  # [N/m or Nm/rad]

    def matrices(self, name: str) -> tuple[Array, Array, Array]:
        """Returns mass, damping and stiffness (3×3 each).

        Raises:
            ConfigurationError: one of them is not symmetric positive definite.
        """
        mass, damping, stiffness = (
            spd_matrix(getattr(self, gain), key(name, gain))
            for gain in ("mass", "damping", "stiffness")
        )
        return mass, damping, stiffness

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a gain cannot be used; `name` is put before it."""
        self.matrices(name)

    def check_period(self, name: str, period: float) -> None:
        """Raises ConfigurationError if the gains cannot be used with a sampling period [s]."""
        mass, damping, _ = self.matrices(name)
        decay = period * float(np.max(np.linalg.eigvals(np.linalg.solve(mass, damping)).real))
        if decay >= _LARGEST_DECAY_PER_STEP:
            raise ConfigurationError(
                f"{key(name, 'damping')} times the period of {period:g} s over "
                f"{key(name, 'mass')} is {decay:.3g}; it must stay below "
                f"{_LARGEST_DECAY_PER_STEP}, since at 2 the motion diverges. Lower the damping, "
                f"raise the mass or shorten the period."
            )


@dataclass
class InternalImpedanceConfig:
    """Gains of the internal impedance; translation in C's axes, rotation in the first hand's."""

    enabled: bool = True
    translation: InternalGains = field(
        default_factory=lambda: InternalGains(np.array(10.0), np.array(400.0), np.array(2000.0))
    )
    rotation: InternalGains = field(
        default_factory=lambda: InternalGains(np.array(0.3), np.array(12.0), np.array(100.0))
    )
    axes: str = "both"  # or translation, rotation: the other part of the mutual pose is constant

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        choice(self.axes, key(name, "axes"), AXES)

    def check_period(self, name: str, period: float) -> None:
        """Raises ConfigurationError if the gains cannot be used with a sampling period [s]."""
        for part in ("translation", "rotation"):
            getattr(self, part).check_period(key(name, part), period)

    def make(self, name: str = "internal", period: float = 1e-3) -> "InternalImpedance":
        """Returns the system."""
        check(self, name)
        self.check_period(name, period)
        return InternalImpedance(
            *self.translation.matrices(f"{name}.translation"),
            *self.rotation.matrices(f"{name}.rotation"),
            axes=self.axes,
        )


class InternalImpedance(ImpedanceIntegrator):
    """Moves the mutual pose that two hands are to hold, as the internal wrench asks for.

    The laws (3.1) and (3.30) once more, with the mutual pose of the grasp in the place of D, the
    one that the references follow in the place of C, and the internal wrench h_i = ½(h_2 − h_1):

        M Δp̈ + D Δṗ + K Δp = ᶜf_i,            Δp = ᶜΔp_21 − ᶜΔp_r21
        M_o Δω̇ + D_o Δω + 2EᵀK_o ε = ᶜμ_i,    {η, ε} the quaternion of ¹Q_r21⁻¹ * ¹Q_21

    Hands that squeeze push against Δp_21, so Δp_r21 grows and the squeeze gives way; K times the
    error of the grasp is left. The mutual position is that of the object's frame, ᶜΔp_r21 in C's
    axes; the mutual orientation ¹Q_r21 is that of the second hand in the first, with its angular
    velocity in the first hand's axes: the power of h_i on the mutual velocity (4.9) is the power in
    these coordinates. `CooperativeReferenceGenerator` gives half of it to each hand, with velocity
    and acceleration.

    It starts at rest on the measured mutual pose, so the references start on the hands whatever the
    grasp's pose is assumed to be.

    Frames: 1 and 2 the hands, C the compliant object; in a motion of (19) here the quaternion is
    ¹Q_21, the position ᶜΔp_21, and the rest their angular and linear velocities and accelerations.

    Args:
        M, D, K: of translation, symmetric positive definite (3×3) [kg, Ns/m, N/m].
        M_o, D_o, K_o: of rotation (3×3) [kg m², Nms/rad, Nm/rad].
        axes: `both`, `translation`, `rotation` or `none`: what is left out keeps the grasp's pose.

    Raises:
        ConfigurationError: a gain is not symmetric positive definite, or `axes` is unknown.
        SignalError: an input is NaN or infinite, a quaternion is not unit, or the motion diverged.

    Ports:
        input desired_motion: the mutual pose of the grasp, at rest (19)
        input wrench: the internal wrench [¹μ; ᵒf] (6) [Nm, N]
        input measured_motion: the measured mutual motion, read until the first step only (19)
        input stiffness_scale: factors of K and K_o, one each if not connected (2)
        output compliant_motion: the mutual motion for the references (19)
        output last_compliant_motion: the same when the last step began (19)
        output displacement: [ε; Δp], the grasp's mutual pose from that of the references (6) [-, m]
        output energy: ImpedanceEnergy: energies [J] and powers [W] of both parts (9)
    """

    def __init__(
        self,
        M: Array,
        D: Array,
        K: Array,
        M_o: Array,
        D_o: Array,
        K_o: Array,
        axes: str = "both",
    ):
        rotation = QuaternionImpedance(
            spd_matrix(M_o, "M_o"), spd_matrix(D_o, "D_o"), spd_matrix(K_o, "K_o")
        )
        super().__init__(M, D, K, rotation, axes)
