"""A strip chart with fixed axes; time runs from left to right, in seconds before now."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import viser
from viser import uplot

from app.adapter import private
from app.client.recording import BUCKETS, WINDOW, PlotWindow, decimate
from app.html.palette import RGB, css
from app.html.svg import round_step
from app.html.text import block
from app.tab.context import PageContext

_NUDGE = 10
"""Number of updates after which the curves are sent even if they have not changed; the time axis is then
changed invisibly. Without this change, a chart that was laid out while its panel had no width would never get
ticks."""
_AROUND = 60  # px: height of the title and the time axis
_FINE = 0.35  # px: a point that is closer to a curve than this counts as a point of the curve
_TOP = 30_000.0
"""Values are sent in two bytes each, as numbers from 0 (lower end of the axis) to this number (upper end). No
screen has more pixels."""
_TICKS = 5
_SECONDS = tuple(range(-round(WINDOW), 1, 2))
_TIMES: uplot.Axis = {
    "size": 36,
    "splits": tuple(float(second) for second in _SECONDS),
    "values": tuple(f"{second} s".replace("-", "−") if second else "now" for second in _SECONDS),
}
Curves = Callable[[PlotWindow], Sequence[np.ndarray]]
_BOUND_DASH, _GHOST_DASH = (6.0, 4.0), (3.0, 3.0)
_PATIENCE = 12
"""Number of updates without a value after which a text explains why the chart is empty."""
NO_TICK = "No tick has run yet: run (Space), or take single ticks (T), to see a curve."


@dataclass(frozen=True)
class ChartLine:
    """label: name in the legend; fill: opacity of the area below the curve; dashed: true for bounds; dash:
    lengths, px, of the dashes and gaps of curves that share a colour. A ghost's curve has a finer pattern."""

    label: str
    colour: RGB
    dashed: bool = False
    fill: float = 0.0
    width: float = 1.6
    dash: tuple[float, ...] = ()

    def of_ghost(self) -> ChartLine:
        """Returns the line of the ghost for the same quantity."""
        finer = tuple(0.5 * length for length in self.dash) or _GHOST_DASH
        return replace(self, label=f"{self.label}, ghost", width=1.3, dash=finer)


@dataclass(frozen=True)
class Plot:
    """What a chart shows.

    Attributes:
        title: also its name for the browser.
        span: range of the axis in the chart's unit.
        lines: of the robot and, dashed, of its ghost.
        curves: returns the (2 · BUCKETS,) values of each of these lines.
        marks: bounds and marks, of the robot only; marked: returns their values.
        log: whether the axis is logarithmic.
        bands: areas between two lines, as (index of the upper line, index of the lower line, colour).
        height: px; by default that with which the charts of a row begin and end together.
        legend: whether there is a legend.
        empty: why the chart may stay without a curve.
        note: a text below the chart.
    """

    title: str
    span: tuple[float, float]
    lines: tuple[ChartLine, ...]
    curves: Curves
    marks: tuple[ChartLine, ...] = ()
    marked: Curves = field(default=lambda _: ())
    log: bool = True
    bands: tuple[tuple[int, int, RGB], ...] = ()
    height: int = 184
    legend: bool = True
    empty: str = NO_TICK
    note: str = ""


class Charts:
    """Charts in a folder. They are built anew when their titles or lines change, or when a ghost starts or
    ends."""

    def __init__(self, page: PageContext, folder: viser.GuiFolderHandle | None = None) -> None:
        """folder: where the charts are; None: here."""
        self._page, self._folder = page, folder or page.gui.add_folder(None)
        self._charts: list[Chart] = []
        self._built: object = None

    def draw(self, plots: Sequence[Plot], window: PlotWindow, ghost: PlotWindow | None) -> None:
        """Draws the curves of the window. ghost: the ghost's data over the same interval."""
        built = ghost is not None, [(plot.title, plot.lines, plot.marks) for plot in plots]
        if built != self._built:
            self._built = built
            self._build(plots, ghost is not None)
        for chart, plot in zip(self._charts, plots, strict=True):
            chart.show(window, partial(self._curves, plot, window, ghost))

    @staticmethod
    def _curves(plot: Plot, window: PlotWindow, ghost: PlotWindow | None) -> list[np.ndarray]:
        return [*plot.curves(window), *plot.marked(window), *(() if ghost is None else plot.curves(ghost))]

    def _build(self, plots: Sequence[Plot], ghost: bool) -> None:
        for chart in self._charts:
            chart.remove()
        with self._folder:
            self._charts = [Chart(self._page, plot, ghost) for plot in plots]


