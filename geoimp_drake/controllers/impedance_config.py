"""Configuration of the six-DOF impedance: gains, orientation family, coupling."""

from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from geoimp_drake.controllers.gain_design import GAINS, GainDesign
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.impedance.families import FAMILIES, OrientationImpedance, make_family
from geoimp_drake.laws.impedance.principal_axes import stiffness_from_principal_axes
from geoimp_drake.laws.impedance.trace_stiffness import stiffness_from_trace_form
from geoimp_drake.parts.impedance import AXES, TRANSLATION_AXES, Impedance
from geoimp_drake.parts.masses import Masses
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, choice, finite_array, key, spd_matrix

__all__ = ["ImpedanceConfig", "RotationGains", "TranslationGains"]

# What `stiffness` of a rotation is: K_o, or the K_R of Seo's geometric impedance control.
STIFFNESS_FORMS = ("chapter", "seo")


class _Gains:
    """What the gains of translation and of rotation have in common."""

    mass: Array
    damping: Array
    stiffness: Array
    principal_axes: Array | None
    design: GainDesign | None

    @staticmethod
    def complete_data(data: dict[str, Any], given: dict[str, Any]) -> None:
        """Writes into YAML's data the gains that follow from its design and are not `given`.

        A design that cannot be used is left to `validate`.
        """
        if not isinstance(data.get("design"), dict):
            return
        with suppress(ConfigurationError):
            design = GainDesign(**{name: np.array(v) for name, v in data["design"].items()})
            for name, gain in zip(GAINS, design.gains(), strict=True):
                if name not in given:
                    data[name] = gain.tolist()

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        self.matrices(name)
        if self.design is not None:
            self._check_design(self.design, name, key(name, "design"))

    def _check_design(self, design: GainDesign, name: str, where: str) -> None:
        if self.principal_axes is not None or getattr(self, "stiffness_form", "") == "seo":
            raise ConfigurationError(
                f"{where} takes its stiffness as it is. Leave principal_axes and stiffness_form "
                "out, and give a stiffness along other axes as a 3×3 matrix."
            )
        for gain, value in zip(GAINS, design.gains(where), strict=True):
            one, other = (spd_matrix(g, key(name, gain)) for g in (getattr(self, gain), value))
            if not np.allclose(one, other, rtol=1e-9, atol=1e-9 * np.max(np.abs(other))):
                raise ConfigurationError(
                    f"{key(name, gain)} is {np.asarray(getattr(self, gain)).tolist()}, but {where} "
                    f"gives {value.tolist()}. Leave {gain} out, or give design: null."
                )

    def matrices(self, name: str) -> tuple[Array, Array, Array]:
        """Returns mass, damping and stiffness (3×3 each); errors as `validate`."""
        mass, damping, stiffness = (
            spd_matrix(getattr(self, gain), key(name, gain)) for gain in GAINS
        )
        return mass, damping, self._along_axes(name, stiffness)

    def check_without_inertia(self, name: str) -> None:
        """Raises ConfigurationError if a mass or a damping is given, for natural inertia."""
        if self.design is not None:
            raise ConfigurationError(
                f"{key(name, 'design')} gives a mass, which natural inertia does not use: that is "
                f"the arm's own. Give {key(name, 'stiffness')}, and the scheme's damping_ratio."
            )
        default = type(self)()
        for gain in ("mass", "damping"):
            value = np.asarray(getattr(self, gain))
            if value.ndim or value != getattr(default, gain):
                raise ConfigurationError(
                    f"{key(name, gain)} is {value.tolist()}, which natural inertia does not use: "
                    f"its mass is the arm's own, and its damping follows from damping_ratio. Leave "
                    f"it out."
                )

    def _along_axes(self, name: str, stiffness: Array) -> Array:
        if self.principal_axes is None:
            return stiffness
        where = key(name, "principal_axes")
        if np.ndim(self.stiffness) > 1:
            raise ConfigurationError(
                f"{key(name, 'stiffness')} is a matrix of shape {np.shape(self.stiffness)}; with "
                f"{where} give the three stiffnesses along them."
            )
        try:
            return stiffness_from_principal_axes(self.principal_axes, np.diag(stiffness))
        except ConfigurationError as error:
            raise ConfigurationError(f"{where}: {error}") from error


@dataclass
class TranslationGains(_Gains):
    """Gains of (3.1): one number for k I, three for the diagonal, or a 3×3 matrix."""

    mass: Array = field(default_factory=lambda: np.array(9.0))  # M_p [kg]
    damping: Array = field(default_factory=lambda: np.array(2000.0))  # D_p [Ns/m]
    stiffness: Array = field(default_factory=lambda: np.array(700.0))  # K_p [N/m]
    principal_axes: Array | None = None  # U (3×3): then K_p = U Γ Uᵀ, `stiffness` being Γ
    axes: str = "world"  # or desired: the axes of the gains; with a coupling K_p is in D
    design: GainDesign | None = None  # what mass, damping and stiffness follow from


