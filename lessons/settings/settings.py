"""What the settings of both kinds of scenes share: paths that reach into them."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, ClassVar, Self, TypeVar, get_type_hints

from himpc.stack import Level, Stack
from lessons.events import Event, Set
from lessons.settings.values import fitting, weight
from robots import InputError
from robots.errors import unknown_name

S = TypeVar("S", bound="Settings")


@dataclass(frozen=True, eq=False)
class Place:
    """Where a path leads.

    Attributes:
        read: the value in some settings.
        write: the settings with a value instead, which `fit` returned.
        fit: the value as it is stored. Raises InputError for one of the wrong type, naming the path.
        shorthand: a second way to what other paths reach, or to several values at once; `read` then gives the
            first of them.
    """

    read: Callable[[Any], Any]
    write: Callable[[Any, Any], Any]
    fit: Callable[[str, Any], Any]
    shorthand: bool = False


class Settings(ABC):
    """Everything a learner can change of a scene; subclasses are frozen trees of frozen data."""

    controllers: ClassVar[Mapping[str, str]]
    """One line per controller that fits."""
    controller: str
    levels: Stack
    """Highest priority first."""
    T_s: float
    """Control period, s."""
    horizon: int
    """N, knots."""
    options: Any
    """The scene's own choices, None if it has none."""
    plant: Any
    """What the plant really is."""

    @property
    @abstractmethod
    def measures_time(self) -> bool:
        """Whether the clock on the wall decides anything, so that no two runs are the same."""

    @abstractmethod
    def places(self) -> dict[str, Place]:
        """Where every path leads, by path."""

    def special(self, path: str, value: Any) -> Self | None:
        """The settings after a path that stands in no list, None if it is none either. Raises InputError for
        a value that does not fit."""
        return None

    def special_differences(self, wanted: Any) -> list[tuple[str, Any]]:
        """Paths and values of what `special` can change, where other settings of the same scene differ."""
        return []

    def takes(self, event: Event) -> bool:
        """Whether an event changes settings, not only what the robot is to do."""
        return isinstance(event, Set)

    def after(self, event: Event) -> Self:
        """What an event leaves of the settings when the run is reset. Raises InputError like `changed`."""
        return self.changed(event.path, event.value) if isinstance(event, Set) else self

    def changed(self, path: str, value: Any) -> Self:
        """The settings with the value at a path replaced.

        Raises:
            InputError: unknown path (naming the nearest), or a value of the wrong type or range.
        """
        special = self.special(path, value)
        if special is not None:
            return special
        places = self.places()
        if path not in places:
            raise unknown_name("setting", path, places)
        return places[path].write(self, places[path].fit(path, value))

    def as_data(self) -> dict[str, Any]:
        """All of it as JSON-ready data."""
        data = asdict(self)  # pyright: ignore[reportArgumentType]  # every subclass is a dataclass
        return json.loads(json.dumps(data, default=str))

    def paths(self) -> list[str]:
        """Every path that `changed` takes, but for special ones."""
        return list(self.places())

    def value_at(self, path: str) -> Any:
        """The value at one of `paths`; of several at once the first one's."""
        return self.places()[path].read(self)


Part = Callable[[S], Any]
Whole = Callable[[S, Any], S]


def field_places(
    owner: Any, read: Part[S], write: Whole[S], prefix: str = "", without: tuple[str, ...] = ()
) -> dict[str, Place]:
    """A place for each field of a dataclass that is itself part of settings, typed by its annotation.

    Args:
        owner: the dataclass as it is now.
        read: the owner in some settings.
        write: the settings with another owner.
        prefix: of the paths.
        without: fields that are no settings.
    """

    def place(name: str, hint: Any) -> Place:
        return Place(
            read=lambda settings: getattr(read(settings), name),
            write=lambda settings, value: write(settings, replace(read(settings), **{name: value})),
            fit=lambda path, value: fitting(path, hint, value),
        )

    hints = get_type_hints(type(owner))
    names = [each.name for each in fields(owner) if each.name not in without]
    return {prefix + name: place(name, hints[name]) for name in names}


Fit = Callable[[str, Any], Any]
LevelKeys = Mapping[str, tuple[Callable[[Level], Any], Callable[[Level, Any], Level], Fit, bool]]
"""Per key of a level: its value, the level with another one, `Place.fit` and `Place.shorthand`."""


def level_places(
    stack: Stack, keys: LevelKeys, read: Callable[[S], Stack], write: Callable[[S, Stack], S]
) -> dict[str, Place]:
    """Places "levels.NAME.KEY" and, as shorthands, "levels.PLACE.KEY" with 1 for the highest priority."""

    def place(at: int, key: str, by_place: bool) -> Place:
        get, put, fit, shorthand = keys[key]
        return Place(
            read=lambda settings: get(read(settings)[at]),
            write=lambda settings, value: write(settings, _with_level(read(settings), at, put, value)),
            fit=fit,
            shorthand=shorthand or by_place,
        )

    by_name = {
        f"levels.{level.name}.{key}": place(at, key, False) for at, level in enumerate(stack) for key in keys
    }
    by_place = {f"levels.{at + 1}.{key}": place(at, key, True) for at in range(len(stack)) for key in keys}
    return {**by_name, **by_place}


def _with_level(stack: Stack, at: int, put: Callable[[Level, Any], Level], value: Any) -> Stack:
    return (*stack[:at], put(stack[at], value), *stack[at + 1 :])


def every_level(stack: Stack, key: str, read: Callable[[S], Stack], write: Callable[[S, Stack], S]) -> Place:
    """A weight of all levels at once: one number, or one per level."""

    def fit(path: str, value: Any) -> list[Any]:
        values = value if isinstance(value, (list, tuple)) else [value] * len(stack)
        if len(values) != len(stack):
            raise InputError(f"{key} has {len(values)} values: give one number, or one per level")
        return [
            weight(f"{key} of level '{level.name}'", each) for level, each in zip(stack, values, strict=True)
        ]

    def put(settings: S, values: list[Any]) -> S:
        levels = zip(read(settings), values, strict=True)
        return write(settings, tuple(replace(level, **{key: value}) for level, value in levels))

    return Place(lambda settings: getattr(read(settings)[0], key), put, fit, shorthand=True)


def settings_after(settings: S, events: Iterable[Event]) -> S:
    """The settings that events leave behind when the run is reset. Most change the run alone.

    Args:
        settings: before.
        events: that took effect, in order.
    """
    for event in events:
        settings = settings.after(event)
    return settings
