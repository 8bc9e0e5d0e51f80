"""Draggable targets: their start, and the values to which they may be moved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from himpc.controllers import dragged_target
from himpc.references import JOINT_CAPS, POSITION_CAPS, ROTATION_CAPS, Reference, Target
from himpc.rotation import from_quaternion
from himpc.stack import about, essence
from himpc.tasks import Pointing, Task
from himpc.tasks.axes import OnAxes
from robots import InputError
from robots.arrays import Array
from robots.errors import unknown_name


def target_at(task: Task, value: Array) -> Target:
    """Returns a draggable target of a task. It starts at `value`, a result of `Task.target`."""
    if value.ndim == 2:
        return dragged_target(value, ROTATION_CAPS)
    in_space = task.unit == "m" or isinstance(task, Pointing)
    return dragged_target(value, POSITION_CAPS if in_space else JOINT_CAPS)


def kept(task: Task, reference: Reference | None, value: Array) -> Reference:
    """Returns the reference of a task in a changed stack: the scene's reference if it has the task's
    coordinates, else a draggable target at `value`.

    Args:
        task: the task.
        reference: the scene's, if it has one for a task of that name.
        value: a result of its `Task.target`.
    """
    if reference is not None:
        preview = reference.preview(0.0, 1e-3, 1)
        if preview.value.shape == value.shape:
            return reference
    return target_at(task, value)


def carried(old: Task, reference: Reference, task: Task, value: Array) -> Reference:
    """Returns the reference, without a jump, of a task that replaces an old task of the same name.

    A task that controls the same coordinates keeps the reference. If the task controls other axes of the same
    frame, its target keeps its value along the axes that remain, and has the robot's present value along the
    new axes.
    """
    if essence(old) == essence(task):
        return reference
    target = target_at(task, value)
    if about(old) == about(replace(task, name=old.name)) and isinstance(reference, Target):
        if value.ndim == 2:
            target = target_at(task, reference.value)
            target.move(reference.raw)
        elif isinstance(old, OnAxes) and isinstance(task, OnAxes):
            both = [axis for axis in task.axes if axis in old.axes]
            new, then = [task.axes.index(axis) for axis in both], [old.axes.index(axis) for axis in both]
            start, raw = value.copy(), value.copy()
            start[new], raw[new] = reference.value[then], reference.raw[then]
            target = target_at(task, start)
            target.move(raw)
    return target


def move_target(
    tasks: Mapping[str, Task], references: Mapping[str, Reference], name: str, value: tuple[float, ...]
) -> None:
    """Moves a task's target: position, point or distance (m), quaternion (x y z w) or joints (rad).

    Raises:
        InputError: no such task, a reference that cannot be moved, or a value that does not fit the task.
    """
    if name not in tasks:
        raise unknown_name("task", name, tasks)
    target = references.get(name)
    if not isinstance(target, Target):
        raise InputError(
            f"the target of task '{name}' follows a fixed motion in this scene: choose a hold scene"
        )
    array = np.array(value, float)
    if not np.isfinite(array).all():
        raise InputError(f"the target of task '{name}' is not finite: give finite numbers")
    task = tasks[name]
    if target.raw.ndim == 2:
        if array.size != 4 or not array.any():
            raise InputError(f"the target of task '{name}' must be a quaternion x y z w")
        target.move(from_quaternion(array))
        return
    if isinstance(task, OnAxes) and array.size == 3:
        array = array[task.components]
    if array.shape != target.raw.shape:
        raise InputError(f"the target of task '{name}' needs {target.raw.size} numbers, not {array.size}")
    target.move(array)
