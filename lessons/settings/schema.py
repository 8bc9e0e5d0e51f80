"""The settings of a scene are a tree of frozen dataclasses and tuples. Lists the settings by path, with their
descriptions and allowed values, and reads or changes one of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

from himpc.stack import Level
from himpc.tasks import Task
from lessons.settings.values import NUMBER, Form, form_of
from robots import InputError
from robots.ranges import Folder, Shown, field_types, marks, plain

Keys = tuple[str | int | None, ...]
"""The way from the root of a tree to values: the name of a field; in a tuple, the place of an element, the
name of an element, or None for every element."""
Shape = tuple[tuple[str, tuple[str, ...]], ...]
"""The names of the levels, each with the names of its tasks."""


def values(node: Any, keys: Keys) -> Iterator[Any]:
    """Yields the values that the keys lead to."""
    if not keys:
        yield node
    elif isinstance(node, tuple):
        for index, element in enumerate(node):
            if _is_meant(keys[0], index, element):
                yield from values(element, keys[1:])
    else:
        yield from values(getattr(node, str(keys[0])), keys[1:])


def written(node: Any, keys: Keys, value: Any) -> Any:
    """Returns the tree with the values that the keys lead to replaced by one value."""
    if not keys:
        return value
    if isinstance(node, tuple):
        return tuple(
            written(element, keys[1:], value) if _is_meant(keys[0], index, element) else element
            for index, element in enumerate(node)
        )
    name = str(keys[0])
    return replace(node, **{name: written(getattr(node, name), keys[1:], value)})


def _is_meant(key: str | int | None, index: int, element: Any) -> bool:
    return key is None or key == (index if isinstance(key, int) else element.name)


@dataclass(frozen=True, eq=False)
class Setting:
    """A setting of a scene.

    Attributes:
        path: as in `--set`.
        shown: its description for users.
        form: the allowed values.
        read: returns the value in some settings; for a path to several values, the first of them.
        change: returns the settings with another value. Raises InputError, which names the path and the
            allowed values, for a value that is not allowed.
        pattern: the path with "*" for a name.
        shorthand: whether the value also has another path, or the path stands for several values at once.
        element: the description of one element of a list, if it has its own.
    """

    path: str
    shown: Shown
    form: Form
    read: Callable[[Any], Any]
    change: Callable[[Any, Any], Any]
    pattern: str
    shorthand: bool = False
    element: Shown | None = None

    def at(self, number: str, count: int) -> Setting:
        """Returns the setting of one of the `count` numbers of a list; the first has the place 1. If the
        settings have fewer numbers, the list is first filled up with its last number."""
        path, form = f"{self.path}.{number}", Form(NUMBER, range=self.form.range)
        if not 1 <= int(number[:4]) <= count:
            raise InputError(f"{path}: there is no place {number[:9]}; give a place from 1 to {count}")
        index = int(number) - 1

        def spread(settings: Any) -> list[Any]:
            now = self.read(settings)
            numbers = list(now) if isinstance(now, tuple) else [float(now)]
            return numbers + numbers[-1:] * (count - len(numbers))

        def change(settings: Any, value: Any) -> Any:
            numbers = spread(settings)
            numbers[index] = form.fit(path, value)
            return self.change(settings, numbers)

        shown = Shown(number, name=path) if self.element is None else self.element.of(number)
        return Setting(path, shown, form, lambda settings: spread(settings)[index], change, path, True)


def setting(
    pattern: str, hint: Any, keys: Keys, what: str = "", shown: Shown | None = None, shorthand: bool = False
) -> Setting:
    """Returns the setting of a field.

    Args:
        pattern: its path, with "*" for a name.
        hint: the annotation of the field, which contains the range and the description.
        keys: the way to the field.
        what: the name for "*".
        shown: replaces the description of the annotation.
    """
    path, form = pattern.replace("*", what), form_of(hint)
    own = [shown] if shown else marks(hint, Shown) or [Shown(path.rpartition(".")[2], name=path)]
    return Setting(
        path,
        own[0].of(what),
        form,
        lambda settings: next(values(settings, keys)),
        lambda settings, value: written(settings, keys, form.fit(path, value)),
        pattern,
        shorthand,
        own[1] if len(own) > 1 else None,
    )


def settings_of(owner: type, prefix: str = "", keys: Keys = (), every: bool = False) -> Iterator[Setting]:
    """Yields the settings of a dataclass and of the dataclasses in it, in the order of the fields: the fields
    with a description (`Shown`).

    Args:
        owner: the class.
        prefix: the beginning of the paths.
        keys: the way to the instance.
        every: whether fields without a description are settings, too.
    """
    for field in fields(owner):
        hint, here = field_types(owner)[field.name], (*keys, field.name)
        kind, folder = plain(hint)[0], marks(hint, Folder)
        if is_dataclass(kind) and isinstance(kind, type):
            inner = folder[0].prefix if folder else f"{prefix}{field.name}."
            yield from settings_of(kind, inner, here, every)
        elif every or marks(hint, Shown):
            yield setting(prefix + field.name, hint, here)


def settings_of_levels(
    shape: Shape, stack: Keys, names: Sequence[str], gains: Sequence[str], shown: Mapping[str, Shown]
) -> Iterator[Setting]:
    """Yields the settings of levels and of their tasks: "levels.NAME.KEY", the shorthand "levels.NUMBER.KEY",
    in which 1 is the highest priority, and "tasks.NAME.KEY".

    Args:
        shape: the names of the levels and tasks.
        stack: the way to the stack.
        names: fields of levels.
        gains: fields of tasks; a level sets them for all its tasks.
        shown: replaces descriptions, by pattern.
    """
    for name in (*names, *gains):
        shared, pattern = name in gains, f"levels.*.{name}"
        hint, own = field_types(Task if shared else Level)[name], shown.get(pattern)
        rest: Keys = ("tasks", None, name) if shared else (name,)
        for index, (level, _) in enumerate(shape):
            yield setting(pattern, hint, (*stack, level, *rest), level, own, shared)
            yield setting(pattern, hint, (*stack, index, *rest), str(index + 1), own, True)
    for name in gains:
        for task in (task for _, tasks in shape for task in tasks):
            yield setting(
                f"tasks.*.{name}", field_types(Task)[name], (*stack, None, "tasks", task, name), task
            )


def setting_of_all_levels(name: str, stack: Keys, shown: Shown) -> Setting:
    """Returns a weight of all levels at once: one number, or one per level."""
    form = form_of(field_types(Level)[name])

    def change(settings: Any, value: Any) -> Any:
        levels = next(values(settings, stack))
        weights = value if isinstance(value, (list, tuple)) else [value] * len(levels)
        if len(weights) != len(levels):
            raise InputError(f"{name} has {len(weights)} values: give one number, or one per level")
        fitted = [
            form.fit(f"{name} of level '{level.name}'", weight)
            for level, weight in zip(levels, weights, strict=True)
        ]
        changed = (replace(level, **{name: weight}) for level, weight in zip(levels, fitted, strict=True))
        return written(settings, stack, tuple(changed))

    read = (*stack, None, name)
    return Setting(name, shown, form, lambda settings: next(values(settings, read)), change, name, True)
