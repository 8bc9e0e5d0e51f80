"""The order of levels, changed by name."""

from __future__ import annotations

from typing import Any

from himpc.stack import Stack
from robots import InputError
from robots.errors import unknown_name


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
