"""The base class of the settings of both kinds of scenes, and their paths."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, ClassVar, Self, TypeVar

from himpc.stack import Level, Stack
from lessons.events import Event, Set
from lessons.settings.entry import Entry, entry_at
from lessons.settings.values import NUMBER, Form, form_of
from robots import InputError
from robots.errors import unknown_name
from robots.ranges import field_types

S = TypeVar("S", bound="SceneSettings")


@dataclass(frozen=True, eq=False)
class Place:
    """The value of a path.

    Attributes:
        read: returns the value in some settings.
        write: returns the settings with another value, in the form that `fit` returns.
        form: the allowed values.
        own_fit: used if the form is not enough. It returns the stored value for settings, path and value, and
            raises InputError, which names the path, for a value that is not allowed.
        shorthand: whether the value also has another path, or the path stands for several values at once;
            `read` then returns the first value.
    """

    read: Callable[[Any], Any]
    write: Callable[[Any, Any], Any]
    form: Form
    own_fit: Callable[[Any, str, Any], Any] | None = None
    shorthand: bool = False

    def fit(self, settings: Any, path: str, value: Any) -> Any:
        """Returns the value in the form in which the settings store it. Raises InputError, which names the
        path and the allowed values, for a value that is not allowed."""
        return self.form.fit(path, value) if self.own_fit is None else self.own_fit(settings, path, value)

    def element(self, at: int, count: int) -> Place:
        """Returns the place of one of the `count` numbers of a list. If the settings have fewer numbers, the
        list is first filled up with its last number."""

        def spread(settings: Any) -> list[Any]:
            now = self.read(settings)
            values = list(now) if isinstance(now, tuple) else [float(now)]
            return values + values[-1:] * (count - len(values))

        return Place(
            read=lambda settings: spread(settings)[at],
            write=lambda settings, value: self.write(
                settings, tuple(value if k == at else old for k, old in enumerate(spread(settings)))
            ),
            form=Form(NUMBER, range=self.form.range),
            shorthand=True,
        )


class SceneSettings(ABC):
    """All settings of a scene that a learner can change; subclasses are frozen trees of frozen data."""

    entries: ClassVar[tuple[Entry, ...]]
    """The description of every path for users."""
    controller: str
    levels: Stack
    """The levels, highest priority first."""
    T_s: float
    """Control period, s."""
    horizon: int
    """N, knots."""
    options: Any
    """The options of the scene; None if it has none."""
    plant: Any
    """The parameters of the simulated plant."""

    @property
    @abstractmethod
    def controllers(self) -> Mapping[str, str]:
        """The controllers for this kind of scene, with one line each."""

    @property
    @abstractmethod
    def measures_time(self) -> bool:
        """Whether measured computing times change the run, so that no two runs are the same."""

    @abstractmethod
    def places(self) -> Mapping[str, Place]:
        """Returns the place of every path. All settings whose levels, tasks and options have the same names
        share a table."""

    def elements(self, path: str) -> int:
        """Returns the number of elements of a path that can be changed one by one, such as "M_bar.3"; 0:
        there are none."""
        return 0

    def place(self, path: str) -> Place:
        """Returns the place of a path; the path may also be one element of a value, such as M_bar.3, which
        `places` does not contain. Raises InputError, which names the nearest path, for an unknown path.
        """
        places = self.places()
        if path in places:
            return places[path]
        whole, _, at = path.rpartition(".")
        count = self.elements(whole) if at.isdecimal() and whole in places else 0
        if not count:
            raise unknown_name("setting", path, places)
        if not 1 <= int(at[:4]) <= count:
            raise InputError(f"{path}: there is no place {at[:9]}; give a place from 1 to {count}")
        return places[whole].element(int(at) - 1, count)

    def entry(self, path: str) -> Entry:
        """Returns the description of a path for users."""
        return entry_at(self.entries, path)

    def special_differences(self, wanted: Any) -> list[tuple[str, Any]]:
        """Paths and values that turn these settings into `wanted`. Only paths that are not in `places` are
        considered."""
        return []

    def recomposed(self, wanted: Any) -> list[tuple[str, Any]]:
        """Paths and values that give these settings the same paths as `wanted`; [] if both have the same
        paths already."""
        return []

    def takes(self, event: Event) -> bool:
        """Returns whether an event changes settings and not only the robot's task."""
        return isinstance(event, Set)

    def after(self, event: Event) -> Self:
        """Returns the settings that remain after an event when the run is reset. Raises InputError like
        `changed`."""
        return self.changed(event.path, event.value) if isinstance(event, Set) else self

    def changed(self, path: str, value: Any) -> Self:
        """Returns the settings with the value at a path replaced.

        Raises:
            InputError: unknown path (naming the nearest), or a value of the wrong type or range.
        """
        place = self.place(path)
        return place.write(self, place.fit(self, path, value))

    def as_data(self) -> dict[str, Any]:
        """Returns all settings as JSON-ready data."""
        data = asdict(self)  # pyright: ignore[reportArgumentType]  # every subclass is a dataclass
        return json.loads(json.dumps(data, default=str))

    def paths(self) -> list[str]:
        """Returns every path that `changed` accepts, except paths of single numbers in lists and of
        obstacles."""
        return list(self.places())

    def value_at(self, path: str) -> Any:
        """Returns the value at a path; for a path to several values, the first of them. Raises InputError
        like `place`."""
        return self.place(path).read(self)


