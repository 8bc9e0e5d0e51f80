"""The data of a mission that the page shows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np


@dataclass(frozen=True)
class MissionRow:
    """A task of a mission. goal: position, m, or quaternion x y z w; None for a trajectory; hold: time to
    stay at the goal, s, None: until released; there_s: time at the goal so far, s; done_at: time at which the
    task was completed, s."""

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
    """A person who receives balls. hand: point at which a ball is handed over, m; place: position on the
    floor, m; balls: number of balls received."""

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
