"""Configurations as plain dataclasses: defaults that run, YAML through Drake.

They are not frozen and do not check themselves when made, because Drake's `yaml_load_typed`
fills them field by field; whoever uses one calls `validation.check` first.
"""

from dataclasses import dataclass, field

import numpy as np

from geoimp_drake.arm.control_model import TASK_DIMENSION, ControlModel
from geoimp_drake.controllers.impedance_config import ImpedanceConfig
from geoimp_drake.controllers.scheme import SchemeConfig
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.motion_control.orientation_control import ORIENTATION_LAWS
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import SingularityDamping
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.impedance_controller import EndEffectorImpedance
from geoimp_drake.parts.inverse_kinematics import InverseKinematics, ReferenceConfig
from geoimp_drake.parts.joint_limits import LimitsConfig
from geoimp_drake.parts.joint_readings import Readings
from geoimp_drake.parts.motion_control import MotionControl
from geoimp_drake.parts.null_space import NullSpace
from geoimp_drake.parts.null_space_gain import null_space_gain
from geoimp_drake.parts.passivity import Passivity, PassivityConfig
from geoimp_drake.parts.remedies_config import RemediesConfig
from geoimp_drake.task_functions.config import TaskConfig
from geoimp_drake.task_functions.posture import POSTURE_RATE, Posture
from geoimp_drake.task_functions.task_function import TaskFunction
from geoimp_drake.typing import Array
from geoimp_drake.validation import check, choice, key, positive, spd_matrix

__all__ = [
    "FORMS",
    "ImpedanceControllerConfig",
    "MotionConfig",
    "RedundancyConfig",
    "SamplingConfig",
]


# How far a ratio of two periods may be from a whole number: rounding of what was typed.
_RATIO_TOLERANCE = 1e-6

# What a controller is: a Diagram of its blocks, or one system, faster and with the same numbers.
FORMS = ("blocks", "compiled")


@dataclass
class MotionConfig:
    """Gains of the motion loop, one number each: (2.9) and an orientation law of (2.10)-(2.15)."""

    K_Pp: float = 2025.0  # position [1/s²]
    K_Dp: float = 65.0  # [1/s]
    K_Po: float = 4500.0  # orientation [1/s²]
    K_Do: float = 65.0  # [1/s]
    orientation: str = "quaternion"  # the orientation law, by its name in `ORIENTATION_LAWS`

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        for gain in ("K_Pp", "K_Dp", "K_Po", "K_Do"):
            positive(getattr(self, gain), key(name, gain))
        choice(self.orientation, key(name, "orientation"), ORIENTATION_LAWS)

    def make(self) -> MotionControl:
        """Returns the part."""
        check(self, "motion")
        return MotionControl(self.K_Pp, self.K_Dp, self.K_Po, self.K_Do, self.orientation)


@dataclass
class SamplingConfig:
    """How the joints are read."""

    period: float = 1e-3  # [s]
    velocity: str = "measured"  # or differenced, as with resolvers

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        positive(self.period, key(name, "period"), "s")
        choice(self.velocity, key(name, "velocity"), ("measured", "differenced"))

    def check_motion(self, name: str, motion: MotionConfig) -> None:
        """Raises ConfigurationError if the inner loop gets its readings too rarely.

        From about 1.2/K_D on, the loop oscillates with differenced velocities.
        """
        gain = max("K_Dp", "K_Do", key=lambda name: getattr(motion, name))
        longest = 1.0 / getattr(motion, gain)
        if self.period > longest:
            raise ConfigurationError(
                f"{key(name, 'period')} is {self.period:g} s; the inner loop needs a reading at "
                f"least every 1/{gain} = {longest:.3g} s. Read more often, or give a smaller "
                f"motion.{gain}."
            )

    def check_impedance(self, name: str, impedance: ImpedanceConfig) -> None:
        """Raises ConfigurationError if an impedance of E itself gets its readings too rarely.

        The longest period is the shortest M/D or D/K. With differenced velocities the hand
        oscillates from 0.9 to 2 times that period on, depending on its damping.
        """
        longest, which = impedance.shortest_time()
        if self.period > longest:
            raise ConfigurationError(
                f"{key(name, 'period')} is {self.period:g} s; with scheme: direct the impedance is "
                f"that of the hand itself, which needs a reading at least every {which} = "
                f"{longest:.3g} s. Read more often, or give other gains, or scheme: inner-loop."
            )

    def check_step(self, name: str, time_step: float) -> None:
        """Raises ConfigurationError if velocities are differences over a varying number of steps.

        Args:
            name: of this configuration.
            time_step: of the plant, zero if it is continuous [s].
        """
        if self.velocity != "differenced" or time_step == 0:
            return
        steps = self.period / time_step
        if round(steps) == 0 or abs(steps - round(steps)) > _RATIO_TOLERANCE * steps:
            raise ConfigurationError(
                f"{key(name, 'period')} is {self.period:g} s and the plant's time step "
                f"{time_step:g} s: the number of steps between two samples would vary, and with "
                "it the velocity. Give a multiple of the time step, or "
                f"{key(name, 'velocity')}: measured."
            )

    def make(self, model: ControlModel) -> Readings:
        """Returns the part for an arm.

        Raises:
            ConfigurationError: a field cannot be used, or the period does not fit the arm's plant.
        """
        check(self, "sampling")
        self.check_step("sampling", model.time_step)
        turns = model.in_plant_order(model.turns)
        return Readings(model.num_joints, self.period, self.velocity, turns)