@dataclass
class RotationGains(_Gains):
    """Gains of (3.30), in C, or of another family's law: one number, three, or a 3×3 matrix."""

    mass: Array = field(default_factory=lambda: np.array(0.4))  # M_o [kg m²]
    damping: Array = field(default_factory=lambda: np.array(5.0))  # D_o [Nms/rad]
    stiffness: Array = field(default_factory=lambda: np.array(2.0))  # K_o [Nm/rad]
    principal_axes: Array | None = None  # U (3×3): then K_o = U Γ Uᵀ, `stiffness` being Γ
    stiffness_form: str = "chapter"  # or seo: `stiffness` is K_R, and K_o = tr(K_R) I − K_R
    design: GainDesign | None = None  # what mass, damping and stiffness follow from


@dataclass
class ImpedanceConfig:
    """The six-DOF impedance; the defaults are those of the chapter's first experiment."""

    translation: TranslationGains = field(default_factory=TranslationGains)
    rotation: RotationGains = field(default_factory=RotationGains)
    orientation: str = "quaternion"  # family, by its name in `FAMILIES`
    axes: str = "both"  # or translation, rotation, none: what is left out of C equals D
    coupling: Array | None = None  # K_c (3×3) between rotation and translation, in D [N]

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        choice(self.orientation, key(name, "orientation"), FAMILIES)
        choice(self.axes, key(name, "axes"), AXES)
        choice(self.translation.axes, key(name, "translation.axes"), TRANSLATION_AXES)
        form = key(name, "rotation.stiffness_form")
        choice(self.rotation.stiffness_form, form, STIFFNESS_FORMS)
        if self.coupling is not None:
            finite_array(self.coupling, key(name, "coupling"), (3, 3))

    def check_without_inertia(self, name: str) -> None:
        """Raises ConfigurationError if masses or dampings are given, for natural inertia."""
        self.translation.check_without_inertia(key(name, "translation"))
        self.rotation.check_without_inertia(key(name, "rotation"))

    def gains(self, part: str) -> tuple[Array, Array, Array]:
        """Returns mass, damping and stiffness (3×3 each) of `translation` or `rotation`."""
        gains: _Gains = getattr(self, part)
        mass, damping, stiffness = gains.matrices(f"impedance.{part}")
        if part == "rotation" and self.rotation.stiffness_form == "seo":
            stiffness = stiffness_from_trace_form(stiffness)
        return mass, damping, stiffness

    def stiffness_is_in_desired(self) -> bool:
        """Returns whether K_p is in D's axes; otherwise it is in W's."""
        return self.coupling is not None or self.translation.axes == "desired"

    def masses(self) -> Masses:
        """Returns M_o and M_p."""
        M_o, M_p = (self.gains(part)[0] for part in ("rotation", "translation"))
        return Masses(M_o, M_p, self.translation.axes == "desired")

    def natural_period(self) -> float:
        """Returns the shortest √(M/K) of what is compliant, infinite if nothing is [s]."""
        times = [np.inf]
        for part in self._compliant():
            mass, _, stiffness = self.gains(part)
            times.append(np.sqrt(_shortest(mass, stiffness)))
        return float(min(times))

    def shortest_time(self) -> tuple[float, str]:
        """Returns the shortest M/D or D/K of what is compliant [s], and which it is, in words."""
        times = [(np.inf, "")]
        for part in self._compliant():
            mass, damping, stiffness = self.gains(part)
            times += [
                (_shortest(mass, damping), f"M/D of {part}"),
                (_shortest(damping, stiffness), f"D/K of {part}"),
            ]
        return min(times)

    def _compliant(self) -> list[str]:
        return [part for part in ("translation", "rotation") if self.axes in ("both", part)]

    def make_rotation(self) -> OrientationImpedance:
        """Returns the orientation family with its gains."""
        return make_family(self.orientation, *self.gains("rotation"))

    def make(self, remedy: str = "") -> Impedance:
        """Returns the part; `remedy` is the advice in its error if the motion diverges."""
        check(self, "impedance")
        rotation = self.make_rotation()
        return Impedance(
            *self.gains("translation"),
            rotation,
            self.axes,
            K_c=self.coupling,
            remedy=remedy,
            translation_axes=self.translation.axes,
        )


def _shortest(slow: Array, fast: Array) -> float:
    """Returns the least eigenvalue of `fast`⁻¹ `slow` (3×3 each)."""
    return float(1.0 / np.linalg.eigvals(np.linalg.solve(slow, fast)).real.max())
