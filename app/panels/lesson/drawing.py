"""Small SVG pictures: a guess on a scale, a signal over the run, a sketched curve."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from app.html.palette import BOUND, GOOD, LEVELS, RGB, css, ink
from app.html.text import esc, figure
from app.link.exercise import SignalCurve

_W = 360  # width of every picture in its own units; a picture is scaled to the panel
GUESS, TRUTH = LEVELS[0], LEVELS[1]


def scale(low: float, high: float, guess: float | None, truth: float | None, factor: float, unit: str) -> str:
    """Returns a logarithmic scale with the guess, the measured value, and the range of right answers."""

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
    """A horizontal reference line for a curve, in the curve's unit."""

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
    """Returns the chart of a signal over the run, with the ghost's curve (dashed) and reference lines
    (dotted)."""
    shown = [curve.values, *([ghost.values] if ghost is not None else [])]
    values = np.concatenate([each[np.isfinite(each)] for each in shown])
    if not values.size:
        return ""
    marks = [bound.value for bound in bounds if math.isfinite(bound.value)]
    axis = _axis(values, marks)
    frame = _Frame(axis, until, height=92, top=18, left=54)
    log = " · logarithmic" if axis[2] else ""
    parts = [
        _text(frame.left, 11, f"{words}{f' [{unit}]' if unit else ''}{log}", bold=True),
        *frame.axes(_end(axis, 0), _end(axis, 1)),
    ]
    for value, bound in zip(marks, bounds, strict=False):
        y = frame.y(value)
        parts.append(
            f'<line x1="{frame.left}" x2="{_W - 6}" y1="{y:.1f}" y2="{y:.1f}" stroke="{css(GOOD)}" '
            f'stroke-width="1.5" stroke-dasharray="2 3"><title>{esc(bound.words)}</title></line>'
        )
    if ghost is not None:
        parts.append(frame.line(ghost, BOUND, "5 4"))
    return _svg(frame.height, [*parts, frame.line(curve, TRUTH)], f"{words} over time")


def sketch(
    low: float,
    high: float,
    until: float,
    points: Sequence[tuple[float, float]],
    truth: SignalCurve | None,
    unit: str,
) -> str:
    """Returns the curve that the learner draws, with the measured curve over it."""
    frame = _Frame((low, high, False), until, height=130, top=16, left=40)
    times, values = (np.array(column, float) for column in zip(*points, strict=True))
    parts = [
        *frame.axes(figure(low), figure(high, unit)),
        _text(frame.left, 11, "your sketch", GUESS, bold=True),
        frame.line(SignalCurve(times, values), GUESS, "6 3"),
        *(
            f'<circle cx="{frame.x(t):.1f}" cy="{frame.y(v):.1f}" r="3.5" fill="{css(GUESS)}"/>'
            for t, v in points
        ),
    ]
    if truth is not None:
        inside = truth.t <= until
        parts.append(frame.line(SignalCurve(truth.t[inside], truth.values[inside]), TRUTH))
        parts.append(_text(frame.left + 90, 11, "measured", TRUTH, bold=True))
    return _svg(frame.height, parts, "your sketch over time")


# -------------------------------------------------------------------- pieces

Axis = tuple[float, float, bool]  # low, high, logarithmic


class _Frame(NamedTuple):
    """A picture with a time axis, 0 … `until` s, and the elements in the picture."""

    axis: Axis
    until: float
    height: int
    top: int
    left: int

    def x(self, t: float) -> float:
        return self.left + (_W - self.left - 6) * t / self.until

    def y(self, value: float) -> float:
        low, high, log = self.axis
        value = math.log10(max(value, 10.0 ** (low - 1))) if log else value
        share = (value - low) / (high - low)
        return self.height - 14 - (self.height - 14 - self.top) * min(max(share, 0.0), 1.0)

    def axes(self, low: str, high: str) -> list[str]:
        """Returns the axes, with the labels of their ends."""
        corner = f"M{self.left} {self.top}V{self.height - 14}H{_W - 6}"
        return [
            f'<path d="{corner}" stroke="{css(BOUND)}" fill="none"/>',
            _text(self.left - 4, self.height - 12, low, anchor="end"),
            _text(self.left - 4, self.top + 8, high, anchor="end"),
            _text(_W - 6, self.height - 2, f"{self.until:g} s", anchor="end"),
        ]

    def line(self, curve: SignalCurve, colour: RGB, dashes: str = "none") -> str:
        """Returns a curve, with gaps where it is not finite."""
        pieces, pen = [], "M"
        for t, value in zip(curve.t.tolist(), curve.values.tolist(), strict=True):
            if not math.isfinite(value):
                pen = "M"
                continue
            pieces.append(f"{pen}{self.x(t):.1f} {self.y(value):.1f}")
            pen = "L"
        return (
            f'<path d="{"".join(pieces)}" stroke="{css(colour)}" stroke-width="2" fill="none" '
            f'stroke-linejoin="round" stroke-dasharray="{dashes}"/>'
        )


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


def _end(axis: Axis, which: int) -> str:
    return figure(10.0 ** axis[which] if axis[2] else float(f"{axis[which]:.2g}"))


def _pointer(x: float, tip: float, foot: float, colour: RGB) -> str:
    d = 5 if foot > tip else -5
    return (
        f'<path d="M{x:.1f} {tip}L{x - 5:.1f} {tip + 2 * d}H{x + 5:.1f}Z" fill="{css(colour)}"/>'
        f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{tip}" y2="{foot}" stroke="{css(colour)}" stroke-width="2"/>'
    )


def _text(
    x: float, y: float, words: str, colour: RGB | None = None, anchor: str = "start", bold: bool = False
) -> str:
    # A centred label near an edge would be cut off.
    half = 3.1 * len(words)
    x = min(max(x, half + 2), _W - half - 2) if anchor == "middle" else x
    weight = ' font-weight="600"' if bold else ""
    fill = "currentColor" if colour is None else ink(colour)
    return f'<text x="{x:.1f}" y="{y}" fill="{fill}" text-anchor="{anchor}"{weight}>{esc(words)}</text>'


def _svg(height: float, parts: Sequence[str], words: str) -> str:
    return (
        f'<svg viewBox="0 0 {_W} {height}" width="100%" role="img" aria-label="{esc(words)}" '
        f'style="display:block" font-size="11" font-family="inherit">{"".join(parts)}</svg>'
    )
