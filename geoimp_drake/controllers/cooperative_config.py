"""Configuration of two arms that hold one object; see config.py for what one arm needs."""

from dataclasses import dataclass, field

from geoimp_drake.controllers.config import FORMS, MotionConfig, RedundancyConfig, SamplingConfig
from geoimp_drake.controllers.impedance_config import ImpedanceConfig
from geoimp_drake.controllers.scheme import SCHEMES
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.grasp import MutualPose
from geoimp_drake.parts.grasp_watch import GraspMonitorConfig
from geoimp_drake.parts.internal_impedance import InternalGains, InternalImpedanceConfig
from geoimp_drake.parts.joint_limits import LimitsConfig
from geoimp_drake.parts.object_load import OBJECT_WRENCHES, ObjectLoad
from geoimp_drake.parts.reference_hold import ReferenceHoldConfig
from geoimp_drake.parts.remedies_config import RemediesConfig
from geoimp_drake.validation import choice, key

__all__ = ["CooperativeControllerConfig", "InternalGains", "MutualPose", "ObjectLoad"]


@dataclass
class CooperativeControllerConfig:
    """Everything of a controller of two arms that hold one object."""

    impedance: ImpedanceConfig = field(default_factory=ImpedanceConfig)  # of the object
    motion: MotionConfig = field(default_factory=MotionConfig)  # of each hand
    sampling: SamplingConfig = field(default_factory=SamplingConfig)
    redundancy_1: RedundancyConfig = field(default_factory=RedundancyConfig)
    redundancy_2: RedundancyConfig = field(default_factory=RedundancyConfig)
    limits: LimitsConfig | None = field(default_factory=LimitsConfig)  # null: they are not kept
    load: ObjectLoad | None = None  # the object's weight and inertia; by default it has none
    wrench: str = "grasp-matrix"  # of the object; or printed, as (4.6)
    mutual_pose: MutualPose | None = None  # of the grasp; by default that at the start
    internal: InternalImpedanceConfig = field(default_factory=InternalImpedanceConfig)
    monitor: GraspMonitorConfig = field(default_factory=GraspMonitorConfig)
    opened: ReferenceHoldConfig = field(default_factory=ReferenceHoldConfig)
    remedies: RemediesConfig = field(default_factory=RemediesConfig)  # of both inner loops
    scheme: str = "inner-loop"  # there is no other for two arms
    form: str = "blocks"  # or compiled: one system, which is faster

    def validate(self, name: str) -> None:
        """Raises ConfigurationError if a field cannot be used; `name` is put before it."""
        choice(self.wrench, key(name, "wrench"), OBJECT_WRENCHES)
        choice(self.form, key(name, "form"), FORMS)
        self._check_scheme(key(name, "scheme"))
        self.internal.check_period(key(name, "internal"), self.sampling.period)
        if self.monitor.enabled:
            self.monitor.check_period(key(name, "monitor"), self.sampling.period)
        self.sampling.check_motion(key(name, "sampling"), self.motion)
        damping = min(self.motion.K_Dp, self.motion.K_Do)
        self.remedies.check_rate(key(name, "remedies"), damping)

    def _check_scheme(self, name: str) -> None:
        choice(self.scheme, name, SCHEMES)
        if self.scheme != "inner-loop":
            raise ConfigurationError(
                f"{name} is '{self.scheme}'; two arms that hold one object have inner loops only: "
                f"each hand tracks a reference of its own, which keeps the grasp where the arms' "
                f"models are wrong, and brings both hands to rest when a grasp opens. Leave it out."
            )
