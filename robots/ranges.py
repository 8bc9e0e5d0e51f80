"""Allowed ranges and descriptions of settings. Both are written once, in the type annotation of the field."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from types import UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

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
SCALE = Range(1e-6, 1e6)
"""The range of a factor on limits, or on M̄."""


@dataclass(frozen=True)
class Shown:
    """The description of a setting for users: `delay_ms: Annotated[float, Range(0.0), Shown("Delay", …)]`. A
    second `Shown` describes one element of a list.

    Attributes:
        label: a few words or a symbol; "*" stands for the name of a level or task, or for a place in a list.
        help: one or two sentences; empty if the label is enough.
        unit: of the value.
        low, high, step: usual range and step of a slider, in `page_unit`; a value outside extends the range.
            step 0: about a hundredth of the range.
        log: whether the slider is logarithmic; then low > 0.
        page_unit: the unit that the page shows instead; empty: `unit`.
        factor: how many `page_unit` are equal to one `unit`.
        tries: typical values for comparisons, as the user types them; the first is rarely a scene's own
            value.
        name: used if no heading names the group; empty: the label.
        group: the folder of the page that contains the control; empty: a panel adds the control by its path,
            or there is none.
    """

    label: str
    help: str = ""
    unit: str = ""
    low: float = 0.0
    high: float = 0.0
    step: float = 0.0
    log: bool = False
    page_unit: str = ""
    factor: float = 1.0
    tries: tuple[str, ...] = ()
    name: str = ""
    group: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", self.name or self.label)

    @property
    def title(self) -> str:
        """The label with the unit that the page shows."""
        unit = self.page_unit or self.unit
        return f"{self.label} [{unit}]" if unit else self.label

    def of(self, what: str) -> Shown:
        """Returns the description with a name, or a place, for "*"."""
        return replace(self, label=self.label.replace("*", what), name=self.name.replace("*", what))


@dataclass(frozen=True)
class Folder:
    """The beginning of the paths of a nested dataclass of settings, if it is not the name of the field."""

    prefix: str


M = TypeVar("M")


def marks(hint: Any, kind: type[M]) -> list[M]:
    """Returns the extras of a type annotation that belong to a class: `Range`, `Shown` or `Folder`."""
    return [each for each in getattr(hint, "__metadata__", ()) if isinstance(each, kind)]


def plain(hint: Any) -> tuple[Any, Range]:
    """Splits a type annotation into the type and the range."""
    if get_origin(hint) is not Annotated:
        return hint, ANY
    return get_args(hint)[0], next(iter(marks(hint, Range)), ANY)


def alternatives(hint: Any) -> tuple[Any, ...]:
    """Returns the members of a union type; any other type is returned alone."""
    return get_args(hint) if get_origin(hint) in (UnionType, Union) else (hint,)


@cache
def field_types(owner: type) -> dict[str, Any]:
    """Returns the type annotations of a dataclass by field, ranges included."""
    return get_type_hints(owner, include_extras=True)


def check_fields(owner: Any, prefix: str = "") -> None:
    """Raises InputError if a number of a dataclass is outside its range, a word is not in its Literal or a
    switch is not true or false. The message names the field and the allowed values. Numbers without a range
    are not checked.

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
        elif inner is bool and not isinstance(value, (bool, np.bool_)):
            raise InputError(f"{prefix}{name} is {value!r}; give true or false.")
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
