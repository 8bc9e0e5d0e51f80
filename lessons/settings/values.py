"""Values a user gives for a setting, checked."""

from __future__ import annotations

import math
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from robots import InputError


def weight(path: str, value: Any) -> float | tuple[float, ...]:
    """A number, or a tuple of them from a list. Raises InputError, naming the path, for anything else."""
    if isinstance(value, (list, tuple, np.ndarray)):
        return tuple(number(path, each) for each in value)
    return number(path, value)


def number(path: str, value: Any) -> float:
    """A finite number. Raises InputError, naming the path, for anything else."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise InputError(f"{path} is {value!r}: give a number")
    try:
        finite_number = float(value)
    except OverflowError:
        raise InputError(f"{path} has {len(str(abs(value)))} digits: give a smaller number") from None
    if not math.isfinite(finite_number):
        raise InputError(f"{path} is {value}: give a finite number")
    return finite_number


def typed(path: str, old: Any, value: Any) -> Any:
    """The value in the type of the one it replaces. Raises InputError, naming the path, if it has another."""
    if isinstance(old, bool):
        if isinstance(value, bool):
            return value
        raise InputError(f"{path} is {value!r}: give true or false")
    if isinstance(old, str):
        if isinstance(value, str):
            return value
        raise InputError(f"{path} is {value!r}: give a word")
    if isinstance(old, int):
        whole = number(path, value)
        if whole != int(whole):
            raise InputError(f"{path} is {value}: give a whole number")
        return int(whole)
    per_joint = path.startswith(("nominal.", "plant."))
    if isinstance(old, float) and not per_joint:
        return number(path, value)
    if isinstance(old, tuple) and not isinstance(value, (list, tuple, np.ndarray)):
        number(path, value)
        if per_joint:
            return float(value)
        raise InputError(f"{path} is {value!r}: give a list of {len(old)} numbers, e.g. {list(old)}")
    return weight(path, value)


def fitting(path: str, hint: Any, value: Any) -> Any:
    """The value as the type a field is declared with: numbers, words, true or false, lists of them, null.

    Raises:
        InputError: it does not fit, naming the path and what would.
    """
    kinds = get_args(hint) if get_origin(hint) in (UnionType, Union) else (hint,)
    if value is None and NoneType in kinds:
        return None
    if bool in kinds:
        return typed(path, True, value)
    if int in kinds:
        return typed(path, 0, value)
    if any(kind is str or get_origin(kind) is Literal for kind in kinds):
        return typed(path, "", value)
    elements = {get_args(kind)[0] for kind in kinds if get_origin(kind) is tuple}
    if isinstance(value, (list, tuple, np.ndarray)) and elements:
        return tuple(fitting(path, elements.copy().pop(), each) for each in value)
    if float in kinds:
        return number(path, value)
    raise InputError(f"{path} is {value!r}: give a list, e.g. {[] if str in elements else [0.5, 0.5]}")


def peak(values: NDArray[np.float64]) -> float | None:
    """The largest finite value, None if there is none."""
    found = values[np.isfinite(values)]
    return float(found.max()) if found.size else None


def finite(value: Any) -> Any:
    """JSON-ready data with None in place of every number that is not finite."""
    if isinstance(value, dict):
        return {key: finite(each) for key, each in value.items()}
    if isinstance(value, list):
        return [finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def choices_of(owner: type, name: str) -> tuple[str, ...]:
    """The words a field may hold, as its annotation lists them."""
    return get_args(get_type_hints(owner)[name])
