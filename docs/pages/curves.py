"""Curves of a recorded step as SVG: they take the page's colours, light and dark, and its width."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

WIDTH, HEIGHT = 640, 150
LEFT, RIGHT, TOP, BOTTOM = 58, 8, 8, 22
_DECADES = 300.0
"""Values that span more than this factor, all positive, are drawn on a logarithmic axis."""


def figure(step: Mapping[str, Any], ghost: str | None) -> str:
    """All plots of a step, below each other, and the legend if there is a ghost."""
    drawn = "".join(_plot(each) for each in step["plots"])
    words = "The recorded run." + (f" Dashed: the ghost, {escape(ghost)}." if ghost else "")
    return f'<figure class="curves">{drawn}<figcaption>{words}</figcaption></figure>'


def _plot(plot: Mapping[str, Any]) -> str:
    t, curves = plot["t"], plot["curves"]
    values = [v for curve in curves for v in curve if v is not None]
    name = escape(plot["words"] + (f", {plot['unit']}" if plot["unit"] else ""))
    if not values or not t:
        return f"<p>{name}: nothing to see in this run.</p>"
    low, high, log = _range(values)
    place = math.log10 if log else float

    def x(at: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * (at - t[0]) / ((t[-1] - t[0]) or 1.0)

    def y(at: float) -> float:
        share = (place(min(max(at, low), high)) - place(low)) / (place(high) - place(low))
        return TOP + (HEIGHT - TOP - BOTTOM) * (1.0 - share)

    lines = []
    for tick in _decades(low, high) if log else ticks(low, high):
        lines.append(f'<path class="grid" d="M{LEFT} {y(tick):.1f}H{WIDTH - RIGHT}"/>')
        lines.append(f'<text x="{LEFT - 5}" y="{y(tick) + 4:.1f}" text-anchor="end">{tick:.4g}</text>')
    for tick in ticks(t[0], t[-1]):
        # The unit stands at the last one.
        unit = " s" if tick + ticks(t[0], t[-1])[1] - ticks(t[0], t[-1])[0] > t[-1] + 1e-9 else ""
        lines.append(f'<text x="{x(tick):.1f}" y="{HEIGHT - 6}" text-anchor="middle">{tick:.4g}{unit}</text>')
    for kind, curve in zip(("ghost", "own"), reversed([*curves, []][:2]), strict=True):
        path = _path([(x(at), y(v)) if v is not None else None for at, v in zip(t, curve, strict=False)])
        lines.append(f'<path class="{kind}" d="{path}"/>' if path else "")
    return (
        f'<p class="what">{name}</p><svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{name}">'
        + "".join(lines)
        + "</svg>"
    )


def _path(points: Sequence[tuple[float, float] | None]) -> str:
    parts, pen = [], "M"
    for point in points:
        if point is None:
            pen = "M"
            continue
        parts.append(f"{pen}{point[0]:.1f} {point[1]:.1f}")
        pen = "L"
    return "".join(parts)


def _range(values: Sequence[float]) -> tuple[float, float, bool]:
    """Least, greatest, and whether logarithmic."""
    low, high = min(values), max(values)
    if low > 0 and high > _DECADES * low:
        return max(low, high * 1e-8), high, True
    margin = 0.05 * (high - low) or 0.5 * abs(high) or 1.0
    return (0.0 if 0 <= low < 0.5 * high else low - margin), high + margin, False


def ticks(low: float, high: float, about: int = 4) -> list[float]:
    """Round numbers between two."""
    raw = (high - low) / about
    unit = 10.0 ** math.floor(math.log10(raw))
    step = next(unit * k for k in (1, 2, 5, 10) if unit * k >= raw)
    return [
        round(k * step, 12) for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)
    ]


def _decades(low: float, high: float) -> list[float]:
    found = [10.0**k for k in range(math.ceil(math.log10(low)), math.floor(math.log10(high)) + 1)]
    return found[:: -(-len(found) // 5)]
