"""Which scheme makes the end effector behave as its impedance says, and with whose inertia."""

import logging
from dataclasses import dataclass
from typing import Protocol

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.direct_impedance import DirectImpedance
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.impedance_controller import EndEffectorImpedance
from geoimp_drake.parts.natural_impedance import NaturalImpedance
from geoimp_drake.validation import choice, key, positive

__all__ = ["INERTIAS", "SCHEMES", "SchemeConfig"]

_log = logging.getLogger("drake")

# An inner loop tracks C; the impedance is the closed loop of E itself; the arm's servos track C.
SCHEMES = ("inner-loop", "direct", "admittance")

# The inertia of E in the scheme direct: that of the impedance, or the arm's own.
INERTIAS = ("desired", "natural")

# What to do if E diverges from D.
_REMEDY = (
    "In the scheme 'direct' it is that of E itself, whose readings must come well within M/D; "
    "shorten sampling.period, or lower the damping or raise the mass of the impedance."
)


class _Impedance(Protocol):
    """The configuration of an impedance."""

    axes: str

    def make(self, remedy: str = "") -> Impedance:
        """Returns the part."""

    def check_without_inertia(self, name: str) -> None:
        """Raises ConfigurationError if masses or dampings are given."""


@dataclass
class SchemeConfig:
    """How the impedance is enforced."""

    # Or direct: the impedance is that of E itself, without that loop; or admittance: C is
    # streamed to the arm's own servos, as joint references.
    scheme: str = "inner-loop"
    inertia: str | None = None  # of direct: desired (or null), or natural, which needs no wrench
    damping_ratio: float | None = None  # of every mode with natural inertia; null for 1

    @property
    def is_natural(self) -> bool:
        """Whether E has the arm's own inertia."""
        return self.inertia == "natural"

    def uses_motion(self, impedance: _Impedance) -> bool:
        """Whether the gains of the motion loop have an effect."""
        partial = self.scheme == "direct" and impedance.axes != "both"
        return self.scheme == "inner-loop" or partial

    def make_impedance(self, impedance: _Impedance) -> EndEffectorImpedance:
        """Returns the part that moves C."""
        if self.scheme != "direct":
            return impedance.make()
        if self.is_natural:
            return NaturalImpedance(impedance.make(), self.damping_ratio or 1.0)
        return DirectImpedance(impedance.make(_REMEDY))

    def check_is_streamed(self, name: str, value: object) -> None:
        """Raises ConfigurationError if a field of streamed references is given without them.

        Args:
            name: of the field.
            value: None if it is not given.
        """
        if value is not None and self.scheme != "admittance":
            raise ConfigurationError(
                f"{name} is given, but the scheme is '{self.scheme}', which streams no references "
                f"to joint servos. Leave it out, or give scheme: admittance."
            )

    def check_inertial_load(self, inertial_load: str) -> None:
        """Warns if a sensor's tool load is removed for another acceleration than that of E.

        Raises:
            ConfigurationError: E never has that acceleration while it is in contact.
        """
        if self.scheme != "direct" or inertial_load != "reference":
            return
        if self.is_natural:
            raise ConfigurationError(
                "sensor.inertial_load is 'reference'; with inertia: natural it removes the load "
                "of the acceleration that E would have without a wrench, which falsifies the "
                "reading in contact. Give sensor.inertial_load: plant."
            )
        _log.warning(
            "sensor.inertial_load is 'reference'; with scheme: direct it removes the load of the "
            "acceleration that the law asks of E. Where the model is wrong, E has another one, "
            "and the wrench is off by the tool's mass times the difference. Give "
            "sensor.inertial_load: plant."
        )

    def check_scheme(self, name: str, impedance: _Impedance) -> None:
        """Raises ConfigurationError if the fields do not fit each other, or the impedance.

        Args:
            name: of the configuration.
            impedance: of the same.
        """
        choice(self.scheme, key(name, "scheme"), SCHEMES)
        self._check_inertia(key(name, "inertia"))
        self._check_damping_ratio(key(name, "damping_ratio"))
        if self.is_natural:
            _check_natural(key(name, "impedance"), impedance)

    def _check_inertia(self, name: str) -> None:
        if self.inertia is None:
            return
        choice(self.inertia, name, INERTIAS)
        if self.scheme != "direct":
            raise ConfigurationError(
                f"{name} is '{self.inertia}', but the scheme is '{self.scheme}', whose inertia is "
                f"always that of the impedance. Leave it out, or give scheme: direct."
            )

    def _check_damping_ratio(self, name: str) -> None:
        if self.damping_ratio is None:
            return
        positive(self.damping_ratio, name)
        if not self.is_natural:
            raise ConfigurationError(
                f"{name} is {self.damping_ratio:g}; it is for natural inertia alone, otherwise the "
                f"damping is that of the impedance. Leave it out, or give scheme: direct and "
                f"inertia: natural."
            )


def _check_natural(name: str, impedance: _Impedance) -> None:
    """Raises ConfigurationError if an impedance asks for what the arm's own inertia does not give.

    Args:
        name: of the impedance.
        impedance: its configuration.
    """
    impedance.check_without_inertia(name)
    if impedance.axes != "both":
        raise ConfigurationError(
            f"{key(name, 'axes')} is '{impedance.axes}'; with inertia: natural it must be 'both': "
            f"the other part would have to be stiff against a wrench that is not measured. Give "
            f"inertia: desired, or axes: both."
        )
