"""The changes of a stack that are allowed while the robot moves."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from himpc.stack import Level, Stack
from himpc.tasks import Task
from himpc.tasks.kinds import kind_name
from lessons.settings.stack import NONE, Own, checked, entry_of, fields_of, level_of, name_of, one, quoted
from lessons.settings.values import form_of
from robots import InputError
from robots.errors import shortened, unknown_name


def add(stack: Stack, value: Any, own: Own = NONE) -> Stack:
    """Adds a task: {"task": KIND, …}. The key "level" gives the task a level of its own at that place; place
    1 has the highest priority. The key "with" gives the task the priority of the task or level of that name.
    Without these keys, the task gets a level directly above the last level."""
    data = entry_of(value, "stack.add")
    number, partner = data.pop("level", None), data.pop("with", None)
    taken = [task.name for level in stack for task in level.tasks]
    level = level_of(data, stack, taken, own)
    if partner is not None:
        at = _place_of(stack, partner)
        return checked((*stack[:at], _joined(stack[at], level), *stack[at + 1 :]))
    if number is None:
        at = max(len(stack) - 1, 0)
    else:
        at = form_of(int).fit("level of stack.add", number) - 1
        if not 0 <= at <= len(stack):
            raise InputError(f"level of stack.add is {number}: give a place from 1 to {len(stack) + 1}")
    return checked((*stack[:at], level, *stack[at:]))


def remove(stack: Stack, value: Any) -> Stack:
    """Returns the stack without the task of that name; a level that has no tasks left is removed, too."""
    at, task = _find(stack, value)
    rest = tuple(other for other in stack[at].tasks if other is not task)
    kept = (replace(stack[at], tasks=rest, Q=one(stack[at].Q)),) if rest else ()
    if not kept and len(stack) == 1:
        raise InputError(
            f"task '{task.name}' is the last one: add another task first, or switch its level off"
        )
    return (*stack[:at], *kept, *stack[at + 1 :])


def rename(stack: Stack, value: Any) -> Stack:
    """Renames a task: [OLD, NEW]."""
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise InputError(f"stack.rename is {quoted(value)}: give the old and the new name, [OLD, NEW]")
    at, task = _find(stack, value[0])
    name = name_of(value[1])
    return _with_task(stack, at, task, replace(task, name=name))


def edit(stack: Stack, value: Any) -> Stack:
    """Changes fields of a task, e.g. its axes or its frame: {"name": TASK, FIELD: VALUE, …}."""
    data = entry_of(value, "stack.edit")
    at, task = _find(stack, data.pop("name", None))
    changes = fields_of(type(task), data, f"a task of kind '{kind_name(task)}'")
    return _with_task(stack, at, task, replace(task, **changes))


def split(stack: Stack, value: Any) -> Stack:
    """Gives a task a level of its own, directly below the other tasks of its level."""
    at, task = _find(stack, value)
    level = stack[at]
    if len(level.tasks) == 1:
        raise InputError(f"task '{task.name}' has a level of its own already")
    rest = tuple(other for other in level.tasks if other is not task)
    Q = one(level.Q)
    return (
        *stack[:at],
        replace(level, tasks=rest, Q=Q),
        replace(level, tasks=(task,), Q=Q),
        *stack[at + 1 :],
    )


def merge(stack: Stack, value: Any) -> Stack:
    """Moves the tasks of a level (or of a task's level) into another level, whose weights they get: [LEVEL,
    INTO]."""
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise InputError(f"stack.merge is {quoted(value)}: give two levels, [LEVEL, INTO]")
    at, into = (_place_of(stack, name) for name in value)
    if at == into:
        raise InputError(f"level '{stack[at].name}' cannot be merged with itself: name another one")
    joined = _joined(stack[into], stack[at])
    levels = [joined if index == into else level for index, level in enumerate(stack) if index != at]
    return tuple(levels)


CHANGES: Mapping[str, Callable[[Stack, Any], Stack]] = {
    f"stack.{change.__name__}": change for change in (add, remove, rename, edit, split, merge)
}
"""The allowed changes of a stack, by path."""


def _find(stack: Stack, name: Any) -> tuple[int, Task]:
    for at, level in enumerate(stack):
        for task in level.tasks:
            if task.name == name:
                return at, task
    raise unknown_name("task", shortened(str(name)), [task.name for level in stack for task in level.tasks])


def _place_of(stack: Stack, name: Any) -> int:
    """Returns the index of the level of that name, or of the level with a task of that name."""
    for at, level in enumerate(stack):
        if name == level.name or any(task.name == name for task in level.tasks):
            return at
    raise unknown_name("level", shortened(str(name)), [level.name for level in stack])


def _with_task(stack: Stack, at: int, task: Task, new: Task) -> Stack:
    tasks = tuple(new if other is task else other for other in stack[at].tasks)
    return checked((*stack[:at], replace(stack[at], tasks=tasks, Q=one(stack[at].Q)), *stack[at + 1 :]))


def _joined(level: Level, more: Level) -> Level:
    return replace(level, tasks=(*level.tasks, *more.tasks), Q=one(level.Q))