@dataclass
class RedundancyConfig:
    """The null-space motion of an arm with more than six joints.

    Without a task the arm holds the posture of its start, at the rate `POSTURE_RATE`. With a task
    of the kind `none` the null-space motion is damped, as with the chapter's k_β = 0.
    """

    kappa: float | None = None  # e_n decays at this rate, K_n = κB [1/s]; null for 10, or for a K_n
    K_n: Array = field(default_factory=lambda: np.array(0.0))  # constant; 0: κB [Nms/rad, Ns/m]
    k_beta: float = 0.0  # positive climbs the task function w, negative descends, zero reports it
    task: TaskConfig | None = None  # null: hold the posture of the start, whatever k_beta is
    weight: str = "inertia"  # or identity, matrix
    weight_matrix: Array | None = None  # W (n×n) or its diagonal, for matrix
    damping: SingularityDamping = field(default_factory=SingularityDamping)

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it.

        What depends on the arm (sizes, names, limits) is checked by `make`.
        """
        null_space_gain(self.K_n, self.kappa, _size_of(self.K_n), name)
        choice(self.weight, key(name, "weight"), ("inertia", "identity", "matrix"))
        matrix = key(name, "weight_matrix")
        if (self.weight == "matrix") != (self.weight_matrix is not None):
            raise ConfigurationError(
                f"{key(name, 'weight')} is '{self.weight}' but {matrix} is "
                f"{'not ' if self.weight_matrix is None else ''}given; they go together."
            )
        if self.weight_matrix is not None:
            spd_matrix(self.weight_matrix, matrix, _size_of(self.weight_matrix))

    def check_unused(self, name: str) -> None:
        """Raises ConfigurationError if more is given than the damping near singularities."""
        default = RedundancyConfig()
        for field_name in ("kappa", "K_n", "k_beta", "task", "weight"):
            if not np.array_equal(getattr(self, field_name), getattr(default, field_name)):
                raise ConfigurationError(
                    f"{key(name, field_name)} is given, but with scheme: admittance a redundant "
                    f"arm goes back to the posture at the start, at the rate "
                    f"reference.posture_gain. Leave it out."
                )

    def make(
        self, model: ControlModel, task: TaskFunction | None = None, period: float | None = None
    ) -> NullSpace:
        """Returns the part for an arm.

        Args:
            model: the arm.
            task: a task function in place of the configured one.
            period: of the joints' readings, against which a constant K_n is watched [s].

        Raises:
            ConfigurationError: a size, name or number does not fit the arm.
        """
        check(self, "redundancy")
        n, k_beta = model.num_joints, self.k_beta
        null_space_gain(self.K_n, self.kappa, n, "redundancy")
        weights = {"inertia": None, "identity": np.eye(n), "matrix": self.weight_matrix}
        if task is None and self.task is not None:
            task = self.task.make(model)
        if task is None and n > TASK_DIMENSION:
            task, k_beta = Posture(model), -POSTURE_RATE
        weight = weights[self.weight]
        return NullSpace(model, self.K_n, self.kappa, k_beta, task, weight, self.damping, period)


def _size_of(gain: Array) -> int:
    """Returns the size of the matrix that a gain stands for, one for a number."""
    return len(gain) if np.ndim(gain) else 1


@dataclass
class ImpedanceControllerConfig(SchemeConfig):
    """Everything of a single-arm impedance controller."""

    impedance: ImpedanceConfig = field(default_factory=ImpedanceConfig)
    motion: MotionConfig = field(default_factory=MotionConfig)
    sampling: SamplingConfig = field(default_factory=SamplingConfig)
    redundancy: RedundancyConfig = field(default_factory=RedundancyConfig)
    limits: LimitsConfig | None = field(default_factory=LimitsConfig)  # null: they are not kept
    reference: ReferenceConfig | None = None  # of the scheme admittance; null for its defaults
    passivity: PassivityConfig = field(default_factory=PassivityConfig)
    remedies: RemediesConfig = field(default_factory=RemediesConfig)  # of the inner loop
    form: str = "blocks"  # or compiled: one system, which is faster

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        choice(self.form, key(name, "form"), FORMS)
        self.check_scheme(name, self.impedance)
        if self.uses_motion(self.impedance):
            self.sampling.check_motion(key(name, "sampling"), self.motion)
        if self.scheme == "direct" and not self.is_natural:
            self.sampling.check_impedance(key(name, "sampling"), self.impedance)
        self.check_is_streamed(key(name, "reference"), self.reference)
        remedies = key(name, "remedies")
        self.remedies.check_scheme(remedies, self.scheme, is_natural=self.is_natural)
        self.remedies.check_rate(remedies, min(self.motion.K_Dp, self.motion.K_Do))
        if self.is_natural:
            why = "natural inertia has no gains that could change through it"
            self.passivity.refuse(key(name, "passivity"), why)
        if self.scheme == "admittance":
            reference = self.reference or ReferenceConfig()
            reference.check_period(key(name, "reference"), self.sampling.period)
            self.redundancy.check_unused(key(name, "redundancy"))
            self._check_limits(key(name, "limits"))

    def _check_limits(self, name: str) -> None:
        if self.limits is None:
            raise ConfigurationError(
                f"{name} is null; with scheme: admittance limits are always kept: no servo "
                f"follows a reference beyond them. Leave it out."
            )

    def make_passivity(self, impedance: EndEffectorImpedance) -> Passivity:
        """Returns the part that keeps an impedance passive as its gains change."""
        springs = impedance if isinstance(impedance, Impedance) else impedance.springs
        return self.passivity.make(springs, self.sampling.period)

    def make_kinematics(self, model: ControlModel) -> InverseKinematics:
        """Returns the part that makes joint references, for the scheme `admittance`."""
        return InverseKinematics(
            model,
            self.sampling.period,
            self.reference,
            self.redundancy.damping,
            self.limits,
            self.impedance.masses(),
        )
