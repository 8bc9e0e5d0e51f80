"""Small SVG pictures: a guess on a scale, a signal over the run, a sketched curve."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from app.html.palette import BOUND, GOOD, LEVELS, css
from app.html.text import esc, figure
from app.link.exercise import SignalCurve

_W = 360  # units of every picture's width; it scales with the panel
GUESS, TRUTH = css(LEVELS[0]), css(LEVELS[1])


def scale(low: float, high: float, guess: float | None, truth: float | None, factor: float, unit: str) -> str:
    """A logarithmic scale with the guess, the measured value, and the range of right answers."""

    def x(value: float) -> float:
        share = math.log(max(value, 1e-300) / low) / math.log(high / low)
        return 14 + (_W - 28) * min(max(share, -0.02), 1.02)

    parts = [f'<line x1="14" x2="{_W - 14}" y1="34" y2="34" stroke="currentColor" stroke-width="1.5"/>']
    for power in range(math.ceil(math.log10(low) - 1e-9), math.floor(math.log10(high) + 1e-9) + 1):
        at = x(10.0**power)
        parts.append(f'<line x1="{at:.1f}" x2="{at:.1f}" y1="30" y2="38" stroke="currentColor"/>')
        parts.append(_text(at, 51, figure(10.0**power), anchor="middle"))
    if truth is not None and math.isfinite(truth) and truth > 0:
        left, right = x(truth / factor), x(truth * factor)
        parts.append(
            f'<rect x="{left:.1f}" width="{right - left:.1f}" y="26" height="16" fill="{css(GOOD, 0.25)}"/>'
        )
        parts.append(_pointer(x(truth), 34, 60, TRUTH))
        parts.append(_text(x(truth), 72, f"measured {figure(truth, unit)}", TRUTH, "middle", bold=True))
    if guess is not None:
        parts.append(_pointer(x(guess), 34, 14, GUESS))
        parts.append(_text(x(guess), 11, f"your guess {figure(guess, unit)}", GUESS, "middle", bold=True))
    return _svg(78, parts, "your guess on a logarithmic scale")


@dataclass(frozen=True)
class Bound:
    """A reference level for a curve, in the curve's unit."""

    value: float
    words: str


def chart(
    words: str,
    unit: str,
    curve: SignalCurve,
    ghost: SignalCurve | None,
    bounds: Sequence[Bound],
    until: float,
) -> str:
    """A signal over the run, with the ghost's curve (dashed) and its reference levels (dotted)."""
    height, top, left = 92, 18, 54
    shown = [curve.values, *([ghost.values] if ghost is not None else [])]
    values = np.concatenate([each[np.isfinite(each)] for each in shown])
    if not values.size:
        return ""
    marks = [bound.value for bound in bounds if math.isfinite(bound.value)]
    axis = _axis(values, marks)

    def points(of: SignalCurve) -> str:
        return _polyline(
            of, lambda t: left + (_W - left - 6) * t / until, lambda v: _height(v, axis, top, height)
        )

    log = " · logarithmic" if axis[2] else ""
    parts = [
        _text(left, 11, f"{words}{f' [{unit}]' if unit else ''}{log}", bold=True),
        f'<path d="M{left} {top}V{height - 14}H{_W - 6}" stroke="{css(BOUND)}" fill="none"/>',
        _text(left - 4, height - 12, _end(axis, 0), anchor="end"),
        _text(left - 4, top + 8, _end(axis, 1), anchor="end"),
        _text(_W - 6, height - 2, f"{until:g} s", anchor="end"),
    ]
    for value, bound in zip(marks, bounds, strict=False):
        y = _height(value, axis, top, height)
        parts.append(
            f'<line x1="{left}" x2="{_W - 6}" y1="{y:.1f}" y2="{y:.1f}" stroke="{css(GOOD)}" '
            f'stroke-width="1.5" stroke-dasharray="2 3"><title>{esc(bound.words)}</title></line>'
        )
    if ghost is not None:
        parts.append(f'<path d="{points(ghost)}" {_line(css(BOUND))} stroke-dasharray="5 4"/>')
    parts.append(f'<path d="{points(curve)}" {_line(TRUTH)}/>')
    return _svg(height, parts, f"{words} over time")