Part = Callable[[S], Any]
Whole = Callable[[S, Any], S]


def field_places(
    owner: type[Any], read: Part[S], write: Whole[S], prefix: str = "", without: tuple[str, ...] = ()
) -> dict[str, Place]:
    """Returns a place for each field of a dataclass that is part of the settings; the annotation of the field
    gives its form.

    Args:
        owner: the class.
        read: returns the instance of this class that is a part of the given settings.
        write: returns the given settings with this instance replaced by the given one.
        prefix: prefix of the paths.
        without: fields that are not settings.
    """

    def place(name: str, hint: Any) -> Place:
        return Place(
            read=lambda settings: getattr(read(settings), name),
            write=lambda settings, value: write(settings, replace(read(settings), **{name: value})),
            form=form_of(hint),
        )

    hints = field_types(owner)
    names = [each.name for each in fields(owner) if each.name not in without]
    return {prefix + name: place(name, hints[name]) for name in names}


@dataclass(frozen=True, eq=False)
class LevelKey:
    """A key of a level: a function that returns its value, a function that returns the level with another
    value, and the allowed values, as in `Place`."""

    read: Callable[[Level], Any]
    write: Callable[[Level, Any], Level]
    form: Form
    shorthand: bool = False


def level_key(name: str) -> LevelKey:
    """Returns the key of a field of Level."""
    return LevelKey(
        lambda level: getattr(level, name),
        lambda level, value: replace(level, **{name: value}),
        form_of(field_types(Level)[name]),
    )


def level_places(
    names: Sequence[str],
    keys: Mapping[str, LevelKey],
    read: Callable[[S], Stack],
    write: Callable[[S, Stack], S],
) -> dict[str, Place]:
    """Returns the places of the settings of levels by path: "levels.NAME.KEY" and the shorthand
    "levels.NUMBER.KEY", in which 1 is the highest priority."""

    def place(find: Callable[[Stack], int], key: LevelKey, by_place: bool) -> Place:
        def put(settings: S, value: Any) -> S:
            levels = read(settings)
            at = find(levels)
            return write(settings, (*levels[:at], key.write(levels[at], value), *levels[at + 1 :]))

        return Place(
            read=lambda settings: key.read(read(settings)[find(read(settings))]),
            write=put,
            form=key.form,
            shorthand=key.shorthand or by_place,
        )

    def by_name(name: str) -> Callable[[Stack], int]:
        return lambda levels: next(at for at, level in enumerate(levels) if level.name == name)

    named = {f"levels.{name}.{key}": place(by_name(name), keys[key], False) for name in names for key in keys}
    placed = {
        f"levels.{at + 1}.{key}": place(lambda _, at=at: at, keys[key], True)
        for at in range(len(names))
        for key in keys
    }
    return {**named, **placed}


def every_level(key: str, read: Callable[[S], Stack], write: Callable[[S, Stack], S]) -> Place:
    """Returns a weight of all levels at once: one number, or one per level."""

    form = form_of(field_types(Level)[key])

    def fit(settings: S, _: str, value: Any) -> list[Any]:
        stack = read(settings)
        values = value if isinstance(value, (list, tuple)) else [value] * len(stack)
        if len(values) != len(stack):
            raise InputError(f"{key} has {len(values)} values: give one number, or one per level")
        return [
            form.fit(f"{key} of level '{level.name}'", each)
            for level, each in zip(stack, values, strict=True)
        ]

    def put(settings: S, values: list[Any]) -> S:
        levels = zip(read(settings), values, strict=True)
        return write(settings, tuple(replace(level, **{key: value}) for level, value in levels))

    return Place(lambda settings: getattr(read(settings)[0], key), put, form, fit, shorthand=True)


def settings_after(settings: S, events: Iterable[Event]) -> S:
    """Returns the settings after some events, as they remain when the run is reset. Most events change only
    the run.

    Args:
        settings: the settings before the events.
        events: events that took effect, in order.
    """
    for event in events:
        settings = settings.after(event)
    return settings
