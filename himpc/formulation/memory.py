"""The memory of an incremental controller from one tick to the next."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from himpc.cascade.level import LevelSolution
from himpc.formulation.forms import StackForm
from robots.arrays import Array


class Memory(NamedTuple):
    """The time-delayed signals of (9) and the previous plan. `Memory(q, v, T_s)` is that of a robot that has
    moved with constant velocity so far; q̈ and ẍ are then zero.

    Attributes:
        q, v: measured state of the last tick, (n,).
        period: time between the last tick and this one, s.
        x_dot: ẋ of the last tick, all rows of `form`, (m,); None: not known.
        form: the prepared levels to which the rows of `x_dot` belong.
        predicted_q: q* at knots 0 … N of the last plan, (N+1, n).
        solutions: the last plan's levels by name.
    """

    q: Array
    v: Array
    period: float
    x_dot: Array | None = None
    form: StackForm | None = None
    predicted_q: Array | None = None
    solutions: Mapping[str, LevelSolution] = MappingProxyType({})
