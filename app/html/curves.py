"""Pieces of curves that are drawn as SVG: round ticks with their labels, and paths."""

from __future__ import annotations

import math
from collections.abc import Iterable

from app.html.text import power_of_ten


def round_step(step: float) -> float:
    """Returns the next larger number of the form 1, 2 or 5 times a power of ten."""
    scale = 10.0 ** math.floor(math.log10(step))
    return next(scale * digit for digit in (1.0, 2.0, 5.0, 10.0) if scale * digit >= step - 1e-12 * scale)


def ticks(low: float, high: float, about: int = 4) -> list[float]:
    """Returns round numbers between two values."""
    step = round_step((high - low) / about)
    return [
        round(k * step, 12) for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)
    ]


def decades(low: float, high: float, most: int = 5) -> list[float]:
    """Returns at most `most` powers of ten between two values above 0."""
    found = [
        10.0**k for k in range(math.ceil(math.log10(low) - 1e-9), math.floor(math.log10(high) + 1e-9) + 1)
    ]
    return found[:: -(-len(found) // most) or 1]


def tick_label(tick: float, log: bool) -> str:
    """Returns the text of a tick; on a logarithmic axis a power of ten if that is shorter."""
    power = round(math.log10(tick)) if log else 0
    if -3 < power < 4:
        return f"{tick:.4g}".replace("-", "−")
    return power_of_ten(power)


def path_through(points: Iterable[tuple[float, float] | None]) -> str:
    """Returns the data of a path through points; None is a gap."""
    parts, pen = [], "M"
    for point in points:
        if point is None:
            pen = "M"
            continue
        parts.append(f"{pen}{point[0]:.1f} {point[1]:.1f}")
        pen = "L"
    return "".join(parts)
