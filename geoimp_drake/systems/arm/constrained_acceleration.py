"""Joint accelerations within the arm's limits."""

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.laws.redundancy.damped_pseudo_inverse import SingularityDamping
from geoimp_drake.parts import constrained_acceleration as part
from geoimp_drake.parts.joint_limits import JointLimits, LimitsConfig
from geoimp_drake.parts.masses import Masses
from geoimp_drake.parts.part import Part
from geoimp_drake.systems.part_system import PartSystem

__all__ = ["ConstrainedAcceleration"]


class ConstrainedAcceleration(PartSystem):
    """Keeps an arm's joints within positions, velocities and efforts, by a quadratic program.

    As long as no limit binds, it passes the acceleration on unchanged, to the bit. Otherwise it
    solves

        min ½ (Jα − b)ᵀ W (Jα − b) + ½ Σ wᵢ λᵢ² (vᵢᵀ(α + k q̇))² + ½ ρ (α − α₀)ᵀ B (α − α₀)     (L.1)
        over α between (v̲ − q̇)/T and (v̄ − q̇)/T, |Bα + c| ≤ τ̄,    b = a − J̇q̇,  c = Cq̇ + Fq̇ + g + Jᵀh

    where v̲ and v̄ are velocities from which the joints can still brake before their ends (L.2).
    The weight W is the mass matrix of the impedance. The slack s = Jα + J̇q̇ − a is what is left of
    the task. With this weight it is the acceleration by an ideal constraint wrench: free directions
    keep their law. Near a singularity only motion along the direction vᵢ that is nearly lost is
    damped. Where the bounds of α and the efforts exclude each other, the efforts are kept.

    Each kind of limit is logged as a warning when it acts for the first time.

    Args:
        model: the arm's control model, whose limits are kept.
        config: how the limits are kept.
        masses: of the impedance; those in the axes of C or D turn with E; unit matrices by default.
        damping: near singularities.

    Raises:
        SignalError: an input is NaN or infinite.

    Ports:
        input joint_acceleration: α₀, without limits; not used for six joints near a singularity (n)
        input task_acceleration: a = [angular; linear] of E in W (6)
        input arm: ArmState
        input wrench: h = [μ; f] by the end effector on the environment, about Eo, in W (6)
        output joint_acceleration: α (n)
        output slack: s (6)
        output limited: `Limited` when the last step began: which limits act, and the slack (10)
    """

    def __init__(
        self,
        model: ControlModel,
        config: LimitsConfig | None = None,
        masses: Masses | None = None,
        damping: SingularityDamping | None = None,
    ):
        limits = JointLimits(model, config or LimitsConfig(), masses, damping)
        super().__init__(self.part_of(limits))

    @staticmethod
    def part_of(limits: JointLimits) -> Part:
        """Returns the part for the limits of an arm."""
        return part.ConstrainedAcceleration(limits)
