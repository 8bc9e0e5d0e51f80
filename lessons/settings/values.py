"""Derives the allowed values of a setting from the declaration of its field, and checks users' values."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, get_args, get_origin

import numpy as np

from lessons.own.files import by_name
from robots import InputError
from robots.arrays import Array
from robots.errors import unknown_name
from robots.ranges import ANY, Range, alternatives, plain

NUMBER = "number"
WHOLE = "whole number"
SWITCH = "switch"
WORD = "word"


@dataclass(frozen=True)
class Form:
    """The allowed values of a setting. Attributes:
    kind: NUMBER, WHOLE, SWITCH or WORD; None: a list only.
    elements: the form of the elements of a list; None: lists are not allowed.
    words: the words to choose from; empty: any.
    null: whether null is allowed.
    range: the range of every number.
    """

    kind: str | None
    elements: str | None = None
    words: tuple[str, ...] = ()
    null: bool = False
    range: Range = ANY

    def __str__(self) -> str:
        """Returns text for users: "a whole number from 1 to 60"; "viability, paper or off"."""
        parts = [] if self.kind is None else [self._one(self.kind)]
        if self.elements is not None:
            parts.append(
                f"a list of {self.elements}s {self.range}".strip() if not parts else "a list of such"
            )
        return " or ".join(parts + ["null"] * self.null)

    def _one(self, kind: str) -> str:
        if kind == SWITCH:
            return "true or false"
        if kind == WORD:
            *first, last = self.words or ("a word",)
            return f"{', '.join(first)} or {last}" if first else last
        return f"a {kind} {self.range}".strip()

    def fit(self, path: str, value: Any) -> Any:
        """Returns the value in the form in which it is stored. Raises InputError, which names the path and
        the allowed values, for a value that is not allowed."""
        if value is None and self.null:
            return None
        if isinstance(value, (list, tuple, np.ndarray)) and self.elements is not None:
            return tuple(self._element(self.elements, path, element) for element in value)
        if self.kind is None:
            example = [] if self.elements == WORD else [0.5, 0.5]
            raise InputError(f"{path} is {_quoted(value)}: give a list, e.g. {example}")
        return self._element(self.kind, path, value)

    def _element(self, kind: str, path: str, value: Any) -> Any:
        match kind:
            case "switch":
                fits = isinstance(value, (bool, np.bool_))
                fitted: Any = bool(value) if fits else None
            case "word":
                if isinstance(value, str) and self.words and value not in self.words:
                    raise unknown_name(path, value, by_name(self.words))
                fits, fitted = isinstance(value, str), value
            case _:
                fits = _is_number(value) and self.range.holds(float(value))
                fits = fits and (kind == NUMBER or value == int(value))
                fitted = (int(value) if kind == WHOLE else float(value)) if fits else None
        if not fits:
            raise InputError(f"{path} is {_quoted(value)}: give {self}")
        return fitted


@cache
def form_of(hint: Any) -> Form:
    """Returns the allowed values of a field of a declared type: a number, word or switch, a list of them,
    null."""
    inner, allowed = plain(hint)
    kind: str | None = None
    elements: str | None = None
    words: tuple[str, ...] = ()
    for alternative in alternatives(inner):
        if get_origin(alternative) is tuple:
            elements = form_of(get_args(alternative)[0]).kind
        elif get_origin(alternative) is Literal:
            kind, words = WORD, get_args(alternative)
        elif alternative is not type(None):
            kind = {bool: SWITCH, int: WHOLE, str: WORD}.get(alternative, NUMBER)
    return Form(kind, elements, words, type(None) in alternatives(inner), allowed)


def _is_number(value: Any) -> bool:
    number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    # A whole number may be too long for a float.
    return number and bool(abs(value) <= 1e300 and math.isfinite(value))


def _quoted(value: Any) -> str:
    try:
        text = repr(value)
    except ValueError:  # a whole number of thousands of digits
        return "a number without end"
    return text if len(text) <= 80 else text[:60] + " …"


def peak(values: Array) -> float | None:
    """Returns the largest finite value, None if there is none."""
    numbers = values[np.isfinite(values)]
    return float(numbers.max()) if numbers.size else None


def finite(value: Any) -> Any:
    """JSON-ready data with None in place of every number that is not finite."""
    if isinstance(value, dict):
        return {key: finite(element) for key, element in value.items()}
    if isinstance(value, list):
        return [finite(element) for element in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
