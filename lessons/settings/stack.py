"""The stack as a setting: converts it to data and back, and changes a part of it while the robot moves."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from types import MappingProxyType
from typing import Any

from himpc.stack import DAMPING_LEVEL, Level, Stack, check_names, essence
from himpc.tasks import KINDS, Task
from himpc.tasks.kinds import OWN, kind_name
from lessons.own.files import by_name, is_file, with_fingerprint
from lessons.settings.values import form_of
from robots import InputError
from robots.errors import shortened, unknown_name
from robots.ranges import field_types

MOST_TASKS = 20
"""Largest number of tasks in a stack."""
_LONGEST_NAME = 40
_NAME = re.compile(r"\w(?:[\w -]*\w)?")
_LEVEL_KEYS = ("Q", "R", "horizon", "enabled")
_GAINS = ("K_p", "K_v")
_EXAMPLE = 'stack=[{"task": "position", "axes": "xyz"}, {"task": "posture"}]'


Own = Mapping[str, Task]
"""Tasks of users' files by the path of the file; they are kinds in addition to the built-in ones."""
NONE: Own = MappingProxyType({})


def read_stack(value: Any, before: Stack, own: Own = NONE) -> Stack:
    """Returns a stack from a list with one entry per level, highest priority first.

    An entry is a task, {"task": KIND, "name": …, …} with the fields of its kind, K_p and K_v; a list of tasks
    of equal priority; or {"tasks": […]}. An entry may also have Q, R, horizon and enabled. For a user's file
    that was named at the start, KIND is its path or the name of its task's class.

    Args:
        value: the list.
        before: the stack that is replaced. A task whose entry has no gains keeps the gains that it has in
            that stack; a new task gets the gains of that stack's first task, which suit the robot.
        own: tasks of users' files that may be named.

    Raises:
        InputError: one sentence with the fault and the choices.
    """
    if not isinstance(value, (list, tuple)) or not value:
        raise InputError(f"stack is {_quoted(value)}: give a list of levels as JSON, e.g. {_EXAMPLE}")
    if len(value) > MOST_TASKS:
        raise InputError(f"stack has {len(value)} levels: give at most {MOST_TASKS}")
    taken: list[str] = []
    return _checked(tuple(_level_of(entry, before, taken, own) for entry in value))


def stack_as_data(stack: Stack, own: Own = NONE) -> list[dict[str, Any]]:
    """Returns a stack as data from which `read_stack` makes the same stack again.

    Raises:
        InputError: the kind of a task has no name.
    """
    return [_level_as_data(level, own) for level in stack]


def same_tasks(one: Stack, other: Stack) -> bool:
    """Returns whether two stacks have the same levels with the same tasks; order, gains and weights do not
    count."""
    return _tasks(one) == _tasks(other)


def _tasks(stack: Stack) -> dict[str, list[Task]]:
    return {level.name: [essence(task) for task in level.tasks] for level in stack}


# ------------------------------------------------------------------ reading


def _level_of(entry: Any, before: Stack, taken: list[str], own: Own) -> Level:
    """Returns a level from an entry; see `read_stack`. taken: names of tasks, to which the names of the new
    level's tasks are added."""
    data = (
        {"tasks": list(entry)}
        if isinstance(entry, (list, tuple))
        else _entry_of(entry, "a level of the stack")
    )
    keys = {key: data.pop(key) for key in _LEVEL_KEYS if key in data}
    if "tasks" in data:
        entries = data.pop("tasks")
        if data or not isinstance(entries, (list, tuple)) or not entries:
            raise InputError(f"a level of the stack is {_quoted(entry)}: give its tasks as a list")
    else:
        entries = [data]
    if len(entries) > MOST_TASKS:
        raise InputError(f"a level of the stack has {len(entries)} tasks: give at most {MOST_TASKS}")
    tasks = tuple(task for entry in entries for task in _made(entry, before, taken, own))
    hints = field_types(Level)
    weights = {key: form_of(hints[key]).fit(f"{key} of a level", value) for key, value in keys.items()}
    return Level(tasks, **weights)


def _made(entry: Any, before: Stack, taken: list[str], own: Own) -> list[Task]:
    """Returns the task of an entry, or the two tasks of a pose."""
    data = _entry_of(entry, "a task of the stack")
    word = data.pop("task", None)
    template = _of_file(word, own)
    if template is not None:
        name = _name_of(data.pop("name", None), _free(template.name, ("",), taken))
        taken.append(name)
        changes = _fields_of(type(template), data, f"the task of {word}")
        return [replace(template, name=name, **changes)]
    if word not in KINDS:
        classes = (type(task).__name__ for task in own.values())
        raise unknown_name("kind of task", shortened(str(word)), (*KINDS, *by_name(own), *classes))
    kind = KINDS[word]
    name = _name_of(data.pop("name", None), _free(word, kind.suffixes, taken))
    made = []
    for of, suffix in zip(kind.makes, kind.suffixes, strict=True):
        values = {**_gains(of, name + suffix, before), **_fields_of(of, data, f"a task of kind '{word}'")}
        made.append(of(name=name + suffix, **values))
        taken.append(name + suffix)
    return made


