"""The cost of the closed loop per step [µs], and as a ratio to the bare plant in the same run."""

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from pydrake.systems.analysis import Simulator

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.simulation.bench_loops import (
    bare_plant,
    closed_loop,
    under_drakes_controller,
)
from geoimp_drake.simulation.garbage import only_new_garbage

__all__ = [
    "BenchCase",
    "Timing",
    "compare_bench",
    "format_timings",
    "run_bench",
    "time_experiment",
]

_WINDOWS = 5
_WINDOW = 0.4  # [s] of simulated time

# A change below this ratio counts as noise.
_SLOWER = 1.1


@dataclass(frozen=True)
class BenchCase:
    """A closed loop to be timed.

    Attributes:
        name: of the ratio.
        experiment: of the catalogue.
        start: simulated time at which the windows begin [s].
        real_time: whether its real-time factor counts as the experiment's.
    """

    name: str
    experiment: Any
    start: float
    real_time: bool = False


@dataclass(frozen=True)
class Timing:
    """The times of several rounds; each round times a window of each loop and of the bare plant.

    Attributes:
        name: of the case.
        step: plant step [s].
        loop: closed loop, the controller's form `compiled`, logging off [µs per plant step].
        logged: the same with the experiment's own logging.
        bare: the plant alone under a constant torque, from the same state [µs per plant step].
        blocks: as `loop`, of the form `blocks`.
        blocks_logged: as `logged`, of the form `blocks`.
        drake: the plant under Drake's own InverseDynamicsController, in C++ [µs per plant step];
            empty if that takes no such plant.
    """

    name: str
    step: float
    loop: tuple[float, ...]
    logged: tuple[float, ...]
    bare: tuple[float, ...]
    blocks: tuple[float, ...]
    blocks_logged: tuple[float, ...]
    drake: tuple[float, ...] = ()

    def ratio(self, loop: str = "loop", to: str = "bare") -> float:
        """One loop over another: the median of the rounds' ratios.

        If the machine's speed changes, it changes for both windows of a round.

        Args:
            loop: an attribute.
            to: another.
        """
        pairs = zip(getattr(self, loop), getattr(self, to), strict=True)
        return median(one / other for one, other in pairs)

    def real_time_factor(self, loop: str = "logged") -> float:
        """Simulated time over wall time of a loop, given by its attribute."""
        return 1e6 * self.step / median(getattr(self, loop))


def run_bench(cases: Sequence[BenchCase], earlier: Path | None = None) -> tuple[str, str]:
    """Times closed loops.

    Args:
        cases: the loops to time.
        earlier: file with the JSON of an earlier run, None for no comparison.

    Returns:
        A table, with the cases that became slower since the earlier run, and the timings as JSON.

    Raises:
        ConfigurationError: the earlier file cannot be used; nothing has been timed.
    """
    before = None if earlier is None else _read(earlier)
    timings = [time_experiment(case.experiment, case.name, case.start) for case in cases]
    data = {
        "microseconds_per_step": {t.name: _medians(t) for t in timings},
        "ratios": {t.name: t.ratio() for t in timings},
        "ratios_blocks": {t.name: t.ratio("blocks") for t in timings},
        "real_time_factor": _real_time_factors(cases, timings, "logged"),
        "real_time_factor_blocks": _real_time_factors(cases, timings, "blocks_logged"),
    }
    table = format_timings(timings)
    if before is not None:
        table = f"{table}\n\n{compare_bench(before, data)}"
    return table, json.dumps(data, indent=2) + "\n"


def _real_time_factors(
    cases: Sequence[BenchCase], timings: Sequence[Timing], loop: str
) -> dict[str, float]:
    return {
        case.experiment.name: timing.real_time_factor(loop)
        for case, timing in zip(cases, timings, strict=True)
        if case.real_time
    }


