"""What may happen to a running mission, besides the events that every session knows."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from himpc.missions import Go, MissionTask
from lessons import events
from lessons.events import MoveLevel, MoveTarget, Push, Reset, Set, Vector
from robots import InputError
from robots.collision import Ball


@dataclass(frozen=True)
class Release:
    """Somebody takes the ball: a hold of unknown length ends."""

    task: str


@dataclass(frozen=True)
class InsertTask:
    """A new task towards a goal (m), before another one or at the end; see `himpc.missions.MissionTask`."""

    name: str
    role: str
    goal: Vector
    before: str | None = None
    cruise: float | None = None
    tolerance: float = 0.02
    hold: float | None = 0.0

    def task(self) -> MissionTask:
        """The task. Raises InputError for values that cannot be."""
        return MissionTask(self.name, self.role, Go(self.goal, self.cruise), self.tolerance, self.hold)


@dataclass(frozen=True)
class RemoveTask:
    """A task that is not completed leaves the mission."""

    task: str


@dataclass(frozen=True)
class Appear:
    """A ball (centre and radius, m) is suddenly there, or an obstacle of that name is somewhere else."""

    name: str
    centre: Vector
    radius: float

    def ball(self) -> Ball:
        """The obstacle. Raises InputError for numbers that cannot be."""
        if len(self.centre) != 3:
            raise InputError(f"obstacle '{self.name}' needs a centre of three numbers")
        x, y, z = self.centre
        return Ball(self.name, (x, y, z), self.radius)


MobileEvent = Set | MoveLevel | MoveTarget | Push | Reset | Release | InsertTask | RemoveTask | Appear
_KINDS = {kind.__name__: kind for kind in (Release, InsertTask, RemoveTask, Appear)}


def as_data(event: MobileEvent) -> dict[str, Any]:
    """An event as JSON-ready data."""
    return {"event": type(event).__name__, **asdict(event)}


def from_data(data: dict[str, Any]) -> MobileEvent:
    """The inverse of `as_data`. Raises InputError for data that is no event."""
    kind = _KINDS.get(str(data.get("event", "")))
    if kind is None:
        return events.from_data(data)
    fields: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in data.items()}
    try:
        return kind(**{k: v for k, v in fields.items() if k != "event"})
    except TypeError:
        raise InputError(f"{data} does not fit the event {kind.__name__}") from None