def _of_file(word: Any, own: Own) -> Task | None:
    """Returns the task of a user's file. The word is the path of the file, the file's fingerprint in a code,
    or the name of the task's class. None for one of the lab's kinds."""
    if not isinstance(word, str) or word in KINDS:
        return None
    if ".py@" in word:
        return own[with_fingerprint(word, own, "task")]
    if is_file(word) and word not in own:
        raise InputError(
            f"the kind of task is {shortened(word, 100)}: to use a file of your own, start himpc-lab with "
            "--task FILE.py"
        )
    return own.get(word) or next((task for task in own.values() if type(task).__name__ == word), None)


def _fields_of(of: type[Task], data: Mapping[str, Any], what: str) -> dict[str, Any]:
    hints = field_types(of)
    names = [field.name for field in fields(of) if field.name != "name"]
    for key in data:
        if key not in names:
            raise unknown_name(f"setting of {what} called", shortened(str(key)), names)
    return {key: form_of(hints[key]).fit(f"{key} of {what}", value) for key, value in data.items()}


def _gains(of: type[Task], name: str, before: Stack) -> dict[str, Any]:
    """Returns the gains of the task of that name, else those of the first task, which suit the robot."""
    known = {task.name: task for level in before for task in level.tasks}
    like = known.get(name) or next(iter(known.values()), None)
    own = {field.name: field.default for field in fields(of)}
    if like is None or own["K_p"] == 0.0:
        return {}
    return {key: _one(getattr(like, key)) for key in _GAINS}


def _free(word: str, suffixes: tuple[str, ...], taken: list[str]) -> str:
    """Returns the kind's name, followed by a number if that name is taken."""
    word = "rest" if word == DAMPING_LEVEL.name else word
    names = (word, *(f"{word}_{count}" for count in range(2, 2 * MOST_TASKS)))
    return next(name for name in names if not {name + suffix for suffix in suffixes} & set(taken))


def _name_of(value: Any, otherwise: str | None = None) -> str:
    if value is None and otherwise is not None:
        return otherwise
    word = value if isinstance(value, str) and len(value) <= _LONGEST_NAME else ""
    if not _NAME.fullmatch(word) or word.isdigit():
        raise InputError(
            f"the name of a task is {_quoted(value)}: give up to {_LONGEST_NAME} letters, digits, _, - and "
            "spaces, and not digits alone"
        )
    return word


def _checked(stack: Stack) -> Stack:
    tasks = [task for level in stack for task in level.tasks]
    if len(tasks) > MOST_TASKS:
        raise InputError(f"the stack has {len(tasks)} tasks: give at most {MOST_TASKS}")
    check_names(stack)
    if any(task.name == DAMPING_LEVEL.name for task in tasks):
        raise InputError(
            "the name 'damping' belongs to the last level, which is added automatically: choose another name"
        )
    return stack


def _entry_of(value: Any, what: str) -> dict[str, Any]:
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise InputError(f'{what} is {_quoted(value)}: write it as an object, e.g. {{"task": "position"}}')
    return dict(value)


def _quoted(value: Any) -> str:
    return shortened(repr(value), 80)


# ------------------------------------------------------------------ telling


def _one(value: Any) -> Any:
    """Returns one value for all coordinates, for a task whose number of coordinates will change."""
    return value[0] if isinstance(value, tuple) else value


def _level_as_data(level: Level, own: Own) -> dict[str, Any]:
    plain = Level(level.tasks)
    extra = {key: getattr(level, key) for key in _LEVEL_KEYS if getattr(level, key) != getattr(plain, key)}
    tasks = [_task_as_data(task, own) for task in level.tasks]
    return {**(tasks[0] if len(tasks) == 1 else {"tasks": tasks}), **extra}


def _task_as_data(task: Task, own: Own) -> dict[str, Any]:
    word, usual = kind_name(task), {field.name: field.default for field in fields(task)}
    if word == OWN:
        file = next((path for path, template in own.items() if type(template) is type(task)), None)
        if file is None:
            raise InputError(
                f"task '{task.name}' is not of a kind of the lab and cannot be written as data: put it into "
                "a file, and name the file by --task FILE.py"
            )
        word, usual = file, vars(own[file])
    values = {field.name: getattr(task, field.name) for field in fields(task) if field.name != "name"}
    kept = {key: value for key, value in values.items() if key in _GAINS or value != usual[key]}
    return {"task": word, "name": task.name, **kept}


