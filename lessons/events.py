"""What may happen to a running session. Events are data; tasks and levels go by their stable names."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from robots import InputError

Vector = tuple[float, ...]


@dataclass(frozen=True)
class Set:
    """A setting takes a new value; `path` as in `lessons.settings.torque`."""

    path: str
    value: Any


@dataclass(frozen=True)
class MoveLevel:
    """A level moves to another place in the stack, 0 being the highest priority."""

    level: str
    to: int


@dataclass(frozen=True)
class MoveTarget:
    """The hand puts a task's target somewhere: position (m), quaternion (x y z w) or joints (rad)."""

    task: str
    value: Vector


@dataclass(frozen=True)
class Push:
    """A force (N) and torque (N·m) in world axes on a moving body, for some simulated seconds."""

    body: str
    force: Vector = (0.0, 0.0, 0.0)
    torque: Vector = (0.0, 0.0, 0.0)
    seconds: float = 0.1


@dataclass(frozen=True)
class Reset:
    """Back to the scene's start; settings stay as they are."""


Event = Set | MoveLevel | MoveTarget | Push | Reset
_KINDS = {kind.__name__: kind for kind in (Set, MoveLevel, MoveTarget, Push, Reset)}


def as_data(event: Event) -> dict[str, Any]:
    """An event as JSON-ready data."""
    return {"event": type(event).__name__, **asdict(event)}


def from_data(data: dict[str, Any]) -> Event:
    """The inverse of `as_data`. Raises InputError for data that is no event."""
    fields = dict(data)
    kind = _KINDS.get(str(fields.pop("event", "")))
    values: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in fields.items()}
    try:
        if kind is None:
            raise TypeError
        return kind(**values)
    except TypeError:
        raise InputError(f"{data} is no event: its kind must be one of {', '.join(_KINDS)}") from None