class Chart:
    """A uPlot chart with a fixed range of values, linear or logarithmic. ghost: whether it also has the lines
    of a ghost, after all others."""

    def __init__(self, page: PageContext, plot: Plot, ghost: bool) -> None:
        lines = (*plot.lines, *plot.marks, *(line.of_ghost() for line in plot.lines if ghost))
        self._log, self._title, self._in_view = plot.log, plot.title, page.in_view
        # The logarithmic scale of uPlot would draw nine grid lines per decade.
        low, high = map(math.log10, plot.span) if plot.log else plot.span
        self._span = low, high
        self._measured = [not (line.dashed or line.fill) for line in lines]
        self._tolerance = _FINE * _TOP / (plot.height - _AROUND)
        self._shows = self._blank = 0
        self._sent: tuple[np.ndarray, np.ndarray] | None = None
        x = np.linspace(-WINDOW, 0.0, 2 * BUCKETS)
        scale: uplot.Scale = {"range": (0.0, _TOP), "auto": False}
        self._handle = page.gui.add_uplot(
            (x, *(np.zeros_like(x) for _ in lines)),
            ({"label": "s"}, *(_series(line) for line in lines)),
            title=plot.title,
            scales={"x": {"time": False}, "y": scale},
            axes=(_TIMES, _axis(self._span, plot.log)),
            bands=tuple(
                {"series": (upper + 1, lower + 1), "fill": css(colour, 0.10)}
                for upper, lower, colour in plot.bands
            )
            or None,
            legend={"show": plot.legend, "live": False},
            cursor={"drag": {"x": False, "y": False}},
            height=plot.height,
            padding=(6, 12, 0, 0),
        )
        self._note = page.gui.add_html(block(plot.empty), visible=False)
        self._below = page.gui.add_html(block(plot.note)) if plot.note else None

    def show(self, window: PlotWindow, curves: Callable[[], Sequence[np.ndarray]]) -> None:
        """Shows the window. curves: returns the (2 · BUCKETS,) values of each line; called only while the
        chart is visible.

        Values beyond the axis are drawn at its edge. uPlot cannot omit the time before the first known value
        of a curve. There, a linear curve is constant, since a jump would look like a motion; a logarithmic
        curve lies on the axis. The chart counts as empty if only bounds and marks have values.
        """
        if not self._in_view.sees(self._title):
            return
        values = np.array(curves())
        known = np.isfinite(values)
        if np.count_nonzero(known[self._measured].any(axis=0)) < 2:
            self._explain(blank=True)
            return
        self._explain(blank=False)
        low, high = self._span
        if self._log:
            values = np.log10(np.maximum(values, 10.0 ** (low - 1)))
        values = np.clip(values, low, high)
        values[np.isnan(values)] = low
        if not self._log:
            begun = np.logical_or.accumulate(known, axis=1)
            first = np.take_along_axis(values, known.argmax(axis=1)[:, None], axis=1)
            values = np.where(begun, values, first)
        values = (values - low) * (_TOP / (high - low))
        kept = decimate(values, self._tolerance, window.first)
        self._send(kept, values[:, kept], window.ages()[kept])

    def _send(self, kept: np.ndarray, values: np.ndarray, ages: np.ndarray) -> None:
        """kept: indices of the points that are sent."""
        self._shows += 1
        due = self._shows % _NUDGE == 0
        if not due and self._looks_the_same(kept, values):
            return
        self._sent = kept, values
        if due:
            ages[0] -= 1e-5 * (self._shows // _NUDGE % 2)
        private.send_curves(self._handle, (ages.astype(np.float32), *np.rint(values).astype(np.int16)))

    def _explain(self, blank: bool) -> None:
        """Shows a text below a chart that stays empty."""
        self._blank = self._blank + 1 if blank else 0
        self._note.visible = self._blank >= _PATIENCE

    def remove(self) -> None:
        for handle in (self._handle, self._note, self._below):
            if handle is not None:
                handle.remove()

    def _looks_the_same(self, kept: np.ndarray, values: np.ndarray) -> bool:
        if self._sent is None or not np.array_equal(kept, self._sent[0]):
            return False
        return bool(np.abs(values - self._sent[1]).max() <= self._tolerance)


def _axis(span: tuple[float, float], log: bool) -> uplot.Axis:
    """Returns an axis with about five ticks, at powers of ten or at round numbers. The `span` of a
    logarithmic axis consists of exponents."""
    low, high = span
    every = max(1.0, round((high - low) / _TICKS)) if log else round_step((high - low) / _TICKS)
    places = [every * k for k in range(math.ceil(low / every - 1e-9), math.floor(high / every + 1e-9) + 1)]
    labels = tuple(_power(place) if log else f"{place:.6g}" for place in places)
    splits = tuple(_TOP * (place - low) / (high - low) for place in places)
    return {"size": 52, "splits": splits, "values": labels}


def _power(exponent: float) -> str:
    return f"{10.0**exponent:g}" if -4 < exponent < 4 else f"1e{exponent:g}"


def _series(line: ChartLine) -> uplot.Series:
    series: uplot.Series = {
        "label": line.label,
        "stroke": css(line.colour),
        "width": line.width,
        "points": {"show": False},
    }
    if line.dashed or line.dash:
        series["dash"] = line.dash or _BOUND_DASH
    if line.fill:
        series["fill"], series["fillTo"] = css(line.colour, line.fill), 0.0
    return series
