"""The events that a running session accepts. Events are data; they refer to tasks and levels by name."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from himpc.missions import Go, MissionTask
from robots import InputError
from robots.collision import Ball

Vector = tuple[float, ...]


@dataclass(frozen=True)
class Set:
    """A setting gets a new value; see `lessons.settings.settings` for its `path`."""

    path: str
    value: Any


@dataclass(frozen=True)
class MoveLevel:
    """A level moves to another place in the stack; place 0 has the highest priority."""

    level: str
    to: int


@dataclass(frozen=True)
class MoveTarget:
    """A task's target gets a new value: a position (m), a quaternion (x y z w) or joints (rad)."""

    task: str
    value: Vector


@dataclass(frozen=True)
class Push:
    """A force (N) and a torque (N·m), in world axes, act on a moving body for some simulated seconds."""

    body: str
    force: Vector = (0.0, 0.0, 0.0)
    torque: Vector = (0.0, 0.0, 0.0)
    seconds: float = 0.1


@dataclass(frozen=True)
class Reset:
    """The session returns to the scene's start and keeps its settings."""


@dataclass(frozen=True)
class Release:
    """A person takes the ball, which ends a hold of unknown length."""

    task: str


@dataclass(frozen=True)
class InsertTask:
    """A mission gets a new task with a goal (m), before another task or at the end; see
    `himpc.missions.MissionTask`."""

    name: str
    role: str
    goal: Vector
    before: str | None = None
    cruise: float | None = None
    tolerance: float = 0.02
    hold: float | None = 0.0

    def task(self) -> MissionTask:
        """Returns the task. Raises InputError for invalid values."""
        return MissionTask(self.name, self.role, Go(self.goal, self.cruise), self.tolerance, self.hold)


@dataclass(frozen=True)
class RemoveTask:
    """A task that is not completed is removed from the mission."""

    task: str


@dataclass(frozen=True)
class Appear:
    """A ball (centre and radius, m) is added, or replaces the obstacle of that name."""

    name: str
    centre: Vector
    radius: float

    def ball(self) -> Ball:
        """Returns the obstacle. Raises InputError for invalid numbers."""
        if len(self.centre) != 3:
            raise InputError(f"obstacle '{self.name}' needs a centre of three numbers")
        x, y, z = self.centre
        return Ball(self.name, (x, y, z), self.radius)


Event = Set | MoveLevel | MoveTarget | Push | Reset | Release | InsertTask | RemoveTask | Appear
_KINDS = {
    kind.__name__: kind
    for kind in (Set, MoveLevel, MoveTarget, Push, Reset, Release, InsertTask, RemoveTask, Appear)
}


def as_data(event: Event) -> dict[str, Any]:
    """Returns an event as JSON-ready data."""
    return {"event": type(event).__name__, **asdict(event)}


def from_data(data: dict[str, Any]) -> Event:
    """Returns the inverse of `as_data`. Raises InputError for data that do not describe an event."""
    fields = dict(data)
    kind = _KINDS.get(str(fields.pop("event", "")))
    if kind is None:
        raise InputError(f"{data} is not an event: its kind must be one of {', '.join(_KINDS)}")
    values: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in fields.items()}
    try:
        return kind(**values)
    except TypeError:
        raise InputError(f"{data} is not an event: its fields are not those of {kind.__name__}") from None
