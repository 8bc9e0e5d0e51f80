"""The tasks whose targets can be dragged, and the conversion of their coordinates to points and rotations."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import viser.transforms as vtf

from app.link.messages import Ready, TaskView


def in_order(ready: Ready) -> list[TaskView]:
    return list({task.level: task for task in ready.tasks}.values())


def draggable(tasks: tuple[TaskView, ...]) -> tuple[TaskView | None, TaskView | None]:
    """Returns the first position target of the stack, and an orientation target of the same frame."""
    position = next((t for t in tasks if t.kind == "position" and t.raw is not None), None)
    if position is None:
        return None, None
    orientation = next(
        (t for t in tasks if t.kind == "orientation" and t.raw is not None and t.frame == position.frame),
        None,
    )
    return position, orientation


def raw(task: TaskView) -> np.ndarray:
    assert task.raw is not None
    return task.raw


def full(task: TaskView, values: np.ndarray | None, else_: np.ndarray) -> np.ndarray:
    """Returns the point `else_` with `values` as its controlled coordinates. Values from before a change of
    the task's axes have another number of coordinates and are ignored."""
    point = np.array(else_, float)
    if values is not None and values.shape == (len(task.axes),):
        point[["xyz".index(axis) for axis in task.axes]] = values
    return point


def of_task(task: TaskView, targets: Mapping[str, np.ndarray]) -> np.ndarray | None:
    """Returns the position or rotation of a draggable task's target; None if there is no target. None also if
    the target has other coordinates, after a change of the task's axes, its kind or the stack."""
    found = targets.get(task.name)
    return None if found is None or found.shape != raw(task).shape else found


def xyzw(rotation: np.ndarray) -> tuple[float, ...]:
    w, x, y, z = vtf.SO3.from_matrix(rotation).wxyz
    return float(x), float(y), float(z), float(w)
