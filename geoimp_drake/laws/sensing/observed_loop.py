"""What a torque that acts a tick late does to an impedance that is fed by a momentum observer.

At rest, and in the space of E, the observer of `momentum_observer` compares what the momentum has
gained in a tick with the torque that it believes in,

    r(k) = (r(k−1) + K Δt (F_acted − F_believed)) / (1 + K Δt),   h = −r,

where F is the force at E that the torques stand for. If both are the same, r decays. If one is a
tick behind the other, r follows the changes of F, and F has (1 − Λ M⁻¹) h in it: Λ, the arm's
inertia at E, from (2.3) and (2.4), M from the impedance. Of this loop alone the eigenvalue μ of
Λ M⁻¹ is stable up to

    μ < 3/2 + 1/(K Δt)   if the robot is late,   μ < 2 + 1/(K Δt)   if the observer's torque is.

Floats only, at build.
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
        """Returns by what the largest motion grows in a tick: more than one is unstable.

        Args:
            acts_late: whether the robot exerts a torque a tick after it was asked to.
            believed_late: whether the observer is given the torque of the tick before.
        """
        # Of E: x, v; of C: c, w; the residual; the forces that were asked for last and before.
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
        # Where the arm cannot move, at a singularity, nothing is asked of it.
        force = np.linalg.pinv(self.mobility, hermitian=True) @ a - r
        v = v + T * self.mobility @ (last if acts_late else force)
        eigenvalues = np.linalg.eigvals(np.vstack((x + T * v, v, c, w, r, force, last)))
        return float(np.abs(eigenvalues).max())

    def _acceleration(self, c: Array, w: Array, r: Array) -> Array:
        """Returns that of C (3.1), with h = −r."""
        return self.mass_inverse @ (r - self.damping @ w - self.stiffness @ c)
