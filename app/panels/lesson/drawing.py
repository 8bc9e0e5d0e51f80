"""Small SVG pictures: a guess on a scale, a signal over the run, a sketched curve."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from app.html.palette import BOUND, DARK_PAGE, GOOD, LEVELS, LIGHT_PAGE, RGB, css, ink
from app.html.svg import decades, element, path, path_through, picture, powers_of_ten, text, tick_label, ticks
from app.html.text import esc, figure
from app.link.exercise import SignalCurve

_W = 360  # width of every picture in its own units; a picture is scaled to the panel
_WIDE, _LINE = 6.2, 12.0  # width of a letter and height of a line
_PAGE = f"light-dark({css(LIGHT_PAGE)},{css(DARK_PAGE)})"
_STRIPS = 60
_AT = "<style>.hl-at>g{display:none}.hl-at:hover>g{display:inline}</style>"
GUESS, TRUTH = LEVELS[0], LEVELS[1]


def scale(low: float, high: float, guess: float | None, truth: float | None, factor: float, unit: str) -> str:
    """Returns a logarithmic scale with the guess, the measured value, and the range of right answers."""

    def x(value: float) -> float:
        share = math.log(max(value, 1e-300) / low) / math.log(high / low)
        return 14 + (_W - 28) * min(max(share, -0.02), 1.02)

    parts = [path(f"M14 34H{_W - 14}", stroke="currentColor", stroke_width=1.5)]
    for power in powers_of_ten(low, high):
        parts.append(path(f"M{x(power):.1f} 30V38", stroke="currentColor"))
        parts.append(_text(x(power), 51, figure(power), anchor="middle"))
    if truth is not None and math.isfinite(truth) and truth > 0:
        left, right = x(truth / factor), x(truth * factor)
        parts.append(element("rect", x=left, width=right - left, y=26, height=16, fill=css(GOOD, 0.25)))
        parts.append(_pointer(x(truth), 34, 60, TRUTH))
        parts.append(_text(x(truth), 72, f"measured {figure(truth, unit)}", TRUTH, "middle", bold=True))
    if guess is not None:
        parts.append(_pointer(x(guess), 34, 14, GUESS))
        parts.append(_text(x(guess), 11, f"your guess {figure(guess, unit)}", GUESS, "middle", bold=True))
    return _svg(78, parts, "your guess on a logarithmic scale")


@dataclass(frozen=True)
class Line:
    """A curve of a chart. name: what is written at its end; "" for nothing."""

    name: str
    colour: RGB
    curve: SignalCurve
    dashes: str = "none"


@dataclass(frozen=True)
class Bound:
    """A horizontal line in a chart, in the unit of its curves.

    Attributes:
        value: its height.
        label: what is written at its right end.
        words: its explanation.
        after, until: the part of the run for which it holds, s.
    """

    value: float
    label: str
    words: str
    after: float = 0.0
    until: float = math.inf


def chart(
    words: str,
    unit: str,
    lines: Sequence[Line],
    bounds: Sequence[Bound],
    marks: Sequence[tuple[float, str]],
    until: float,
    height: int,
    over: bool = True,
) -> str:
    """Returns the chart of a signal over the run; "" if there is nothing to draw. The last line is drawn
    first.

    Args:
        words, unit: the title.
        lines: the curves.
        bounds: horizontal lines.
        marks: times, s, at which something happens, and what happens.
        until: the end of the time axis, s.
        height: of the chart, in units of which `_W` are the width.
        over: whether the run is over, so that values can be read with the mouse.
    """
    values = np.concatenate([line.curve.values[np.isfinite(line.curve.values)] for line in lines])
    if not values.size:
        return ""
    bounds = [bound for bound in bounds if math.isfinite(bound.value)]
    axis = _axis(values, [bound.value for bound in bounds])
    frame = _Frame(axis, until, height, top=34 if any(words for _, words in marks) else 22, left=40)
    log = " · logarithmic" if axis[2] else ""
    parts = [_text(0, 14, f"{words}{f' [{unit}]' if unit else ''}{log}", bold=True), *frame.axes()]
    parts += frame.marks(marks)
    for bound in bounds:
        y, left, right = frame.y(bound.value), frame.x(bound.after), frame.x(min(bound.until, until))
        look = {"stroke": css(GOOD), "stroke_width": 1.5, "stroke_dasharray": "2 3"}
        line = f"M{left:.1f} {y:.1f}H{right:.1f}"
        parts.append(element("path", element("title", esc(bound.words)), d=line, **look))
    parts += [frame.line(line.curve, line.colour, line.dashes) for line in reversed(lines)]
    named = [(frame.y(bound.value) - 4, bound.label, GOOD) for bound in bounds]
    named += [(frame.end(line.curve) - 5, line.name, line.colour) for line in lines if line.name]
    readings = frame.readings(lines, unit) if over else []
    return _svg(height, [*parts, *frame.names(named), *readings], f"{words} over time")


def sketch(
    low: float,
    high: float,
    until: float,
    points: Sequence[tuple[float, float]],
    truth: SignalCurve | None,
    unit: str,
) -> str:
    """Returns the curve that the learner draws, with the measured curve over it."""
    frame = _Frame((low, high, False), until, height=150, top=18, left=40)
    times, values = (np.array(column, float) for column in zip(*points, strict=True))
    parts = [
        *frame.axes(),
        _text(0, 11, f"[{unit}]" if unit else "", bold=True),
        _text(frame.left, 11, "your sketch", GUESS, bold=True),
        frame.line(SignalCurve(times, values), GUESS, "6 3"),
        *(element("circle", cx=frame.x(t), cy=frame.y(v), r=3.5, fill=css(GUESS)) for t, v in points),
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
        return self._floor - (self._floor - self.top) * min(max(share, 0.0), 1.0)

    @property
    def _floor(self) -> float:
        return self.height - 16

    def axes(self) -> list[str]:
        """Returns the two axes with their ticks, and a light grid."""
        low, high, log = self.axis
        levels = decades(10.0**low, 10.0**high) if log else ticks(low, high)
        seconds = ticks(0.0, self.until, 5)
        grid = "".join(f"M{self.left} {self.y(level):.1f}H{_W - 6}" for level in levels)
        grid += "".join(f"M{self.x(t):.1f} {self.top}V{self._floor}" for t in seconds)
        parts = [
            path(grid, stroke=css(BOUND, 0.25)),
            path(f"M{self.left} {self.top}V{self._floor}H{_W - 6}", stroke=css(BOUND), fill="none"),
        ]
        for level in levels:
            parts.append(_text(self.left - 4, self.y(level) + 4, tick_label(level, log), anchor="end"))
        for t in seconds:
            last = t == seconds[-1]
            words = f"{tick_label(t, False)}{' s' if last else ''}"
            parts.append(_text(self.x(t), self.height - 3, words, anchor="middle"))
        return parts

    def marks(self, marks: Sequence[tuple[float, str]]) -> list[str]:
        """Returns a vertical line at each time, with what happens above it as far as there is room."""
        parts, free = [], -math.inf
        for t, words in marks:
            x = self.x(t)
            line = f"M{x:.1f} {self.top}V{self._floor}"
            parts.append(path(line, stroke=css(BOUND), stroke_dasharray="4 3"))
            width = _WIDE * (len(words) + 2)
            left = min(x - 4, _W - 4 - width)
            if words and left > free:
                parts.append(_text(left, self.top - 4, f"▾ {words}"))
                free = left + width + 12
        return parts

    def end(self, curve: SignalCurve) -> float:
        """Returns the height at which the known part of a curve ends."""
        known = np.flatnonzero(np.isfinite(curve.values))
        return self.y(float(curve.values[known[-1]])) if known.size else self._floor

    def names(self, named: Sequence[tuple[float, str, RGB]]) -> list[str]:
        """Returns names at the right end, each at its height or as close to it as there is room."""
        parts, free = [], -math.inf
        below = sorted(named)
        for k, (y, words, colour) in enumerate(below):
            # The names below this one need room as well.
            y = max(min(y, self._floor - 4 - _LINE * (len(below) - 1 - k)), free, self.top + 9)
            parts.append(_text(_W - 8, y, words, colour, "end", bold=True, halo=True))
            free = y + _LINE
        return parts

    def readings(self, lines: Sequence[Line], unit: str) -> list[str]:
        """Returns vertical strips. While the mouse is over a strip, it shows its time and the values of the
        curves."""
        parts, wide = [_AT], (_W - self.left - 6) / _STRIPS
        known = [line for line in lines if len(line.curve.t)]
        for k in range(_STRIPS):
            t, x = (k + 0.5) * self.until / _STRIPS, self.left + k * wide
            found = [line.curve.values[np.abs(line.curve.t - t).argmin()] for line in known]
            if not known or t > max(line.curve.t[-1] for line in known):
                break
            values = ", ghost ".join(figure(float(value), unit) for value in found)
            words = f"{t:.2f} s: {values}"
            half = 0.5 * _WIDE * len(words)
            left = min(max(x - half, self.left), _W - 6 - 2 * half)
            size: dict[str, Any] = {"width": wide, "height": self._floor - self.top}
            strip = element("rect", x=x, y=self.top, **size, fill="transparent")
            reading = path(f"M{x + wide / 2:.1f} {self.top}V{self._floor}", stroke="currentColor")
            reading += _text(left, self.top + 11, words, bold=True, halo=True)
            parts.append(element("g", strip + element("g", reading), class_="hl-at"))
        return parts

    def line(self, curve: SignalCurve, colour: RGB, dashes: str = "none") -> str:
        """Returns a curve, with gaps where it is not finite."""
        points = path_through(
            (self.x(t), self.y(value)) if math.isfinite(value) else None
            for t, value in zip(curve.t.tolist(), curve.values.tolist(), strict=True)
        )
        look = {"stroke_width": 2, "fill": "none", "stroke_linejoin": "round", "stroke_dasharray": dashes}
        return path(points, stroke=css(colour), **look)


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


def _pointer(x: float, tip: float, foot: float, colour: RGB) -> str:
    d = 5 if foot > tip else -5
    head = path(f"M{x:.1f} {tip}L{x - 5:.1f} {tip + 2 * d}H{x + 5:.1f}Z", fill=css(colour))
    return head + path(f"M{x:.1f} {tip}V{foot}", stroke=css(colour), stroke_width=2)


def _text(
    x: float,
    y: float,
    words: str,
    colour: RGB | None = None,
    anchor: str = "start",
    bold: bool = False,
    halo: bool = False,
) -> str:
    """halo: whether the words have a rim in the colour of the page, so that they can be read on a curve."""
    half = 0.5 * _WIDE * len(words)  # a centred label near an edge would be cut off
    x = min(max(x, half + 2), _W - half - 2) if anchor == "middle" else x
    rim = {"stroke": _PAGE, "stroke_width": 3, "paint_order": "stroke"} if halo else {}
    fill = "currentColor" if colour is None else ink(colour)
    return text(x, y, words, anchor, fill=fill, font_weight=600 if bold else None, **rim)


def _svg(height: float, parts: Sequence[str], words: str) -> str:
    return picture(_W, height, words, "".join(parts))
