"""The effect of a torque that acts a tick late on an impedance fed by a momentum observer.

At rest, the observer of `momentum_observer` compares the gain of the momentum in a tick with the
torque that it believes in. In the space of E that is

    r(k) = (r(k−1) + K Δt (F_acted − F_believed)) / (1 + K Δt),   h = −r,

where F is the force at E that the torques stand for. If both are the same, r decays. If one is a
tick behind the other, r follows the changes of F, and F contains (1 − Λ M⁻¹) h. Λ, the arm's
inertia at E, is from (2.3) and (2.4), M from the impedance. Of this loop alone the eigenvalue μ of
Λ M⁻¹ is stable up to

    μ < 3/2 + 1/(K Δt) if the robot is late,   μ < 2 + 1/(K Δt) if the observer's torque is.

Floats only, at build time.
"""

from dataclasses import dataclass

import numpy as np

from geoimp_drake.typing import Array

__all__ = ["ObservedLoop"]


@dataclass(frozen=True)
class ObservedLoop:
    """Hand, impedance, inner loop and observer for small motions in free space, 6×6 at E in W."""

    mobility: Array  # Λ⁻¹
    mass_inverse: Array  # M⁻¹, zero where C equals D
    damping: Array  # D
    stiffness: Array  # K
    K_D: Array  # of the inner loop
    K_P: Array
    step: float  # of robot, controller and observer [s]
    gain: float  # of the observer [1/s]
    is_direct: bool = False  # whether C is E, without an inner loop

    def growth(self, acts_late: bool = True, believed_late: bool = False) -> float:
        """Returns the factor by which the largest motion grows in a tick: above one is unstable.

        Args:
            acts_late: whether the robot exerts a torque one tick after the command.
            believed_late: whether the observer gets the torque of the previous tick.
        """
        # Of E: x, v; of C: c, w; the residual; the last commanded force and the one before.
        x, v, c, w, r, last, before = np.split(np.eye(42), 7)
        T, share = self.step, self.gain * self.step / (1.0 + self.gain * self.step)
        acted, believed = (before if late else last for late in (acts_late, believed_late))
        r = r + share * (acted - believed - r)
        if self.is_direct:
            free = np.diag(np.any(self.mass_inverse, axis=1).astype(float))
            c, w = free @ x, free @ v
        else:
            c, w = c + T * w, w + T * self._acceleration(c, w, r)
        a = self._acceleration(c, w, r) + self.K_D @ (w - v) + self.K_P @ (c - x)
        # In directions in which the arm cannot move, at a singularity, no force is commanded.
        force = np.linalg.pinv(self.mobility, hermitian=True) @ a - r
        v = v + T * self.mobility @ (last if acts_late else force)
        eigenvalues = np.linalg.eigvals(np.vstack((x + T * v, v, c, w, r, force, last)))
        return float(np.abs(eigenvalues).max())

    def _acceleration(self, c: Array, w: Array, r: Array) -> Array:
        """Returns the acceleration of C (3.1), with h = −r."""
        return self.mass_inverse @ (r - self.damping @ w - self.stiffness @ c)