def sketch(
    low: float,
    high: float,
    until: float,
    points: Sequence[tuple[float, float]],
    truth: SignalCurve | None,
    unit: str,
) -> str:
    """The curve that the learner draws, with the measured one over it."""
    height, top, left = 130, 16, 40
    axis = (low, high, False)

    def place(of: SignalCurve) -> str:
        return _polyline(
            of, lambda t: left + (_W - left - 8) * t / until, lambda v: _height(v, axis, top, height)
        )

    times, values = (np.array(column, float) for column in zip(*points, strict=True))
    drawn = SignalCurve(times, values)
    dots = "".join(
        f'<circle cx="{left + (_W - left - 8) * t / until:.1f}" cy="{_height(v, axis, top, height):.1f}" '
        f'r="3.5" fill="{GUESS}"/>'
        for t, v in points
    )
    parts = [
        f'<path d="M{left} {top}V{height - 14}H{_W - 8}" stroke="{css(BOUND)}" fill="none"/>',
        _text(left - 4, height - 12, figure(low), anchor="end"),
        _text(left - 4, top + 8, figure(high, unit), anchor="end"),
        _text(_W - 8, height - 2, f"{until:g} s", anchor="end"),
        _text(left, 11, "your sketch", GUESS, bold=True),
        f'<path d="{place(drawn)}" {_line(GUESS)} stroke-dasharray="6 3"/>{dots}',
    ]
    if truth is not None:
        inside = truth.t <= until
        parts.append(
            f'<path d="{place(SignalCurve(truth.t[inside], truth.values[inside]))}" {_line(TRUTH)}/>'
        )
        parts.append(_text(left + 90, 11, "measured", TRUTH, bold=True))
    return _svg(height, parts, "your sketch over time")


# -------------------------------------------------------------------- pieces

Scaling = Callable[[float], float]
Axis = tuple[float, float, bool]  # low, high, logarithmic


def _axis(values: np.ndarray, marks: list[float]) -> Axis:
    together = np.concatenate([values, marks])
    low, high = float(together.min()), float(together.max())
    above = values[values > 0]
    if low >= 0 and above.size and high > 300 * max(float(np.median(above)), 1e-300):
        least = max(
            min([float(np.quantile(above, 0.02)), *(mark for mark in marks if mark > 0)]), 1e-8 * high
        )
        return math.floor(math.log10(least)), math.ceil(math.log10(high)), True
    low = min(low, 0.0)
    if low > -0.02 * high:
        low = 0.0  # a small negative part would only make the zero line harder to see
    room = 0.06 * (high - low) or 1.0
    return (low if low == 0 else low - room), high + room, False


def _height(value: float, axis: Axis, top: float, height: float) -> float:
    low, high, log = axis
    value = math.log10(max(value, 10.0 ** (low - 1))) if log else value
    share = (value - low) / (high - low)
    return height - 14 - (height - 14 - top) * min(max(share, 0.0), 1.0)


def _end(axis: Axis, which: int) -> str:
    return figure(10.0 ** axis[which] if axis[2] else float(f"{axis[which]:.2g}"))


def _polyline(curve: SignalCurve, x: Scaling, y: Scaling) -> str:
    pieces, pen = [], "M"
    for t, value in zip(curve.t.tolist(), curve.values.tolist(), strict=True):
        if not math.isfinite(value):
            pen = "M"
            continue
        pieces.append(f"{pen}{x(t):.1f} {y(value):.1f}")
        pen = "L"
    return "".join(pieces)


def _line(colour: str) -> str:
    return f'stroke="{colour}" stroke-width="2" fill="none" stroke-linejoin="round"'


def _pointer(x: float, tip: float, foot: float, colour: str) -> str:
    d = 5 if foot > tip else -5
    return (
        f'<path d="M{x:.1f} {tip}L{x - 5:.1f} {tip + 2 * d}H{x + 5:.1f}Z" fill="{colour}"/>'
        f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{tip}" y2="{foot}" stroke="{colour}" stroke-width="2"/>'
    )


def _text(
    x: float, y: float, words: str, colour: str = "currentColor", anchor: str = "start", bold: bool = False
) -> str:
    # A centred label near an edge would be cut off.
    half = 3.1 * len(words)
    x = min(max(x, half + 2), _W - half - 2) if anchor == "middle" else x
    weight = ' font-weight="600"' if bold else ""
    return f'<text x="{x:.1f}" y="{y}" fill="{colour}" text-anchor="{anchor}"{weight}>{esc(words)}</text>'


def _svg(height: float, parts: Sequence[str], words: str) -> str:
    return (
        f'<svg viewBox="0 0 {_W} {height}" width="100%" role="img" aria-label="{esc(words)}" '
        f'style="display:block" font-size="11" font-family="inherit">{"".join(parts)}</svg>'
    )
