"""What a tool's inertial load in the wrench does to the sampled loop; floats only, at build.

A reading that still has the tool's inertial load tells the controller M_t a of the last step, and
(2.3) adds J^T h to the torques: in free space the hand then accelerates by Λ⁻¹ M_t a more, where Λ
is the arm's inertia at E, tool included. The eigenvalues of Λ⁻¹ M_t lie between zero and one; the
largest is the share of what moves that lies beyond the sensor. The impedance takes the same reading
for a contact and moves C by −M⁻¹ M_t a. So this step's acceleration has the last one's in it,

    a(k) = (Λ⁻¹ − M⁻¹) M_t a(k−1) + K_D Δv + K_P Δx,

and one eigenvalue λ of that factor alone is stable for −1 < λ < K_D/(K_D + K_P T), roughly.
With the load of C's motion removed, the same holds for E's motion relative to C, without M⁻¹.
In the scheme `direct` C is E as read, and M⁻¹D, M⁻¹K are in the place of K_D, K_P.
"""

from dataclasses import dataclass

import numpy as np

from geoimp_drake.typing import Array

__all__ = ["SampledLoop", "SensedInertia"]


@dataclass(frozen=True)
class SensedInertia:
    """What a sensor carries and the arm that moves it, in one posture, all at E in W."""

    mobility: Array  # Λ⁻¹ = J B⁻¹ Jᵀ (6×6)
    tool: Array  # M_t, spatial inertia beyond the sensor (6×6)
    R_WE: Array  # (3×3)
    time_step: float  # of the plant, zero if it is continuous [s]

    def share(self) -> float:
        """Returns the largest eigenvalue of Λ⁻¹ M_t: the share of the inertia beyond the sensor."""
        return float(np.linalg.eigvals(self.mobility @ self.tool).real.max())


@dataclass(frozen=True)
class SampledLoop:
    """Hand, impedance and inner loop for small motions in free space, all of 6×6 at E in W."""

    mobility: Array  # Λ⁻¹
    tool: Array  # M_t
    mass_inverse: Array  # M⁻¹, zero where C equals D
    damping: Array  # D
    stiffness: Array  # K
    K_D: Array  # of the inner loop
    K_P: Array
    step: float  # of plant and impedance [s]
    follows: bool  # whether the load of C's motion is removed
    is_direct: bool = False  # whether C is E as read, without an inner loop

    def growth(self, read_every: int = 1, sense_every: int = 1) -> float:
        """Returns by what the largest motion grows in a step: more than one is unstable.

        Args:
            read_every: steps between two readings of the joints.
            sense_every: steps between two of the sensor.
        """
        # Of E: x, v, and as they were read; of C: c, w; h as it was read.
        x, v, x_read, v_read, c, w, h = np.split(np.eye(42), 7)
        steps = int(np.lcm(read_every, sense_every))
        compliant = np.diag(np.any(self.mass_inverse, axis=1).astype(float))
        for k in range(steps):
            if self.is_direct:
                c, w = compliant @ x_read, compliant @ v_read
            a_C = -self.mass_inverse @ (self.damping @ w + self.stiffness @ c + h)
            pull = self.K_D @ (w - v_read) + self.K_P @ (c - x_read)
            a = a_C + pull + self.mobility @ h
            v = v + self.step * a
            x = x + self.step * v
            if k % sense_every == 0:
                h = self.tool @ (a - a_C if self.follows else a)
            if k % read_every == 0:
                x_read, v_read = x, (x - x_read) / (self.step * read_every)
            if not self.is_direct:
                c, w = self._next(c, w, h)
        eigenvalues = np.linalg.eigvals(np.vstack((x, v, x_read, v_read, c, w, h)))
        return float(np.abs(eigenvalues).max() ** (1.0 / steps))

    def _next(self, c: Array, w: Array, h: Array) -> tuple[Array, Array]:
        """Returns C's motion after a step; implicitly, which is stable for itself at any gains."""
        T, identity = self.step, np.eye(6)
        drag = identity + self.mass_inverse @ (T * self.damping + T * T * self.stiffness)
        w = np.linalg.solve(drag, w - T * self.mass_inverse @ (self.stiffness @ c + h))
        return c + T * w, w
