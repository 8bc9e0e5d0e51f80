"""Numbers and short pieces of HTML. All names that come from a user or a file pass through `esc`."""

from __future__ import annotations

import html
import itertools
import math
import re
from collections.abc import Sequence
from functools import lru_cache

from latex2mathml.converter import convert

from app.html.palette import BAD, GOOD, RGB, css, on

esc = html.escape


def quantity(value: float, unit: str) -> str:
    """Returns a length in m or an angle in rad, converted to a readable unit with a suitable number of
    digits."""
    if not math.isfinite(value):
        return "–"
    if unit == "m":
        size = abs(value)
        if size < 1e-6:
            return "< 1 µm"
        if size >= 1.0:
            return f"{value:.2f} m"
        return f"{value * 1e6:.0f} µm" if size < 1e-4 else f"{value * 1e3:.{_digits(size * 1e3)}f} mm"
    degrees = math.degrees(value)
    if abs(degrees) < 5e-3:
        return "< 0.01°"
    return f"{degrees:.{max(1, _digits(abs(degrees)))}f}°"


def _digits(size: float) -> int:
    return 0 if size >= 100 else 1 if size >= 10 else 2


def swatch(colour: RGB) -> str:
    return (
        '<span style="display:inline-block;width:0.75em;height:0.75em;border-radius:2px;'
        f'background:{css(colour)};margin-right:0.4em"></span>'
    )


def badge(text: str, colour: RGB) -> str:
    return (
        f'<span style="background:{css(colour)};color:{css(on(colour))};border-radius:4px;padding:0 0.4em;'
        f'font-weight:600;white-space:nowrap">{esc(text)}</span>'
    )


def block(inner: str, style: str = "", lines: int = 0) -> str:
    """Returns a paragraph in the font size of the panel, with room for `lines` lines. The controls below the
    paragraph stay in place as long as its text fits into this room."""
    room = f"min-height:{1.45 * lines + 0.3:g}em;" if lines else ""
    return f'<div style="font-size:0.85em;line-height:1.45;padding:0.15em 0.75em;{room}{style}">{inner}</div>'


def suggestion(head: str, rest: str) -> str:
    """Returns what a page suggests to try, in larger letters, and the sentences about it."""
    return block(f'<div style="font-size:1.15em"><b>{head}</b></div>{rest}', "padding-top:0.5em")


def in_trouble(state: str, sentence: str) -> str:
    """Returns the text that a page shows for a simulation that ended unexpectedly, hangs or takes long."""
    colour = GOOD if state == "PREPARING" else BAD
    return block(
        f"{badge(state, colour)} {esc(sentence)}", f"border-left:3px solid {css(colour)};margin:0.4em 0"
    )


def bar(share: float, colour: RGB, mark: float | None = None) -> str:
    """Returns a horizontal gauge that is filled up to `share` and has a line at `mark`. Both are shares of
    the gauge's width."""
    width = 100 * min(max(share, 0.0), 1.0)
    line = (
        ""
        if mark is None
        else f'<div style="position:absolute;left:{100 * mark:.1f}%;top:-2px;bottom:-2px;width:2px;'
        'background:currentColor"></div>'
    )
    return (
        '<div style="position:relative;height:8px;border-radius:4px;background:rgba(139,149,161,0.25);'
        f'margin:0.25em 0"><div style="width:{width:.1f}%;height:100%;border-radius:4px;'
        f'background:{css(colour)}"></div>{line}</div>'
    )


@lru_cache(maxsize=64)
def formula(latex: str) -> str:
    """Returns a LaTeX formula as MathML that scrolls instead of being cut off."""
    style = "overflow-x:auto;padding:0.3em 0.75em"
    return f'<div tabindex="0" style="{style}">{convert(latex, display="block")}</div>'


def figure(value: float, unit: str = "") -> str:
    """Returns a number with three significant digits and its unit."""
    if not math.isfinite(value):
        return "–"
    size = abs(value)
    if size == 0 or 1e-3 <= size < 1e5:
        number = f"{value:.0f}" if size >= 999.5 else f"{value:.3g}"
    else:
        number = _power(value)
    return _DEGREES.sub("°", f"{number} {unit}".rstrip()).replace("-", "−")


def readable(words: str) -> str:
    """Returns a sentence with all numbers and units in the format of `figure`."""
    return _EXPONENT.sub(lambda found: figure(float(found[0])), _DEGREES.sub("°", words))


def joints_named(words: str) -> str:
    """Returns a text in which every joint has one name: "joint 1" for "joint_1", "joint1" and "q1"."""
    return _JOINT.sub(r"joint \1", words)


def joint_labels(names: Sequence[str]) -> tuple[str, ...]:
    """Returns the names of a robot's joints as the page writes them; as they are if two would be equal."""
    labels = tuple(map(joints_named, names))
    return labels if len(set(labels)) == len(labels) else tuple(names)


_JOINT = re.compile(r"\b(?:joint_?|q)(\d+)\b")
_DEGREES = re.compile(r" deg\b")
_EXPONENT = re.compile(r"-?\d+(?:\.\d+)?e[+-]\d+")
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def _power(value: float) -> str:
    mantissa, _, power = f"{value:.1e}".partition("e")  # rounds first, as the rounding may change the power
    return f"{float(mantissa):g}·{power_of_ten(int(power))}"


def power_of_ten(power: int) -> str:
    return f"10{str(power).translate(_RAISED)}"


def free_name(wanted: str, taken: Sequence[str]) -> str:
    """Returns the requested name, with a number appended if this name is taken."""
    numbered = (wanted if k == 1 else f"{wanted} {k}" for k in itertools.count(1))
    return next(name for name in numbered if name not in taken)
