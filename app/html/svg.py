"""The drawing kit: SVG elements, paths through points, and round ticks with their labels."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from app.html.text import esc, power_of_ten


def element(tag: str, inner: str = "", **attributes: object) -> str:
    """Returns an SVG element. In the names of attributes, an underscore stands for a hyphen. Numbers get one
    digit after the decimal point. An attribute without a value (None) is left out."""
    given = "".join(
        f' {name.rstrip("_").replace("_", "-")}="{round(value, 1) if isinstance(value, float) else value}"'
        for name, value in attributes.items()
        if value is not None
    )
    return f"<{tag}{given}>{inner}</{tag}>" if inner else f"<{tag}{given}/>"


def path(d: str, **attributes: Any) -> str:
    return element("path", d=d, **attributes)


def text(x: float, y: float, words: str, anchor: str = "start", **attributes: Any) -> str:
    """Returns a text at a point; names in it may come from a file."""
    return element("text", esc(words), x=float(x), y=float(y), text_anchor=anchor, **attributes)


def picture(width: float, height: float, words: str, inner: str, style: str = "display:block") -> str:
    """Returns a picture as wide as its panel. words: for people who do not see it."""
    return element(
        "svg",
        inner,
        viewBox=f"0 0 {width:g} {height:g}",
        width="100%",
        role="img",
        aria_label=esc(words),
        style=style,
        font_size=11,
        font_family="inherit",
    )


def round_step(step: float) -> float:
    """Returns the next larger number of the form 1, 2 or 5 times a power of ten."""
    scale = 10.0 ** math.floor(math.log10(step))
    return next(scale * digit for digit in (1.0, 2.0, 5.0, 10.0) if scale * digit >= step - 1e-12 * scale)


def ticks(low: float, high: float, about: int = 4) -> list[float]:
    step = round_step((high - low) / about)
    return [
        round(k * step, 12) for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)
    ]


def powers_of_ten(low: float, high: float) -> list[float]:
    """Returns the powers of ten between two values above 0."""
    first, last = math.ceil(math.log10(low) - 1e-9), math.floor(math.log10(high) + 1e-9)
    return [10.0**k for k in range(first, last + 1)]


def decades(low: float, high: float) -> list[float]:
    """Returns at most five powers of ten between two values above 0."""
    found = powers_of_ten(low, high)
    return found[:: -(-len(found) // 5) or 1]


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