# ------------------------------------------------------------------ changing a part


def ordered(stack: Stack, names: Any) -> Stack:
    """Returns the levels in another order.

    Args:
        stack: the levels.
        names: the names of all levels, highest priority first: "a,b,c" or a list.

    Raises:
        InputError: a name is missing, unknown or given twice.
    """
    levels = {level.name: level for level in stack}
    order = names.split(",") if isinstance(names, str) else names
    if not isinstance(order, (list, tuple)) or sorted(map(str, order)) != sorted(levels):
        raise InputError(f"order is {names!r}: give every level once, e.g. order={','.join(levels)}")
    return tuple(levels[str(name)] for name in order)


def moved(stack: Stack, name: str, to: int) -> Stack:
    """Returns the levels with one of them at another place; place 0 has the highest priority.

    Raises:
        InputError: no level of that name, or no such place.
    """
    names = [level.name for level in stack]
    if name not in names:
        raise unknown_name("level", name, names)
    if not 0 <= to < len(stack):
        raise InputError(
            f"level '{name}' cannot go to place {to}: the stack has places 0 to {len(stack) - 1}"
        )
    levels = list(stack)
    levels.insert(to, levels.pop(names.index(name)))
    return tuple(levels)


def add(stack: Stack, value: Any, own: Own = NONE) -> Stack:
    """Adds a task: {"task": KIND, …}. The key "level" gives the task a level of its own at that place; place
    1 has the highest priority. The key "with" gives the task the priority of the task or level of that name.
    Without these keys, the task gets a level directly above the last level."""
    data = _entry_of(value, "stack.add")
    number, partner = data.pop("level", None), data.pop("with", None)
    taken = [task.name for level in stack for task in level.tasks]
    level = _level_of(data, stack, taken, own)
    if partner is not None:
        at = _place_of(stack, partner)
        return _checked((*stack[:at], _joined(stack[at], level), *stack[at + 1 :]))
    if number is None:
        at = max(len(stack) - 1, 0)
    else:
        at = form_of(int).fit("level of stack.add", number) - 1
        if not 0 <= at <= len(stack):
            raise InputError(f"level of stack.add is {number}: give a place from 1 to {len(stack) + 1}")
    return _checked((*stack[:at], level, *stack[at:]))


def remove(stack: Stack, value: Any) -> Stack:
    """Returns the stack without the task of that name; a level that has no tasks left is removed, too."""
    at, task = _find(stack, value)
    rest = tuple(other for other in stack[at].tasks if other is not task)
    kept = (replace(stack[at], tasks=rest, Q=_one(stack[at].Q)),) if rest else ()
    if not kept and len(stack) == 1:
        raise InputError(
            f"task '{task.name}' is the last one: add another task first, or switch its level off"
        )
    return (*stack[:at], *kept, *stack[at + 1 :])


def rename(stack: Stack, value: Any) -> Stack:
    """Renames a task: [OLD, NEW]."""
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise InputError(f"stack.rename is {_quoted(value)}: give the old and the new name, [OLD, NEW]")
    at, task = _find(stack, value[0])
    name = _name_of(value[1])
    return _with_task(stack, at, task, replace(task, name=name))


def edit(stack: Stack, value: Any) -> Stack:
    """Changes fields of a task, e.g. its axes or its frame: {"name": TASK, FIELD: VALUE, …}."""
    data = _entry_of(value, "stack.edit")
    at, task = _find(stack, data.pop("name", None))
    changes = _fields_of(type(task), data, f"a task of kind '{kind_name(task)}'")
    return _with_task(stack, at, task, replace(task, **changes))


def split(stack: Stack, value: Any) -> Stack:
    """Gives a task a level of its own, directly below the other tasks of its level."""
    at, task = _find(stack, value)
    level = stack[at]
    if len(level.tasks) == 1:
        raise InputError(f"task '{task.name}' has a level of its own already")
    rest = tuple(other for other in level.tasks if other is not task)
    Q = _one(level.Q)
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
        raise InputError(f"stack.merge is {_quoted(value)}: give two levels, [LEVEL, INTO]")
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
    return _checked((*stack[:at], replace(stack[at], tasks=tasks, Q=_one(stack[at].Q)), *stack[at + 1 :]))


def _joined(level: Level, more: Level) -> Level:
    return replace(level, tasks=(*level.tasks, *more.tasks), Q=_one(level.Q))
