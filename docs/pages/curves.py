"""Curves of a recorded step as SVG, with the page's colours (light and dark) and width."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from app.html.svg import decades, path_through, tick_label, ticks

WIDTH, HEIGHT = 640, 180
LEFT, RIGHT, TOP, BOTTOM = 58, 8, 8, 22
_DECADES = 300.0
"""Nonnegative values are drawn on a logarithmic axis if most of them span more than this factor."""
_MOST = 0.05
"""The share of the smallest values that are not counted for this span, because an error or a distance is zero
at the start of a run."""
FLOORS = {"m": 1e-6, "mm": 1e-3, "deg": 1e-3, "%": 1e-2, "m/s²": 1e-6, "N·m": 1e-4}
"""The lower end of a logarithmic axis for each unit. Smaller values are rounding errors and are drawn at that
end."""


def figure(step: Mapping[str, Any], ghost: str | None) -> str:
    """Returns all plots of a step, one below the other, and a legend if there is a ghost."""
    drawn = "".join(_plot(each) for each in step["plots"])
    words = "The recorded run." + (f" Dashed: the ghost, {escape(ghost)}." if ghost else "")
    floors = dict.fromkeys(_floor_words(each) for each in step["plots"])
    words += "".join(f" {each}" for each in floors if each)
    return f'<figure class="curves">{drawn}<figcaption>{words}</figcaption></figure>'


def _plot(plot: Mapping[str, Any]) -> str:
    times, curves = plot["t"], plot["curves"]
    t = [min((each[0] for each in times if each), default=0.0), max((e[-1] for e in times if e), default=0.0)]
    values = _values(plot)
    name = escape(plot["words"] + (f", {plot['unit']}" if plot["unit"] else ""))
    if not values:
        return f"<p>{name}: no values in this run.</p>"
    low, high, log = _range(values, plot["unit"])
    place = math.log10 if log else float

    def x(at: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * (at - t[0]) / ((t[-1] - t[0]) or 1.0)

    def y(at: float) -> float:
        share = (place(min(max(at, low), high)) - place(low)) / (place(high) - place(low))
        return TOP + (HEIGHT - TOP - BOTTOM) * (1.0 - share)

    lines = []
    for tick in decades(low, high) if log else ticks(low, high):
        lines.append(f'<path class="grid" d="M{LEFT} {y(tick):.1f}H{WIDTH - RIGHT}"/>')
        lines.append(
            f'<text x="{LEFT - 5}" y="{y(tick) + 4:.1f}" text-anchor="end">{tick_label(tick, log)}</text>'
        )
    seconds = ticks(t[0], t[-1])
    for tick in seconds:
        unit = " s" if tick == seconds[-1] else ""
        lines.append(f'<text x="{x(tick):.1f}" y="{HEIGHT - 6}" text-anchor="middle">{tick:.4g}{unit}</text>')
    for kind, at, curve in reversed(list(zip(("own", "ghost"), times, curves, strict=False))):
        path = path_through([(x(s), y(v)) if v is not None else None for s, v in zip(at, curve, strict=True)])
        lines.append(f'<path class="{kind}" d="{path}"/>' if path else "")
    return (
        f'<p class="what">{name}</p><svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{name}">'
        + "".join(lines)
        + "</svg>"
    )


def _values(plot: Mapping[str, Any]) -> list[float]:
    return [v for curve in plot["curves"] for v in curve if v is not None]


def _floor_words(plot: Mapping[str, Any]) -> str:
    """Returns a sentence about the values that are below the lower end of the axis; "" if there are none."""
    values, unit = _values(plot), plot["unit"]
    if not values:
        return ""
    low, _, log = _range(values, unit)
    end = f"{tick_label(low, log)} {unit}"
    return f"Below {end} a curve is drawn at {end}." if log and min(values) < low else ""


def _range(values: Sequence[float], unit: str) -> tuple[float, float, bool]:
    """Returns the lower end, the upper end, and whether the axis is logarithmic."""
    low, high = min(values), max(values)
    floor = FLOORS.get(unit, 0.0)
    most = max(sorted(values)[math.floor(_MOST * len(values))], floor)
    if most > 0 and low >= 0 and high > _DECADES * most:
        return floor if low < floor else low or most, high, True
    margin = 0.05 * (high - low) or 0.5 * abs(high) or 1.0
    return (0.0 if 0 <= low < 0.5 * high else low - margin), high + margin, False
