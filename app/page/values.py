"""The values that a browser may write into the page's controls."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import viser

LONGEST = 200_000
"""Largest number of characters of a text."""


class NotAllowed(Exception):
    """A value is refused; the message says which value and why."""


def allowed(handle: viser.GuiInputHandle[Any], updates: Any) -> Any:
    """Returns the value of an update; a slider's value is limited to its range. Raises NotAllowed if the
    update changes more than the value, or if the control cannot have this value."""
    label = str(getattr(handle, "label", "") or "A control")
    if not isinstance(updates, dict) or list(updates) != ["value"]:
        raise NotAllowed(f"{label}: a page can only change the value of this control.")
    value = updates["value"]
    if isinstance(handle, viser.GuiUploadButtonHandle):
        raise NotAllowed(f"{label}: upload a file instead of writing a value.")
    options = getattr(handle, "options", None)
    if options is not None:
        if not isinstance(value, str) or value not in options:
            raise NotAllowed(f"{label}: choose one of {', '.join(map(str, options))[:300]}.")
        return value
    value = _like(handle.value, value, label)
    low, high = getattr(handle, "min", None), getattr(handle, "max", None)
    if isinstance(handle, viser.GuiSliderHandle):
        return min(max(value, low), high)
    return _within(value, low, high, label)


def _like(present: Any, value: Any, label: str) -> Any:
    """Returns the value if it has the type of the present value; raises NotAllowed otherwise."""
    match present:
        case bool():
            if isinstance(value, bool):
                return value
            raise NotAllowed(f"{label}: give True or False.")
        case int() | float():
            return _number(value, label)
        case str():
            if isinstance(value, str) and len(value) <= LONGEST:
                return value
            raise NotAllowed(f"{label}: give a text of at most {LONGEST} characters.")
        case tuple():
            if isinstance(value, (list, tuple)) and len(value) == len(present):
                return tuple(_like(old, new, label) for old, new in zip(present, value, strict=True))
            raise NotAllowed(f"{label}: give {len(present)} numbers.")
        case _:
            raise NotAllowed(f"{label}: the page cannot change this control.")


def _number(value: Any, label: str) -> int | float:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    # A whole number may be too large for a float.
    if number and abs(value) <= 1e300 and math.isfinite(value):
        return value
    raise NotAllowed(f"{label}: give a number.")


def _within(value: Any, low: Any, high: Any, label: str) -> Any:
    for one, least, most in zip(_each(value), _ends(low), _ends(high), strict=False):
        if (least is not None and one < least) or (most is not None and one > most):
            ends = [f"at least {low}"] * (low is not None) + [f"at most {high}"] * (high is not None)
            raise NotAllowed(f"{label}: give {' and '.join(ends)}.")
    return value


def _each(value: Any) -> Iterable[Any]:
    return value if isinstance(value, tuple) else (value,)


def _ends(end: Any) -> Iterable[Any]:
    return end if isinstance(end, tuple) else (end,) * 4
