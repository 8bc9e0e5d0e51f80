"""The stack as a setting: told as data, read from data, and changed part by part."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from typing import Any

from himpc.stack import DAMPING_LEVEL, Level, Stack, check_names, essence
from himpc.tasks import KINDS, Task
from himpc.tasks.kinds import OWN, word_of
from lessons.settings.values import form_of
from robots import InputError
from robots.errors import shortened, unknown_name
from robots.ranges import field_types

MOST_TASKS = 20
"""In a stack."""
_LONGEST_NAME = 40
_NAME = re.compile(r"\w(?:[\w -]*\w)?")
_LEVEL_KEYS = ("Q", "R", "horizon", "enabled")
_GAINS = ("K_p", "K_v")
_EXAMPLE = 'stack=[{"task": "position", "axes": "xyz"}, {"task": "posture"}]'


def read_stack(value: Any, before: Stack) -> Stack:
    """A stack from a list with one entry per level, highest priority first.

    An entry is a task, {"task": KIND, "name": …, …} with the fields of its kind, K_p and K_v; a list of tasks
    of equal priority; or {"tasks": […]}. Beside "task" or "tasks" may stand Q, R, horizon and enabled.

    Args:
        value: the list.
        before: the stack that is replaced. Its first task's gains, which suit the robot, go to every task
            that comes without; one that was there keeps its own.

    Raises:
        InputError: one sentence that names what is wrong, and the choices.
    """
    if not isinstance(value, (list, tuple)) or not value:
        raise InputError(f"stack is {_quoted(value)}: give a list of levels as JSON, e.g. {_EXAMPLE}")
    if len(value) > MOST_TASKS:
        raise InputError(f"stack has {len(value)} levels: give at most {MOST_TASKS}")
    taken: list[str] = []
    return _checked(tuple(_level(entry, before, taken) for entry in value))


def told(stack: Stack) -> list[dict[str, Any]]:
    """A stack as data from which `read_stack` makes the same again.

    Raises:
        InputError: a task is of a kind without a word.
    """
    return [_told_level(level) for level in stack]


def same_tasks(one: Stack, other: Stack) -> bool:
    """Whether two stacks have the same levels of the same tasks, whatever their order, gains and weights."""
    return _tasks(one) == _tasks(other)


def _tasks(stack: Stack) -> dict[str, list[Task]]:
    return {level.name: [essence(task) for task in level.tasks] for level in stack}


# ------------------------------------------------------------------ changes


def add(stack: Stack, value: Any) -> Stack:
    """One more task: {"task": KIND, …}, with "level": its own at that place, 1 the highest; or "with": the
    name of a task or level whose priority it gets; without either just above the last level."""
    given = _entry(value, "stack.add")
    place, beside = given.pop("level", None), given.pop("with", None)
    taken = [task.name for level in stack for task in level.tasks]
    level = _level(given, stack, taken)
    if beside is not None:
        at = _place_of(stack, beside)
        return _checked((*stack[:at], _joined(stack[at], level), *stack[at + 1 :]))
    if place is None:
        at = max(len(stack) - 1, 0)
    else:
        at = form_of(int).fit("level of stack.add", place) - 1
        if not 0 <= at <= len(stack):
            raise InputError(f"level of stack.add is {place}: give a place from 1 to {len(stack) + 1}")
    return _checked((*stack[:at], level, *stack[at:]))


def remove(stack: Stack, value: Any) -> Stack:
    """Without the task of that name; a level that is left without tasks goes, too."""
    at, task = _find(stack, value)
    rest = tuple(each for each in stack[at].tasks if each is not task)
    kept = (replace(stack[at], tasks=rest, Q=_one(stack[at].Q)),) if rest else ()
    if not kept and len(stack) == 1:
        raise InputError(
            f"task '{task.name}' is the last one: add another task first, or switch its level off"
        )
    return (*stack[:at], *kept, *stack[at + 1 :])


def rename(stack: Stack, value: Any) -> Stack:
    """[OLD, NEW] names of a task."""
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise InputError(f"stack.rename is {_quoted(value)}: give the old and the new name, [OLD, NEW]")
    at, task = _find(stack, value[0])
    name = _name(value[1])
    return _with_task(stack, at, task, replace(task, name=name))


def edit(stack: Stack, value: Any) -> Stack:
    """{"name": TASK, FIELD: VALUE, …}: other fields of a task, e.g. its axes or its frame."""
    given = _entry(value, "stack.edit")
    at, task = _find(stack, given.pop("name", None))
    changes = _fields(type(task), given, f"a task of kind '{word_of(task)}'")
    return _with_task(stack, at, task, replace(task, **changes))


def split(stack: Stack, value: Any) -> Stack:
    """The task of that name gets a level of its own, right below the others of its level."""
    at, task = _find(stack, value)
    level = stack[at]
    if len(level.tasks) == 1:
        raise InputError(f"task '{task.name}' has a level of its own already")
    rest = tuple(each for each in level.tasks if each is not task)
    Q = _one(level.Q)
    return (
        *stack[:at],
        replace(level, tasks=rest, Q=Q),
        replace(level, tasks=(task,), Q=Q),
        *stack[at + 1 :],
    )


def merge(stack: Stack, value: Any) -> Stack:
    """[LEVEL, INTO]: the tasks of a level (or of a task's level) join another one, whose weights they get."""
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise InputError(f"stack.merge is {_quoted(value)}: give two levels, [LEVEL, INTO]")
    at, into = (_place_of(stack, each) for each in value)
    if at == into:
        raise InputError(f"level '{stack[at].name}' cannot be merged with itself: name another one")
    joined = _joined(stack[into], stack[at])
    levels = [joined if place == into else level for place, level in enumerate(stack) if place != at]
    return tuple(levels)


CHANGES: Mapping[str, Callable[[Stack, Any], Stack]] = {
    f"stack.{change.__name__}": change for change in (add, remove, rename, edit, split, merge)
}
"""What may be done to a stack, by the path that does it."""


# ------------------------------------------------------------------ reading


def _level(entry: Any, before: Stack, taken: list[str]) -> Level:
    given = (
        {"tasks": list(entry)} if isinstance(entry, (list, tuple)) else _entry(entry, "a level of the stack")
    )
    keys = {key: given.pop(key) for key in _LEVEL_KEYS if key in given}
    if "tasks" in given:
        entries = given.pop("tasks")
        if given or not isinstance(entries, (list, tuple)) or not entries:
            raise InputError(f"a level of the stack is {_quoted(entry)}: give its tasks as a list")
    else:
        entries = [given]
    if len(entries) > MOST_TASKS:
        raise InputError(f"a level of the stack has {len(entries)} tasks: give at most {MOST_TASKS}")
    tasks = tuple(task for each in entries for task in _made(each, before, taken))
    hints = field_types(Level)
    weights = {key: form_of(hints[key]).fit(f"{key} of a level", value) for key, value in keys.items()}
    return Level(tasks, **weights)


def _made(entry: Any, before: Stack, taken: list[str]) -> list[Task]:
    """The task of an entry, or the two of a pose."""
    given = _entry(entry, "a task of the stack")
    word = given.pop("task", None)
    if word not in KINDS:
        raise unknown_name("kind of task", shortened(str(word)), KINDS)
    kind = KINDS[word]
    name = _name(given.pop("name", None), _free(word, kind.suffixes, taken))
    made = []
    for of, suffix in zip(kind.makes, kind.suffixes, strict=True):
        own = {**_gains(of, name + suffix, before), **_fields(of, given, f"a task of kind '{word}'")}
        made.append(of(name=name + suffix, **own))
        taken.append(name + suffix)
    return made


def _fields(of: type[Task], given: Mapping[str, Any], what: str) -> dict[str, Any]:
    hints = field_types(of)
    names = [each.name for each in fields(of) if each.name != "name"]
    for key in given:
        if key not in names:
            raise unknown_name(f"setting of {what} called", shortened(str(key)), names)
    return {key: form_of(hints[key]).fit(f"{key} of {what}", value) for key, value in given.items()}


def _gains(of: type[Task], name: str, before: Stack) -> dict[str, Any]:
    """Those of the task of that name, else those of the first task: they suit the robot."""
    known = {task.name: task for level in before for task in level.tasks}
    like = known.get(name) or next(iter(known.values()), None)
    own = {each.name: each.default for each in fields(of)}
    if like is None or own["K_p"] == 0.0:
        return {}
    return {key: _one(getattr(like, key)) for key in _GAINS}


def _free(word: str, suffixes: tuple[str, ...], taken: list[str]) -> str:
    """The kind's word, with a number behind it where it is taken."""
    word = "rest" if word == DAMPING_LEVEL.name else word
    names = (word, *(f"{word}_{count}" for count in range(2, 2 * MOST_TASKS)))
    return next(name for name in names if not {name + suffix for suffix in suffixes} & set(taken))


def _name(value: Any, otherwise: str | None = None) -> str:
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
            "the name 'damping' belongs to the last level, which is added by itself: take another"
        )
    return stack