def _read(file: Path) -> dict[str, Any]:
    try:
        data: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        if not all(isinstance(ratio, float) for ratio in data["ratios"].values()):
            raise TypeError
    except OSError as error:
        raise ConfigurationError(f"{file} cannot be read: {error.strerror}.") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise ConfigurationError(
            f"{file} does not hold the timings of `geoimp bench --json FILE`."
        ) from None
    return data


def _medians(timing: Timing) -> dict[str, float | None]:
    return {
        "bare": median(timing.bare),
        "drake": median(timing.drake) if timing.drake else None,
        "loop": median(timing.loop),
        "loop_logged": median(timing.logged),
        "blocks": median(timing.blocks),
        "blocks_logged": median(timing.blocks_logged),
    }


def compare_bench(old: dict[str, Any], new: dict[str, Any]) -> str:
    """Returns a table of what became slower from one run of `run_bench` to another.

    It compares ratios to the bare plant, not microseconds, so that another machine or another load
    does not matter. A change of less than a tenth counts as noise.

    Args:
        old: the JSON data of the earlier run.
        new: those of the later one.
    """
    common = [name for name in old["ratios"] if name in new["ratios"]]
    rows = [(name, old["ratios"][name], new["ratios"][name]) for name in common]
    lines = [f"{'case':16}{'before':>9}{'now':>9}"]
    lines += [
        f"{name:16}{before:9.1f}{now:9.1f}  {'slower' if now > _SLOWER * before else ''}".rstrip()
        for name, before, now in rows
    ]
    slower = [name for name, before, now in rows if now > _SLOWER * before]
    lines.append(f"slower: {', '.join(slower) or 'nothing'}")
    return "\n".join(lines)


def time_experiment(experiment: Any, name: str, start: float) -> Timing:
    """Times an experiment from a given time on.

    Args:
        experiment: of the catalogue.
        name: of the case.
        start: simulated time at which the windows begin [s].
    """
    loop = closed_loop(experiment, start, "compiled", logged=False)
    advance = {
        "loop": _advance(loop[0]),
        "logged": _advance(closed_loop(experiment, start, "compiled", logged=True)[0]),
        "blocks": _advance(closed_loop(experiment, start, "blocks", logged=False)[0]),
        "blocks_logged": _advance(closed_loop(experiment, start, "blocks", logged=True)[0]),
        "bare": bare_plant(*loop[1:], _WINDOW),
        "drake": under_drakes_controller(*loop[1:], _WINDOW),
    }
    step = loop[1].scenario.plant.time_step
    micro: dict[str, tuple[float, ...]] = dict.fromkeys(advance, ())
    with only_new_garbage():  # as `simulate` does
        for _ in range(_WINDOWS):
            for key, run in advance.items():
                if run is not None:
                    micro[key] += (_timed(run) * step / _WINDOW * 1e6,)
    return Timing(name, step, **micro)


def format_timings(timings: list[Timing]) -> str:
    """Returns the timings as a table for a terminal."""
    with_drake = any(t.drake for t in timings)
    drake = f"{'Drake ID':>12}" if with_drake else ""
    lines = [
        f"{'case':16}{'bare plant':>12}{drake}{'closed loop':>13}{'ratio':>8}{'real time':>12}"
        f"{'blocks':>12}{'ratio':>8}{'real time':>12}"
    ]
    for t in timings:
        known = f"{median(t.drake):9.0f} µs" if t.drake else f"{'–':>12}"
        drake = known if with_drake else ""
        lines.append(
            f"{t.name:16}{median(t.bare):9.0f} µs{drake}"
            f"{median(t.loop):10.0f} µs{t.ratio():8.1f}{t.real_time_factor():10.2f} ×"
            f"{median(t.blocks):9.0f} µs{t.ratio('blocks'):8.1f}"
            f"{t.real_time_factor('blocks_logged'):10.2f} ×"
        )
    return "\n".join(lines)


def _advance(simulator: Simulator) -> Callable[[], None]:
    return lambda: simulator.AdvanceTo(simulator.get_context().get_time() + _WINDOW)


def _timed(run: Callable[[], None]) -> float:
    start = time.perf_counter()
    run()
    return time.perf_counter() - start
