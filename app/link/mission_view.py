"""The data of a mission that the page shows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np


@dataclass(frozen=True)
class MissionRow:
    """A task of a mission. goal: m, or x y z w of an orientation; None for a given trajectory; hold: s at the
    goal, None: until released; there_s: for how long it has been at its goal; done_at: s, when it was
    completed."""

    name: str
    role: str
    goal: tuple[float, ...] | None
    tolerance: float
    hold: float | None
    state: Literal["done", "active", "ahead"]
    there_s: float | None
    done_at: float | None


@dataclass(frozen=True)
class Person:
    """hand: m, where a ball is handed over; place: m on the floor; balls: how many were received."""

    hand: tuple[float, float, float]
    place: tuple[float, float]
    balls: int


@dataclass(frozen=True, eq=False)
class MissionView:
    """The state of a mission. paths: predicted path per role, (N + 1, 3) m."""

    rows: tuple[MissionRow, ...]
    done: bool
    paths: dict[str, np.ndarray]
    people: tuple[Person, ...]
