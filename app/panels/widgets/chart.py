"""One strip chart: fixed axes (nothing jumps), seconds before now from left to right."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import viser
from viser import uplot

from app.client.decimated import BUCKETS, WINDOW
from app.html.palette import RGB, css

_NUDGE = 10
"""Updates between two invisible changes of the time axis: without one, a chart that was laid out while its
panel still had no width stays without ticks for ever."""


@dataclass(frozen=True)
class Line:
    """label: of the legend; fill: opacity of the area below, down to the axis; dashed: for bounds and, finer,
    for ghosts."""

    label: str
    colour: RGB
    dashed: bool = False
    fill: float = 0.0
    width: float = 1.6
    dash: tuple[float, float] = (6.0, 4.0)

    def of_ghost(self) -> Line:
        """The same curve of the ghost."""
        return replace(self, label=f"{self.label}, ghost", dashed=True, width=1.3, dash=(3.0, 3.0))


def of_ghost(lines: Sequence[Line], ghost: bool) -> list[Line]:
    """The ghost's curves beside these, if there is one."""
    return [line.of_ghost() for line in lines] if ghost else []


class Chart:
    """A uPlot chart with a fixed range of values, linear or logarithmic."""

    def __init__(
        self,
        gui: viser.GuiApi,
        title: str,
        lines: Sequence[Line],
        span: tuple[float, float],
        height: int,
        log: bool = False,
        bands: Sequence[tuple[int, int, RGB]] = (),
        legend: bool = True,
    ) -> None:
        """span: what the axis shows, in the chart's unit; log: its ends are powers of ten; bands: (upper
        line, lower line, colour) fills between two lines, by index."""
        self._log = log
        if log:
            # uPlot's own logarithmic scale draws nine grid lines per decade, a wall of grey here.
            span = (math.log10(span[0]), math.log10(span[1]))
        self._span = span
        self._shows = 0
        x = np.linspace(-WINDOW, 0.0, 2 * BUCKETS)
        scale: uplot.Scale = {"range": span, "auto": False}
        self._handle = gui.add_uplot(
            (x, *(np.full_like(x, span[0]) for _ in lines)),
            ({"label": "s"}, *(_series(line, span[0]) for line in lines)),
            title=title,
            scales={"x": {"time": False}, "y": scale},
            axes=({"size": 36, "space": 60}, _decades(span) if log else {"size": 52, "space": 26}),
            bands=tuple(
                {"series": (upper + 1, lower + 1), "fill": css(colour, 0.10)}
                for upper, lower, colour in bands
            )
            or None,
            legend={"show": legend, "live": False},
            cursor={"drag": {"x": False, "y": False}},
            height=height,
            padding=(6, 12, 0, 0),
        )

    def show(self, ages: np.ndarray, values: Sequence[np.ndarray]) -> None:
        """values: one array per line. What is beyond the axis is drawn at its edge. uPlot cannot leave out
        what is before the first known value: a linear curve is flat there, since a jump would look like a
        motion; a logarithmic one lies on the axis."""
        low, high = self._span
        known = np.isfinite(values[0])
        if np.count_nonzero(known) < 2:
            return
        if self._log:
            values = [np.log10(np.maximum(column, 10.0 ** (low - 1))) for column in values]
        clipped = [
            np.clip(np.nan_to_num(column, nan=low, posinf=high, neginf=low), low, high) for column in values
        ]
        if not self._log:
            start = int(np.argmax(known))
            for column in clipped:
                column[:start] = column[start]
        self._shows += 1
        if self._shows % _NUDGE == 0:
            ages = ages.copy()
            ages[0] -= 1e-6 * (self._shows // _NUDGE % 2)
        self._handle.data = (ages, *(np.ascontiguousarray(column) for column in clipped))

    def remove(self) -> None:
        self._handle.remove()


def _decades(span: tuple[float, float]) -> uplot.Axis:
    """Ticks at powers of ten, about five of them."""
    low, high = round(span[0]), round(span[1])
    every = max(1, round((high - low) / 5))
    powers = [power for power in range(low, high + 1) if power % every == 0]
    labels = tuple(f"{10.0**p:g}" if -4 < p < 4 else f"1e{p}" for p in powers)
    return {"size": 52, "splits": tuple(float(p) for p in powers), "values": labels}


def _series(line: Line, floor: float) -> uplot.Series:
    series: uplot.Series = {
        "label": line.label,
        "stroke": css(line.colour),
        "width": line.width,
        "points": {"show": False},
    }
    if line.dashed:
        series["dash"] = line.dash
    if line.fill:
        series["fill"], series["fillTo"] = css(line.colour, line.fill), floor
    return series
