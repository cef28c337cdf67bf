"""Stiffness and damping that change without giving out more energy than was stored."""

from collections.abc import Callable

import numpy as np

from geoimp_drake.laws.frame_motion import FRAME_MOTION_SIZE, POSE_SIZE
from geoimp_drake.laws.passivity.energy_tank import least_dissipated
from geoimp_drake.parts.energy_tank import EnergyTank, TankConfig
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.impedance_energy import stored_energy
from geoimp_drake.parts.part import Memory, Now, Output, held, nested
from geoimp_drake.parts.signals import AT_REST
from geoimp_drake.typing import Array

__all__ = ["PassiveGains"]

_POSE = slice(0, POSE_SIZE)
_NO_WRENCH, _UNSCALED = np.zeros(6), np.ones(2)


class PassiveGains:
    """The part of `systems.passive_gains.PassiveGains`; arguments and errors are the same.

    Attributes:
        changing: the inputs that request gains, with their sizes.
        level: place of the tank's energy in the memory.
    """

    float_only = "changes the gains step by step"

    def __init__(self, springs: Impedance, config: TankConfig | None = None):
        config = config or TankConfig()
        config.validate("tank")
        self._springs, self._tank = springs, EnergyTank(config)
        names = "stiffness_scale", "stiffness", "damping"
        self.changing = {name: springs.inputs[name] for name in names}
        self.inputs = {
            "desired_motion": FRAME_MOTION_SIZE,
            "compliant_motion": FRAME_MOTION_SIZE,
            **self.changing,
        }
        self.memory = Memory(
            stiffness=np.zeros(36),
            damping=np.zeros(36),
            is_set=0.0,
            # The poses of D and C when the last step began; the time is negative before the first.
            desired=AT_REST[_POSE],
            compliant=AT_REST[_POSE],
            time=-1.0,
            tank=self._tank.memory,
        )
        self.level = nested(self.memory.tank, slice(0, 1))
        of = ("memory", *names)
        self.outputs = (
            Output("stiffness", 36, self._written("stiffness"), of),
            Output("damping", 36, self._written("damping"), of),
            held("tank", self.level),
        )

    def start(self, memory: Array, now: Now) -> None:
        """Takes the requested gains as they are: what they store counts as stored before."""
        memory[self.memory.stiffness], memory[self.memory.damping] = self._wanted(now)
        memory[self.memory.is_set] = 1.0

    def begin(self, memory: Array, state: Array, now: Now) -> None:
        """Changes the gains as far as the tank allows, for the step that begins."""
        self.keep(memory, now, now["compliant_motion"])

    def keep(self, memory: Array, now: Now, C: Array) -> None:
        """Does what `begin` does.

        Args:
            memory: of this part, updated.
            now: the inputs and the time.
            C: motion of C (19,).
        """
        tank, K = memory[self.memory.tank], memory[self.memory.stiffness]
        gained = self._gained(memory, now, C)
        # No damping gives out energy, so it changes at once.
        wanted, memory[self.memory.damping] = self._wanted(now)
        if np.array_equal(wanted, K):
            self._tank.share(tank, 0.0, gained)
            return
        injected = self._stored(now, C, wanted) - self._stored(now, C, K)
        share = self._tank.share(tank, injected, gained)
        K[:] = wanted if share == 1.0 else K + share * (wanted - K)

    def granted(self, memory: Array, now: Now) -> dict[str, Array]:
        """Returns the granted gains in place of the inputs that request them.

        Args:
            memory: of this part.
            now: the inputs, whose gains are granted as requested before the start.
        """
        K, D = memory[self.memory.stiffness], memory[self.memory.damping]
        if not memory[self.memory.is_set]:
            K, D = self._wanted(now)
        return {"stiffness": K, "damping": D, "stiffness_scale": _UNSCALED}

    def _wanted(self, now: Now) -> tuple[Array, Array]:
        return self._springs.changing_gains.matrices(now)

    def _gained(self, memory: Array, now: Now, C: Array) -> float:
        """Returns the least that damping has dissipated in the step that ends [J]."""
        places, D = self.memory, now["desired_motion"]
        before = memory[places.desired].copy(), memory[places.compliant].copy()
        began = memory[places.time]
        memory[places.desired], memory[places.compliant] = D[_POSE], C[_POSE]
        memory[places.time] = now.time
        if began < 0.0 or now.time <= began:
            return 0.0
        z = self._springs.moved(before, (D, C))
        return least_dissipated(z, memory[places.damping].reshape(6, 6), now.time - began)

    def _stored(self, now: Now, C: Array, K: Array) -> float:
        """Returns the potential that the impedance's energy output has with a stiffness [J]."""
        gains = self._springs.changing_gains.of(K, K)
        D = now["desired_motion"]
        return float(stored_energy(self._springs.energies.evaluate(D, C, _NO_WRENCH, gains)))

    def _written(self, name: str) -> Callable[[Now, Array], None]:
        def write(now: Now, value: Array) -> None:
            value[:] = self.granted(now.memory, now)[name]

        return write
