"""The chapter's figures from a log."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from geoimp_drake.parts.joint_limits import SLACK
from geoimp_drake.simulation.style import (
    AXIS_STYLES,
    figure_style,
    keep_noise_small,
    shade_phases,
)
from geoimp_drake.systems.frame_motion import POSITION
from geoimp_drake.typing import Array

__all__ = ["contact_time", "interaction_figure", "panels_figure"]

Phases = list[tuple[str, float, float]]

# The lowest part of a panel, which is shaded while a limit acts.
_LIMIT_HEIGHT, _LIMIT_COLOUR = 0.04, "#CC3311"

_TOUCH, _TOUCH_TIME = 1.0, 0.05  # true force [N] and for how long [s] it counts as contact


def interaction_figure(
    log: Mapping[str, Array],
    arm: str,
    orientation_error: Array,
    *,
    title: str,
    orientation_label: str,
    phases: Phases,
    further: Sequence[tuple[str, Array, str]] = (),
) -> Figure:
    """Returns the layout of Figs 5.3, 5.10 and 5.13: errors above, contact wrench below.

    Args:
        log: of a run.
        arm: its name in the log.
        orientation_error: displacement of the orientation family over time (N×3).
        title: of the figure.
        orientation_label: label of the orientation error's axis, with its unit.
        phases: the ones to shade: name, begin, end.
        further: two panels below: title, values (N×3), label with unit.
    """
    position_error = (log[f"{arm}/motion_D"] - log[f"{arm}/motion_C"])[:, POSITION]
    wrench = log[f"{arm}/wrench"]
    with figure_style():
        panels = (
            ("position error", 1e3 * position_error, "Δp_dc [mm]"),
            ("orientation error", orientation_error, orientation_label),
            ("contact force", wrench[:, 3:], "f [N]"),
            ("contact moment", wrench[:, :3], "μ [Nm]"),
            *further,
        )
        rows = len(panels) // 2
        figure = Figure(figsize=(9, 3 * rows))
        axes = figure.subplots(rows, 2, sharex=True)
        for panel, (name, values, label) in zip(axes.flat, panels, strict=True):
            first = panel is axes[0, 0]
            # The first panel has the names of the phases above its curves.
            _plot_components(panel, log["t"], values, name, label)
            shade_phases(panel, phases, label=first)
            _mark_contact(panel, log, arm, label=first)
            _shade_limits(panel, log, arm, label=first)
            _add_legend(panel, "lower right" if first else "best")
        for panel in axes[-1]:
            panel.set_xlabel("time [s]")
        figure.suptitle(title)
    return figure


def panels_figure(
    log: Mapping[str, Array],
    arm: str,
    panels: Sequence[tuple[str, str, Array, float | None]],
    title: str,
    phases: Phases,
) -> Figure:
    """Returns panels side by side, as in Figs 5.4 to 5.9.

    Args:
        log: of a run.
        arm: its name in the log.
        panels: title, label of the axis with its unit, values (N×3, or N for one curve), and the
            least range of the axis. That range keeps noise from looking like a signal. For one
            curve it is from zero up, for three to both sides. The default is the floor of its unit.
        title: of the figure.
        phases: to be shaded: name, begin, end.
    """
    with figure_style():
        figure = Figure(figsize=(4.5 * len(panels), 3.4))
        row = figure.subplots(1, len(panels), squeeze=False)[0]
        for axes, (name, label, values, least) in zip(row, panels, strict=True):
            if values.ndim == 1:
                _plot_scalar(axes, log["t"], values, name, label, least)
            else:
                _plot_components(axes, log["t"], values, name, label, least=least)
            shade_phases(axes, phases, label=False)
            _mark_contact(axes, log, arm, label=False)
            _shade_limits(axes, log, arm, label=axes is row[0])
            _add_legend(axes, "best")
            axes.set_xlabel("time [s]")
        figure.suptitle(title)
    return figure


def _plot_scalar(
    axes: Axes, t: Array, values: Array, title: str, label: str, least: float | None
) -> None:
    """Plots one curve over time."""
    axes.plot(t, values)
    axes.set_title(title)
    axes.set_ylabel(label)
    _limit_time(axes, t)
    if least is not None:
        axes.set_ylim(0.0, max(1.05 * values.max(), least))
    keep_noise_small(axes)


def _plot_components(
    axes: Axes,
    t: Array,
    values: Array,
    title: str,
    label: str,
    least: float | None = None,
) -> None:
    """Plots the three components of a vector over time."""
    for component, name, style in zip(values.T, "xyz", AXIS_STYLES, strict=True):
        axes.plot(t, component, label=name, **style)
    axes.set_title(title)
    axes.set_ylabel(label)
    _limit_time(axes, t)
    axes.margins(y=0.18)  # room for the legend and the names of the phases
    if least is not None:
        low, high = axes.get_ylim()
        axes.set_ylim(min(low, -least), max(high, least))
    keep_noise_small(axes)


def _add_legend(axes: Axes, place: Literal["best", "lower right"]) -> None:
    """Adds a legend of the named curves, if there are any."""
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        axes.legend(handles, labels, loc=place, ncols=len(handles), handlelength=2.5)


def _limit_time(axes: Axes, t: Array) -> None:
    axes.set_xlim(t[0], t[-1] if len(t) > 1 else t[0] + 1.0)


def contact_time(log: Mapping[str, Array], arm: str) -> float | None:
    """Returns the time of the first contact with the surface [s], or None.

    A shorter pull, such as that of two hands that take an object, does not count.
    """
    if "surface/plane" not in log:
        return None
    normal_force = -(log[f"{arm}/wrench_true"][:, 3:] @ log["surface/plane"][:3])
    begin = None
    for t, touches in zip(log["t"], normal_force > _TOUCH, strict=True):
        if not touches:
            begin = None
            continue
        begin = t if begin is None else begin
        if t - begin >= _TOUCH_TIME:
            return float(begin)
    return None


def _shade_limits(axes: Axes, log: Mapping[str, Array], arm: str, *, label: bool) -> None:
    """Shades the bottom of a panel while a limit of the arm acts; `label` adds a name."""
    if f"{arm}/limited" not in log:
        return
    acts = log[f"{arm}/limited"][:, : SLACK.start].any(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], acts, [False])).astype(int)))
    t = np.append(log["t"], log["t"][-1])
    name = "at a limit" if label else None
    style: dict[str, Any] = {"ymax": _LIMIT_HEIGHT, "color": _LIMIT_COLOUR, "linewidth": 0}
    for begin, end in edges.reshape(-1, 2):
        axes.axvspan(t[begin], t[end], label=name, **style)
        name = None


def _mark_contact(axes: Axes, log: Mapping[str, Array], arm: str, *, label: bool) -> None:
    """Draws a line at first contact."""
    time = contact_time(log, arm)
    if time is None:
        return
    axes.axvline(time, color="#666666", linewidth=0.8, linestyle=":")
    if label:
        axes.annotate(
            "contact",
            (time, 0.0),
            xycoords=("data", "axes fraction"),
            xytext=(3, 4),
            textcoords="offset points",
            fontsize=8,
            color="#666666",
        )
