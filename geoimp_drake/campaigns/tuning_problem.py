"""The problem of a plan for an experiment that was run: walls, bounds, default constraints."""

from dataclasses import replace

import numpy as np

from geoimp_drake.analysis.contact_model import ROBUSTNESS, ContactModel
from geoimp_drake.analysis.encounter import Encounter
from geoimp_drake.analysis.ringing import on_surface
from geoimp_drake.analysis.tuning import Constraint, Tuning
from geoimp_drake.campaigns.tuning_plan import Range, TuningPlan
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.prediction.sampled_loop import SampledLoop

__all__ = ["tuning_of"]

# Multiple of the surface's stiffness up to which no wall may ring.
_ROBUST = 5.0
# Range of stiffnesses of an unknown wall [N/m].
_WALLS = (10.0, 1e6)
_BISECTIONS = 24
# Default bounds, as factors of a given gain.
_ABOUT = {"M": (0.2, 5.0), "D": (0.02, 5.0), "K": (0.5, 2.0)}


def tuning_of(
    plan: TuningPlan, loop: SampledLoop, encounter: Encounter, measured: dict[str, float]
) -> Tuning:
    """Returns the problem of a plan.

    Args:
        plan: as written.
        loop: of one hand, with the gains as given.
        encounter: of D with the wall.
        measured: metrics of a run with these gains.

    Raises:
        ConfigurationError: the hand is not compliant along the wall's normal.
    """
    model = ContactModel(_on_wall(loop, encounter, measured), encounter)
    if not np.isfinite(model.given["M"]):
        raise ConfigurationError(
            "The hand is not compliant along the wall's normal, so no gain changes its contact; "
            "give impedance.axes that have it."
        )
    walls = tuple(sorted({model.wall, *(plan.surface_stiffness or ())}))
    return Tuning(
        model,
        walls,
        plan.minimize,
        (*(plan.subject_to or (_settles(model, measured),)), *_robust(plan, walls)),
        {name: bounds or _about(name, model.given) for name, bounds in plan.vary.items()},
        plan.seed,
    )


def _on_wall(loop: SampledLoop, encounter: Encounter, measured: dict[str, float]) -> SampledLoop:
    """Returns the loop on its surface, or on a wall for which the rollout has the peak of the run.

    The peak grows with the wall's stiffness.
    """
    if loop.environment.any():
        return loop
    bare = replace(loop, environment=np.outer(encounter.normal, encounter.normal))
    model = ContactModel(bare, encounter)
    low, high = _WALLS
    for _ in range(_BISECTIONS):
        middle = float(np.sqrt(low * high))
        peak = model.metrics(model.given, middle)["peak_force"]
        low, high = (middle, high) if peak < measured["peak_force"] else (low, middle)
    return on_surface(bare, high / encounter.hands)


def _settles(model: ContactModel, measured: dict[str, float]) -> Constraint:
    """Returns the constraint: the force rests when D does, or no later than with given gains."""
    given = model.metrics(model.given)["settling"], measured["settling"]
    moving = model.encounter.rest - model.encounter.touch
    return Constraint("settling", max(moving, *(t for t in given if np.isfinite(t)), moving))


def _robust(plan: TuningPlan, walls: tuple[float, ...]) -> list[Constraint]:
    """Returns constraints: no wall rings up to the plan's stiffest, or five times the surface's."""
    if any(constraint.name == ROBUSTNESS for constraint in plan.subject_to):
        return []
    most = walls[-1] if plan.surface_stiffness else _ROBUST * walls[-1]
    return [Constraint(ROBUSTNESS, most, is_upper=False)]


def _about(name: str, given: dict[str, float]) -> Range:
    low, high = _ABOUT[name]
    return low * given[name], high * given[name]
