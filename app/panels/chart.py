"""One strip chart: fixed axes (nothing jumps), seconds before now from left to right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import viser
from viser import uplot

from app.learner import WINDOW
from app.palette import RGB, css


@dataclass(frozen=True)
class Line:
    """label: of the legend; fill: paint the area below, down to the axis; dashed: for bounds and budgets."""

    label: str
    colour: RGB
    dashed: bool = False
    fill: bool = False
    width: float = 1.6


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
        """bands: (upper line, lower line, colour) fills between two lines, by index."""
        self._span = span
        x = np.array([-WINDOW, 0.0])
        scale: uplot.Scale = {"range": span, "auto": False}
        if log:
            scale["distr"], scale["log"] = 3, 10
        self._handle = gui.add_uplot(
            (x, *(np.full(2, span[0]) for _ in lines)),
            ({"label": "s"}, *(_series(line, span[0]) for line in lines)),
            title=title,
            scales={"x": {"time": False, "range": (-WINDOW, 0.0), "auto": False}, "y": scale},
            axes=({"size": 28, "space": 60}, {"size": 52, "space": 28}),
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
        """values: one array per line; what is not finite or beyond the axis is drawn at its edge."""
        low, high = self._span
        known = np.isfinite(values[0])
        if np.count_nonzero(known) < 2:
            return
        start = int(np.argmax(known))
        clipped = (
            np.clip(np.nan_to_num(column[start:], nan=low, posinf=high, neginf=low), low, high)
            for column in values
        )
        self._handle.data = (ages[start:], *(np.ascontiguousarray(column) for column in clipped))

    def remove(self) -> None:
        self._handle.remove()


def _series(line: Line, floor: float) -> uplot.Series:
    series: uplot.Series = {
        "label": line.label,
        "stroke": css(line.colour),
        "width": line.width,
        "points": {"show": False},
    }
    if line.dashed:
        series["dash"] = (6.0, 4.0)
    if line.fill:
        series["fill"], series["fillTo"] = css(line.colour, 0.35), floor
    return series
