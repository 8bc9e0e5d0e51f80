"""Reads the drags of a command line: the time, the target and the distance of each drag."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.arm.drive import Drag
from app.arm.orders import Order
from himpc.rotation import exp3, quaternion
from lessons.session.torque import TorqueSession
from robots import InputError
from robots.errors import unknown_name

Array = NDArray[np.float64]


def drags_of(texts: Sequence[str], session: TorqueSession, manifest: dict[str, Any]) -> list[Drag]:
    """Returns the drags in the order of their times.

    Args:
        texts: "TIME:TASK=X,Y,Z" each. TIME is in s after the start. X,Y,Z is the displacement of a position
            target along the world's axes (m), the rotation vector of an orientation target (rad), or the
            displacement of the joints (rad).
        session: the session at its start, with the initial targets.
        manifest: the manifest of the exported controller.

    Raises:
        InputError: a text cannot be read, or it names a task whose target cannot be dragged.
    """
    tasks = {each["name"]: each for each in manifest["tasks"]}
    movable = [name for name, each in tasks.items() if each["target"] in KINDS]
    places: dict[str, Array] = {}
    found = []
    for t, name, moved, text in sorted((_read(each) for each in texts), key=lambda each: each[0]):
        if name not in movable:
            raise unknown_name("task with a target that can be dragged", name, movable)
        target = session.target(name)
        assert target is not None
        raw = places.get(name, target.raw)
        size = 3 if tasks[name]["target"] != "joints" else raw.size
        if moved.size != size:
            raise InputError(f"--drag {text} has {moved.size} numbers: task '{name}' takes {size}")
        task, kind = _task(session, name), KINDS[tasks[name]["target"]]
        places[name] = kind.move(task, raw, moved)
        found.append(Drag(t, Order(tasks[name]["index"], kind.values(task, places[name]))))
    return found


def _read(text: str) -> tuple[float, str, Array, str]:
    time, _, rest = text.partition(":")
    name, _, numbers = rest.partition("=")
    try:
        t, moved = float(time), np.array([float(each) for each in numbers.split(",")])
    except ValueError:
        t, moved = np.nan, np.zeros(0)
    if not (0.0 <= t < np.inf and np.isfinite(moved).all() and name):
        raise InputError(f"--drag {text} cannot be read: write TIME:TASK=X,Y,Z, such as 2:position=0,0.05,0")
    return t, name, moved, text


def order_to(session: TorqueSession, manifest: dict[str, Any], name: str) -> Order | None:
    """Returns the order that moves the arm's target of a task to the session's target of this task; None if
    this target cannot be moved on an arm."""
    (entry,) = (each for each in manifest["tasks"] if each["name"] == name)
    target = session.target(name)
    if target is None or entry["target"] not in KINDS:
        return None
    return Order(entry["index"], KINDS[entry["target"]].values(_task(session, name), target.raw))


def _task(session: TorqueSession, name: str) -> Any:
    return next(each for level in session.settings.levels for each in level.tasks if each.name == name)


def _place(task: Any, raw: Array) -> Array:
    """Returns three coordinates: `raw` on the controlled axes, zero on the others. The kernel uses only the
    controlled axes."""
    full = np.zeros(3)
    full[_components(task, raw)] = raw
    return full


def _components(task: Any, raw: Array) -> Any:
    return getattr(task, "components", slice(raw.size))


class Kind(NamedTuple):
    """A kind of target. move: (task, raw target, displacement) → new raw target; values: (task, raw target) →
    values of an order."""

    move: Callable[[Any, Array, Array], Array]
    values: Callable[[Any, Array], Array]


KINDS = {
    "position": Kind(lambda task, raw, moved: raw + moved[_components(task, raw)], _place),
    "orientation": Kind(
        lambda task, raw, moved: exp3(moved) @ raw, lambda task, raw: np.array(quaternion(raw))
    ),
    "joints": Kind(lambda task, raw, moved: raw + moved, lambda task, raw: raw),
}
"""The kinds of targets by their names in the manifest."""
