"""Allowed ranges of numbers in settings. A range is written once, in the type annotation of the field."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

from robots.errors import InputError, unknown_name


@dataclass(frozen=True)
class Range:
    """The range of every number of a field: `horizon: Annotated[int, Range(1, 60)]`. Numbers must always be
    finite.

    Attributes:
        low, high: the least and the greatest allowed number.
        above: whether `low` itself is excluded.
    """

    low: float = -math.inf
    high: float = math.inf
    above: bool = False

    def holds(self, value: float) -> bool:
        """Returns whether a number is allowed."""
        return (
            math.isfinite(value) and self.low <= value <= self.high and not (self.above and value == self.low)
        )

    def __str__(self) -> str:
        """Returns the range for messages: "from 1 to 60", "above 0", nothing if every number is allowed."""
        if math.isfinite(self.low) and math.isfinite(self.high):
            return f"{'above' if self.above else 'from'} {self.low:g} to {self.high:g}"
        if math.isfinite(self.low):
            return f"{'above' if self.above else 'of at least'} {self.low:g}"
        return f"of at most {self.high:g}" if math.isfinite(self.high) else ""


ANY = Range()


def plain(hint: Any) -> tuple[Any, Range]:
    """Splits a type annotation into the type and the range."""
    if get_origin(hint) is not Annotated:
        return hint, ANY
    inner, *extras = get_args(hint)
    return inner, next((each for each in extras if isinstance(each, Range)), ANY)


def alternatives(hint: Any) -> tuple[Any, ...]:
    """Returns the members of a union type; any other type is returned alone."""
    return get_args(hint) if get_origin(hint) in (UnionType, Union) else (hint,)


@cache
def field_types(owner: type) -> dict[str, Any]:
    """Returns the type annotations of a dataclass by field, ranges included."""
    return get_type_hints(owner, include_extras=True)


def check_fields(owner: Any, prefix: str = "") -> None:
    """Raises InputError if a number of a dataclass is outside its range or a word is not in its Literal. The
    message names the field and the allowed values. Fields without range and Literal are not checked.

    Args:
        owner: the dataclass.
        prefix: prefix of the names in messages, such as "limits.".
    """
    for name, hint in field_types(type(owner)).items():
        inner, allowed = plain(hint)
        value = getattr(owner, name)
        if get_origin(inner) is Literal:
            if value not in get_args(inner):
                raise unknown_name(prefix + name, str(value), get_args(inner))
        elif allowed is not ANY and not (value is None and type(None) in alternatives(inner)):
            check_numbers(prefix + name, value, allowed, whole=int in alternatives(inner))


def check_numbers(name: str, value: Any, allowed: Range, whole: bool = False) -> None:
    """Raises InputError if a value, or an element of a list, is not a number inside the range."""
    several = isinstance(value, (list, tuple, np.ndarray))
    for each in np.ravel(np.asarray(value, dtype=object)) if several else (value,):
        number = isinstance(each, (int, float, np.integer, np.floating)) and not isinstance(each, bool)
        # An integer may be too large for a float.
        if not number or abs(each) > 1e300 or not allowed.holds(float(each)):
            what = "whole number" if whole else "number"
            give = f"numbers {allowed}" if several else f"a {what} {allowed}"
            raise InputError(f"{name} is {_quoted(value)}: give {give.strip()}")


def _quoted(value: Any) -> str:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    text = repr(list(value)) if isinstance(value, tuple) else repr(value)
    return text if len(text) <= 80 else text[:60] + " …"