def _entry(value: Any, what: str) -> dict[str, Any]:
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise InputError(f'{what} is {_quoted(value)}: write it as an object, e.g. {{"task": "position"}}')
    return dict(value)


def _quoted(value: Any) -> str:
    return shortened(repr(value), 80)


# ------------------------------------------------------------------ finding and telling


def _find(stack: Stack, name: Any) -> tuple[int, Task]:
    for at, level in enumerate(stack):
        for task in level.tasks:
            if task.name == name:
                return at, task
    raise unknown_name("task", shortened(str(name)), [task.name for level in stack for task in level.tasks])


def _place_of(stack: Stack, name: Any) -> int:
    """Place of the level of that name, or of the level that has a task of that name."""
    for at, level in enumerate(stack):
        if name == level.name or any(task.name == name for task in level.tasks):
            return at
    raise unknown_name("level", shortened(str(name)), [level.name for level in stack])


def _with_task(stack: Stack, at: int, task: Task, new: Task) -> Stack:
    tasks = tuple(new if each is task else each for each in stack[at].tasks)
    return _checked((*stack[:at], replace(stack[at], tasks=tasks, Q=_one(stack[at].Q)), *stack[at + 1 :]))


def _joined(level: Level, more: Level) -> Level:
    return replace(level, tasks=(*level.tasks, *more.tasks), Q=_one(level.Q))


def _one(value: Any) -> Any:
    """One number for all coordinates, whose number is about to change."""
    return value[0] if isinstance(value, tuple) else value


def _told_level(level: Level) -> dict[str, Any]:
    plain = Level(level.tasks)
    extra = {key: getattr(level, key) for key in _LEVEL_KEYS if getattr(level, key) != getattr(plain, key)}
    tasks = [_told_task(task) for task in level.tasks]
    return {**(tasks[0] if len(tasks) == 1 else {"tasks": tasks}), **extra}


def _told_task(task: Task) -> dict[str, Any]:
    word = word_of(task)
    if word == OWN:
        raise InputError(
            f"task '{task.name}' is of a kind of its own, which no word names: it cannot be told"
        )
    own = {each.name: getattr(task, each.name) for each in fields(task) if each.name != "name"}
    usual = {each.name: each.default for each in fields(task)}
    kept = {key: value for key, value in own.items() if key in _GAINS or value != usual[key]}
    return {"task": word, "name": task.name, **kept}
