"""Pictures drawn as PNG files."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterable, Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, MaxNLocator, NullLocator

from lessons.outputs import write_files
from lessons.plots.panels import Bars, Panel, Picture, PlotCurve
from lessons.plots.style import BOUND, RC, REFERENCE, colour

WIDTH = 7.2
"""Width of a page between its margins, inches."""
DPI = 150
_MARKED = 12
"""A curve with at most this number of points has a marker at each point."""
_DECADES = 300
"""A logarithmic axis that spans less than this factor has ticks at 1, 2, 5."""
_TALL = 50
"""Bars whose heights differ by more than this factor get a logarithmic axis."""
_LABEL = 20
"""Characters in a line of the label of an axis of bars."""
_NAME = 10
"""Characters in a line of a name below an axis."""
_STYLES = {"line": "-", "dashed": (0, (5, 2)), "dots": "", "steps": "-"}


def draw(picture: Picture, folder: Path) -> Path:
    """Draws a picture into a folder and returns its file."""
    rows = -(-len(picture.panels) // picture.columns)
    with mpl.rc_context(RC):
        heights = [_height(picture, row) for row in range(rows)]
        figure = Figure(figsize=(WIDTH, sum(heights) + 0.35), dpi=DPI, layout="constrained")
        FigureCanvasAgg(figure)
        grid = figure.subplots(rows, picture.columns, squeeze=False, height_ratios=heights)
        for index, axes in enumerate(grid.flat):
            if index >= len(picture.panels):
                axes.set_axis_off()
                continue
            panel = picture.panels[index]
            _draw_bars(axes, panel) if isinstance(panel, Bars) else _draw_panel(axes, panel)
        _label_shared_x(picture, grid)
        figure.align_ylabels(grid)
        _legend(figure, grid)
        path = folder / f"{picture.name}.png"
        write_files({path: png(figure)})
    return path


def png(figure: Figure) -> bytes:
    """Returns a figure as the content of a PNG file."""
    memory = io.BytesIO()
    figure.savefig(memory, format="png")
    return memory.getvalue()


def _height(picture: Picture, row: int) -> float:
    """Returns the height of a row in inches: panels with equal axes are square, those with time series are
    lower."""
    panels = picture.panels[row * picture.columns : (row + 1) * picture.columns]
    if any(isinstance(panel, Panel) and panel.equal for panel in panels):
        return min(4.6, 0.85 * WIDTH / picture.columns)
    return 2.9 if len(picture.panels) <= picture.columns else 1.75


def _draw_panel(axes: Axes, panel: Panel) -> None:
    for curve in panel.curves:
        _draw_curve(axes, curve)
    _draw_lines(axes, panel)
    axes.set(xlabel=panel.x_label, ylabel=panel.y_label, title=panel.title)
    if panel.log_x and _positive(curve.x for curve in panel.curves):
        axes.set_xscale("log")
        used = sorted({float(x) for curve in panel.curves for x in curve.x})
        if len(used) <= _MARKED:
            label_values(axes.xaxis, used, log=True)
    if panel.log_y and _positive(curve.y for curve in panel.curves):
        axes.set_yscale("log")
        low, high = panel.y_range or axes.get_ylim()
        if high < _DECADES * low:
            label_values(axes.yaxis, (), log=True)
    if panel.equal:
        axes.set_aspect("equal", adjustable="datalim")
    if panel.y_range is not None:
        axes.set_ylim(*panel.y_range)
    elif panel.bounds and not panel.log_y:
        # The range includes the curves and all bounds, with a margin beyond the outermost bounds.
        low, high = min(panel.bounds), max(panel.bounds)
        margin = 0.08 * (high - low or abs(high) or 1.0)
        bottom, top = axes.get_ylim()
        axes.set_ylim(min(bottom, low - margin), max(top, high + margin))
    if panel.x_names:
        wrapped = [textwrap.fill(name, _NAME, break_long_words=False) for name in panel.x_names]
        axes.set_xticks(range(len(wrapped)), wrapped, fontsize=7)
        axes.grid(visible=False, axis="x")
    if panel.x_label == "time (s)":
        axes.margins(x=0.01)


def _draw_lines(axes: Axes, panel: Panel) -> None:
    """Draws bounds, marked instants, shaded intervals and notes. The legend names the first of each kind."""
    dotted = (0, (4, 1.5, 1, 1.5))
    for index, bound in enumerate(panel.bounds):
        label = panel.bound_label if index == 0 else ""
        axes.axhline(bound, color="white", linewidth=1.6, zorder=0.9)  # otherwise the grid fills the gaps
        axes.axhline(bound, color=BOUND, linewidth=1.2, linestyle=dotted, zorder=1, label=label)
    for index, mark in enumerate(panel.marks):
        label = panel.mark_label if index == 0 else ""
        axes.axvline(mark, color=REFERENCE, linewidth=0.9, linestyle=":", zorder=1, label=label)
    for index, (start, end) in enumerate(panel.spans):
        label = panel.span_label if index == 0 else ""
        axes.axvspan(start, end, color=BOUND, alpha=0.25, linewidth=0, zorder=0, label=label)
    for x, y, text in panel.notes:
        behind = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.6}
        axes.annotate(text, (x, y), (3, 3), textcoords="offset points", fontsize=7, zorder=4, bbox=behind)


def _positive(values: Iterable[np.ndarray]) -> bool:
    """Returns whether there is a positive value for a logarithmic axis."""
    return any(bool((series[np.isfinite(series)] > 0).any()) for series in values)


def _draw_curve(axes: Axes, curve: PlotCurve) -> None:
    shade = colour(curve.colour)
    if curve.style == "dots":
        axes.plot(
            curve.x, curve.y, ".", color=shade, label=curve.label, markersize=3 * curve.weight, zorder=3
        )
        return
    if curve.y_to is not None:
        axes.fill_between(
            curve.x, curve.y, curve.y_to, color=shade, alpha=0.45, linewidth=0.4, label=curve.label, zorder=3
        )
        return
    axes.plot(
        curve.x,
        curve.y,
        linestyle=_STYLES[curve.style],
        drawstyle="steps-post" if curve.style == "steps" else "default",
        marker="o" if len(curve.x) <= _MARKED else None,
        markersize=3.5,
        color=shade,
        linewidth=1.1 * curve.weight,
        label=curve.label,
        zorder=3,
    )


def _draw_bars(axes: Axes, panel: Bars) -> None:
    width = 0.8 / len(panel.series)
    middle = np.arange(len(panel.groups))
    for index, (label, key, values) in enumerate(panel.series):
        offset = (index - 0.5 * (len(panel.series) - 1)) * width
        axes.bar(middle + offset, values, 0.92 * width, color=colour(key), label=label, zorder=3)
    axes.set_xticks(middle, panel.groups)
    axes.grid(visible=False, axis="x")
    axes.set(xlabel=panel.x_label, ylabel=textwrap.fill(panel.y_label, _LABEL), title=panel.title)
    known = [value for _, _, values in panel.series for value in values if value > 0]
    if known and max(known) > _TALL * min(known):
        axes.set_yscale("log")
        _mark_zeros(axes, panel, width)


def _mark_zeros(axes: Axes, panel: Bars, width: float) -> None:
    """Draws a dash for a bar of height zero, which a logarithmic axis cannot show."""
    for index, (_, key, values) in enumerate(panel.series):
        offset = (index - 0.5 * (len(panel.series) - 1)) * width
        for group, value in enumerate(values):
            if value <= 0:
                axes.annotate(
                    "–",
                    (group + offset, 0.0),
                    (0, 1),
                    xycoords=("data", "axes fraction"),
                    textcoords="offset points",
                    ha="center",
                    fontsize=11,
                    fontweight="bold",
                    color=colour(key),
                )


def _label_shared_x(picture: Picture, grid: np.ndarray) -> None:
    """If all panels of a column have the same label, removes it from all panels except the last."""
    for column in grid.T:
        shown = [axes for axes in column if axes.axison]
        if len({axes.get_xlabel() for axes in shown}) == 1:
            for axes in shown[:-1]:
                axes.set_xlabel("")


def _legend(figure: Figure, grid: np.ndarray) -> None:
    legend = {}
    for axes in grid.flat:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            legend.setdefault(label, handle)
    if len(legend) > 1:
        figure.legend(
            legend.values(),
            legend.keys(),
            loc="outside upper center",
            ncols=min(len(legend), 4),
            markerscale=2,
        )


_FEW = 8


def label_values(axis: Axis, values: Sequence[float], log: bool) -> None:
    """Sets ticks at the values if there are few of them, otherwise at round numbers. The labels are plain
    numbers, without powers of ten."""
    if 0 < len(values) <= _FEW:
        axis.set_major_locator(FixedLocator(list(values)))
    elif not log and all(float(value).is_integer() for value in values):
        axis.set_major_locator(MaxNLocator(integer=True))
    elif log:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.3g}"))
    axis.set_minor_locator(NullLocator())
