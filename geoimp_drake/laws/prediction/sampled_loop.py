"""Hand, impedance and inner loop as sampled, in contact or free; floats only, at build time.

Let x and c be small motions of E and C about a posture at rest. The environment in contact has the
stiffness K_e and the damping D_e. A step T of the discrete plant is

    v(k+1) = v(k) + T (u − Λ⁻¹ f(k+1)),   f = K_e x + D_e v,
    u = a_C + K_D (ċ − v̂) + K_P (c − x̂) + Λ⁻¹ h,

with a_C = −M⁻¹ (D ċ + K c + h) (3.1). The readings are x̂ and v̂ of x, and h of f. Λ is the arm's
inertia at E, tool included. Drake's plants evaluate f at the end of the step, which hides ringing
on stiff walls. `acts_within` stands for a wall that acts all through the step. The eigenvalues z of
the step are poles s = ln(z)/T.

A reading that still contains the tool's inertial load gives the controller M_t a of the last step.
As (2.3) adds Jᵀh to the torques, the hand in free space accelerates by an additional Λ⁻¹ M_t a.
The impedance takes the same reading for a contact and accelerates C by −M⁻¹ M_t a. So this step's
acceleration contains that of the last step,

    a(k) = (Λ⁻¹ − M⁻¹) M_t a(k−1) + K_D Δv + K_P Δx,

and one eigenvalue λ of that factor alone is stable for −1 < λ < K_D/(K_D + K_P T), roughly.
With the load of C's motion removed, the same holds for E's motion relative to C, without M⁻¹.
In the scheme `direct` C is E as read, and M⁻¹D, M⁻¹K take the place of K_D, K_P.
"""

from dataclasses import dataclass, field

import numpy as np

from geoimp_drake.typing import Array

__all__ = ["SampledLoop"]

# Terms of the exponential's series, whose argument is at most a half.
_TERMS = 16


@dataclass(frozen=True)
class SampledLoop:
    """Hand, impedance and inner loop for small motions, all of 6×6 at E in W."""

    mobility: Array  # Λ⁻¹
    tool: Array  # M_t
    mass_inverse: Array  # M⁻¹, zero where C equals D
    damping: Array  # D
    stiffness: Array  # K
    K_D: Array  # of the inner loop
    K_P: Array
    step: float  # of plant and impedance [s]
    load: str = "none"  # whose motion removes the tool's load: plant, reference, or none
    is_direct: bool = False  # whether C is E as read, without an inner loop
    environment: Array = field(default_factory=lambda: np.zeros((6, 6)))  # K_e
    environment_damping: Array = field(default_factory=lambda: np.zeros((6, 6)))  # D_e
    acts_within: bool = False  # whether its force changes within a step
    read_every: int = 1  # steps between two readings of the joints
    sense_every: int = 1  # steps between two of the sensor
    sense_late: int = 0  # samples by which the sensor's reading is late
    filter_gain: float = 1.0  # of its low-pass

    def growth(self) -> float:
        """Returns the factor by which the largest motion grows in a step: above one is unstable."""
        return float(np.exp(self.poles().real.max() * self.step))

    def poles(self) -> Array:
        """Returns the poles, the least stable one first (complex) [1/s]."""
        matrix, steps = self.matrix()
        z = np.linalg.eigvals(matrix)
        # What a step forgets, such as a reading before the last, is no motion.
        z = z[np.abs(z) > np.finfo(float).tiny].astype(complex)
        s: Array = np.log(z) / (steps * self.step)
        return s[np.argsort(-s.real)]

    def matrix(self) -> tuple[Array, int]:
        """Returns the map of the state over a whole number of readings, and its steps."""
        # Of E: x, v, and as they were read; of C: c, w; h; the sensor's reading, and those on their
        # way.
        count = 8 + self.sense_late
        x, v, x_read, v_read, c, w, h, reading, *late = np.split(np.eye(6 * count), count)
        steps = int(np.lcm(self.read_every, self.sense_every))
        x_next, v_next = self.hand_step()
        compliant = np.diag(np.any(self.mass_inverse, axis=1).astype(float))
        for k in range(steps):
            if self.is_direct:
                c, w = compliant @ x_read, compliant @ v_read
            a_C = self._acceleration(c, w, h)
            pull = self.K_D @ (w - v_read) + self.K_P @ (c - x_read)
            moved = np.vstack((x, v, a_C + pull + self.mobility @ h))
            a = (v_next @ moved - v) / self.step
            x, v = x_next @ moved, v_next @ moved
            if k % self.sense_every == 0:
                late.append(self.environment @ x + self.environment_damping @ v + self.tool @ a)
                reading = reading + self.filter_gain * (late.pop(0) - reading)
                h = reading - self.tool @ {"plant": a, "reference": a_C, "none": 0.0 * a}[self.load]
            if k % self.read_every == 0:
                x_read, v_read = x, (x - x_read) / (self.step * self.read_every)
            if not self.is_direct:
                c, w = c + self.step * w, w + self.step * self._acceleration(c, w, h)
        return np.vstack((x, v, x_read, v_read, c, w, h, reading, *late)), steps

    def _acceleration(self, c: Array, w: Array, h: Array) -> Array:
        """Returns the acceleration of C (3.1)."""
        return -self.mass_inverse @ (self.damping @ w + self.stiffness @ c + h)

    def hand_step(self) -> tuple[Array, Array]:
        """Returns the rows of x and v after a step, in terms of x, v and u (6×18 each)."""
        T, none, identity = self.step, np.zeros((6, 6)), np.eye(6)
        pushed, dragged = self.mobility @ self.environment, self.mobility @ self.environment_damping
        if not self.acts_within:
            v = np.linalg.solve(
                identity + T * dragged + T * T * pushed,
                np.hstack((-T * pushed, identity, T * identity)),
            )
            return np.hstack((identity, none, none)) + T * v, v
        rate = np.block([[none, identity, none], [-pushed, -dragged, identity], [none] * 3])
        whole = _exponential(T * rate)
        return whole[:6], whole[6:12]


def _exponential(A: Array) -> Array:
    """Returns exp(A): the series of a fraction of A, squared as often as A was halved."""
    halvings = max(0, int(np.ceil(np.log2(np.abs(A).sum(axis=1).max()))) + 1)
    part = A / 2.0**halvings
    term = whole = np.eye(len(A))
    for k in range(1, _TERMS):
        term = term @ part / k
        whole = whole + term
    return np.linalg.matrix_power(whole, 2**halvings)
