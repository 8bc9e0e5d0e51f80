"""The drags of a command line: at which time which target moves how far."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

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
        texts: "TIME:TASK=X,Y,Z" each: seconds after the start; how far the target of a position moves along
            the world's axes (m); turns about them for an orientation (rad, a rotation vector); joints (rad).
        session: at its start, with the targets where they are.
        manifest: of the exported controller.

    Raises:
        InputError: a text cannot be read, or names a task without a target that can be dragged.
    """
    tasks = {each["name"]: each for each in manifest["tasks"]}
    movable = [name for name, each in tasks.items() if each["target"] in _MOVED]
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
        task = next(each for level in session.settings.levels for each in level.tasks if each.name == name)
        places[name], values = _MOVED[tasks[name]["target"]](task, raw, moved)
        found.append(Drag(t, Order(tasks[name]["index"], values)))
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


def _position(task: Any, raw: Array, moved: Array) -> tuple[Array, Array]:
    """The new raw target, and all three coordinates, of which the kernel takes those of the task."""
    where = getattr(task, "components", slice(raw.size))
    full = np.zeros(3)
    full[where] = raw + moved[where]
    return full[where], full


def _orientation(task: Any, raw: Array, moved: Array) -> tuple[Array, Array]:
    turned = exp3(moved) @ raw
    return turned, np.array(quaternion(turned))


def _joints(task: Any, raw: Array, moved: Array) -> tuple[Array, Array]:
    return raw + moved, raw + moved


_MOVED = {"position": _position, "orientation": _orientation, "joints": _joints}
