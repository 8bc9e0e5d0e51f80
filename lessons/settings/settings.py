"""The base class of the settings of both kinds of scenes, and their paths."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import asdict, is_dataclass, replace
from functools import cache, lru_cache
from types import MappingProxyType
from typing import Any, ClassVar, Self, TypeVar

from himpc.stack import Stack
from lessons.events import Event, Set
from lessons.settings.schema import Setting, Shape, settings_of
from lessons.settings.values import WORD, Form
from robots.errors import unknown_name

S = TypeVar("S", bound="SceneSettings")


class SceneSettings(ABC):
    """All settings of a scene that a learner can change; subclasses are frozen trees of frozen data."""

    page_order: ClassVar[tuple[str, ...]]
    """The beginnings of paths in the order of lists. "" stands for all fields of the class that are not
    named, in their order; the options of a scene come last."""
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

    @classmethod
    @abstractmethod
    def special(cls, table: Mapping[str, Setting], shape: Shape) -> Iterable[Setting]:
        """Returns the settings that are not fields, or whose change has other effects than a field's.

        Args:
            table: the settings that are fields.
            shape: the names of the levels and tasks.
        """

    @classmethod
    def rank(cls, path: str) -> int:
        """Returns the place of a path in `page_order`."""
        for at, head in enumerate(cls.page_order):
            if path == head or path.startswith(head + "."):
                return at
        return cls.page_order.index("") if path in _fields(cls) else len(cls.page_order)

    def table(self) -> Mapping[str, Setting]:
        """Returns all settings by path, in the order of the page. All values whose levels, tasks, options and
        controllers have the same names share a table."""
        shape = tuple((level.name, tuple(task.name for task in level.tasks)) for level in self.levels)
        return _table(type(self), shape, type(self.options), tuple(self.controllers))

    def elements(self, path: str) -> int:
        """Returns the number of elements of a path that can be changed one by one, such as "M_bar.3"; 0:
        there are none."""
        return 0

    def setting(self, path: str) -> Setting:
        """Returns the setting of a path; the path may also be one element of a value, such as M_bar.3, which
        `table` does not contain. Raises InputError, which names the nearest path, for an unknown path.
        """
        table = self.table()
        if path in table:
            return table[path]
        whole, _, number = path.rpartition(".")
        count = self.elements(whole) if number.isdecimal() and whole in table else 0
        if not count:
            raise unknown_name("setting", path, table)
        return table[whole].at(number, count)

    def special_differences(self, wanted: Any) -> list[tuple[str, Any]]:
        """Paths and values that turn these settings into `wanted`. Only paths that are not in `table` are
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
        return self.setting(path).change(self, value)

    def as_data(self) -> dict[str, Any]:
        """Returns all settings as JSON-ready data."""
        data = asdict(self)  # pyright: ignore[reportArgumentType]  # every subclass is a dataclass
        return json.loads(json.dumps(data, default=str))

    def paths(self) -> list[str]:
        """Returns every path that `changed` accepts, except paths of single numbers in lists and of
        obstacles."""
        return list(self.table())

    def value_at(self, path: str) -> Any:
        """Returns the value at a path; for a path to several values, the first of them. Raises InputError
        like `setting`."""
        return self.setting(path).read(self)


@cache
def _fields(of: type[SceneSettings]) -> Mapping[str, Setting]:
    """The settings of a class that are fields, by path, without the options of a scene."""
    return MappingProxyType({setting.path: setting for setting in settings_of(of)})


@lru_cache(maxsize=64)
def _table(
    of: type[SceneSettings], shape: Shape, options: type[Any], controllers: tuple[str, ...]
) -> Mapping[str, Setting]:
    """`SceneSettings.table` for the names of the levels, tasks, options and controllers."""
    table = dict(_fields(of))
    if is_dataclass(options):
        of_scene = settings_of(options, keys=("options",), every=True)
        table |= {setting.path: setting for setting in of_scene}
    form = Form(WORD, words=controllers)
    table["controller"] = replace(
        table["controller"],
        form=form,
        change=lambda settings, name: replace(settings, controller=form.fit("controller", name)),
    )
    table |= {setting.path: setting for setting in of.special(table, shape)}
    return MappingProxyType(dict(sorted(table.items(), key=lambda item: of.rank(item[0]))))


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
