"""A picture as data: panels of curves with the bounds they must keep."""

from __future__ import annotations

from dataclasses import dataclass

from robots.arrays import Array


@dataclass(frozen=True, eq=False)
class PlotCurve:
    """y over x.

    Attributes:
        x, y: (k,) each.
        label: name in the legend; "" for none.
        colour: a controller's name, "reference", or a place "0", "1", … in the sequence of colours.
        style: "line", "dashed", "dots", "steps" or "band" (filled from y to `y_to`).
        weight: line width relative to an ordinary curve.
        y_to: (k,) the other edge of a band.
    """

    x: Array
    y: Array
    label: str = ""
    colour: str = "0"
    style: str = "line"
    weight: float = 1.0
    y_to: Array | None = None


@dataclass(frozen=True, eq=False)
class Panel:
    """Axes with curves.

    Attributes:
        y_label, x_label: with units.
        curves: drawn in order.
        bounds: horizontal bounds: constants, drawn grey.
        bound_label: their name in the legend; "" for none.
        marks: instants on the x axis, drawn as vertical lines.
        mark_label: their name in the legend.
        spans: intervals on the x axis, shaded.
        span_label: their name in the legend.
        notes: (x, y, text) beside points.
        title: above the panel.
        log_x, log_y: logarithmic axes.
        equal: x and y have the same scale.
        y_range: fixed range of y; curves are cut at its ends, and the picture's caption says so.
        x_names: labels at x = 0, 1, … instead of numbers.
    """

    y_label: str
    curves: tuple[PlotCurve, ...]
    x_label: str = "time (s)"
    bounds: tuple[float, ...] = ()
    bound_label: str = ""
    marks: tuple[float, ...] = ()
    mark_label: str = ""
    spans: tuple[tuple[float, float], ...] = ()
    span_label: str = ""
    notes: tuple[tuple[float, float, str], ...] = ()
    title: str = ""
    log_x: bool = False
    log_y: bool = False
    equal: bool = False
    y_range: tuple[float, float] | None = None
    x_names: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Bars:
    """Groups of bars: one group per entry of `groups`, with one bar per series.

    Attributes:
        series: (label, colour, one value per group).
    """

    y_label: str
    groups: tuple[str, ...]
    series: tuple[tuple[str, str, tuple[float, ...]], ...]
    x_label: str = ""
    title: str = ""


@dataclass(frozen=True, eq=False)
class Picture:
    """Panels on a grid, with one legend for all panels.

    Attributes:
        name: file name without ending.
        caption: one or two sentences about the picture.
        panels: row by row.
        columns: panels side by side.
    """

    name: str
    caption: str
    panels: tuple[Panel | Bars, ...]
    columns: int = 1
