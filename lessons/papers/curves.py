"""Panels that several figures share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lessons.experiments.jobs import JobResult
from lessons.plots.panels import Panel, PlotCurve
from lessons.plots.style import name
from robots.arrays import Array, Mask


def curve(run: JobResult, field: str, k: int = 0, scale: float = 1.0, **how: object) -> PlotCurve:
    """Returns the curve of a field of a run over time; nothing is drawn for a run that failed."""
    return PlotCurve(run.t, scale * run.column(field, k), **how)  # pyright: ignore[reportArgumentType]


_BROAD = (2.4, 1.0)


def by_controller(
    runs: Sequence[JobResult], field: str, k: int, scale: float = 1.0, weights: tuple[float, float] = _BROAD
) -> tuple[PlotCurve, ...]:
    """Returns the curves of a field, one per controller, each in its colour. weights: line widths of the
    first curve and of the others. The first of several curves is broad, so that it stays visible below
    curves that coincide with it."""
    shown = [run for run in runs if len(run.t)]
    return tuple(
        curve(
            run,
            field,
            k,
            scale,
            label=name(run.controller),
            colour=run.controller,
            weight=weights[0] if index == 0 and len(shown) > 1 else weights[1],
        )
        for index, run in enumerate(shown)
    )


BAND = 0.05
"""Length of the windows of a band, s. A band shows the least and the largest value in each window."""


def banded(panel: Panel) -> Panel:
    """Returns the panel with each curve as a band between the least and the largest value in windows of BAND.
    A signal that chatters would fill an area if it were drawn as a line."""
    return replace(panel, curves=tuple(_band(plot_curve) for plot_curve in panel.curves))


def _band(curve: PlotCurve) -> PlotCurve:
    if len(curve.x) < 2:
        return curve
    starts = np.unique(np.searchsorted(curve.x, np.arange(curve.x[0], curve.x[-1], BAND)))
    low, high = np.minimum.reduceat(curve.y, starts), np.maximum.reduceat(curve.y, starts)
    return replace(curve, x=curve.x[starts] + BAND / 2, y=low, y_to=high, style="band")


def excerpt(panel: Panel, start: float, end: float) -> Panel:
    """Returns the panel for a short interval of time, with values shown as steps."""
    curves = []
    for plot_curve in panel.curves:
        inside = (plot_curve.x >= start) & (plot_curve.x <= end)
        curves.append(
            replace(plot_curve, x=plot_curve.x[inside], y=plot_curve.y[inside], style="steps", weight=1.0)
        )
    return replace(panel, curves=tuple(curves), y_label="")


def error_panels(
    runs: Sequence[JobResult], tasks: Sequence[tuple[str, int, str, float]]
) -> tuple[Panel, ...]:
    """Returns a panel per coordinate: (task, coordinate, label with unit, scale from m or rad)."""
    return tuple(
        Panel(label, by_controller(runs, f"error/{task}", k, scale)) for task, k, label, scale in tasks
    )


FAINTEST = 1e-4
"""Lower end of a logarithmic axis of errors, in the unit of the coordinate."""


def log_error_panels(
    runs: Sequence[JobResult], tasks: Sequence[tuple[str, int, str, float]]
) -> tuple[Panel, ...]:
    """Returns the panels of `error_panels`, with the largest size of the error in windows of BAND on
    logarithmic axes, so that small errors are visible, too. The first half of the curves is broad, because
    others may coincide with them."""
    panels = []
    for panel in error_panels(runs, tasks):
        curves = tuple(
            replace(_largest(plot_curve), weight=2.6 if index < len(panel.curves) / 2 else 1.0)
            for index, plot_curve in enumerate(panel.curves)
        )
        label = "size of " + panel.y_label
        panels.append(Panel(label, curves, log_y=True, y_range=(FAINTEST, 10.0)))
    return tuple(panels)


def _largest(curve: PlotCurve) -> PlotCurve:
    band = _band(replace(curve, y=np.abs(curve.y)))
    return band if band.y_to is None else replace(band, y=band.y_to, y_to=None, style="line")


def spans(t: Array, inside: Mask) -> tuple[tuple[float, float], ...]:
    """Returns the intervals of time in which `inside` is true; gaps of less than BAND are closed."""
    times = t[inside]
    if not times.size:
        return ()
    cuts = np.flatnonzero(np.diff(times) > BAND)
    starts, ends = np.r_[times[0], times[cuts + 1]], np.r_[times[cuts], times[-1]]
    return tuple(zip(starts.tolist(), ends.tolist(), strict=True))


PLANAR_ERRORS = (
    ("position", 0, "$e_x$ (mm)", 1e3),
    ("position", 1, "$e_y$ (mm)", 1e3),
    ("q1", 0, "$e_{q_1}$ (deg)", 180 / np.pi),
)


def joint_panels(
    runs: Sequence[JobResult],
    field: str,
    symbol: str,
    unit: str,
    scale: float = 1.0,
    bound: str | None = None,
    joints: int | None = None,
    weights: tuple[float, float] = _BROAD,
) -> tuple[Panel, ...]:
    """Returns one panel per joint of a field with one number per joint. The first run that did not fail gives
    the bound, drawn on both sides of zero. weights: see `by_controller`."""
    known = next((run for run in runs if run.error is None), None)
    if known is None:
        return (Panel(f"${symbol}$ ({unit})", ()),)
    count = joints or known[field].shape[1]
    panels = []
    for k in range(count):
        bounds: tuple[float, ...] = ()
        if bound is not None:
            size = scale * float(known.column(bound, k)[0])
            bounds = (-size, size) if np.isfinite(size) else ()
        panels.append(
            Panel(
                f"${symbol}_{k + 1}$ ({unit})",
                by_controller(runs, field, k, scale, weights),
                bounds=bounds,
                bound_label="bound",
            )
        )
    return tuple(panels)
