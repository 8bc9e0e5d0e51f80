"""The layout of a telemetry row: one row of numbers per control tick, for recordings, plots and summaries."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import FALLBACKS
from himpc.constants import AT_POSITION, AT_TORQUE, AT_VELOCITY
from himpc.kinematics.configuration import Configuration
from himpc.stack import DAMPING_LEVEL, Stack
from robots import Robot

Array = NDArray[np.float64]

__all__ = [
    "AT_POSITION",
    "AT_TORQUE",
    "AT_VELOCITY",
    "FALLBACKS",
    "PER_LEVEL",
    "Layout",
    "TaskInfo",
    "arranged",
    "layout_of",
    "relaid",
]

_SCALARS = (
    "t",
    "step_us",
    "priority_leak",
    "dynamic_leak",
    "gauge_norm",
    "gauge_radius",
    "unsolved",
    "iterations",
    "late",
    "contact_depth",
    "contact_force",
    "distance",
    "distance_kept",
)
_PER_JOINT = (
    "q",
    "v",
    "tau",
    "tau_demand",
    "tau_lower",
    "tau_upper",
    "v_limit",
    "q_lower",
    "q_upper",
    "at_bound",
    "delta_tau",
    "tau_0",
    "q_measured",
    "v_measured",
    "v_limit_lowered",
)
PER_LEVEL = ("cost", "kkt", "fallback", "time_us", "leak", "active")
"""The fields of each level, one number each, in this order."""


@dataclass(frozen=True)
class TaskInfo:
    """The data of a task in telemetry: stable name, its level's name, coordinates and unit ("m" or "rad")."""

    name: str
    level: str
    coordinates: tuple[str, ...]
    unit: str


@dataclass(frozen=True)
class Layout:
    """The position of each field in a row.

    `q` and `v` are the plant's state, `q_measured` and `v_measured` the values that the controller received;
    `tau_0` is the torque that acted until this tick. `v_limit` is the user's velocity limit, and
    `v_limit_lowered` the limit that the controller imposed: a guard lowers it, for example while the robot
    comes to rest before an obstacle. `contact_depth` (m) and `contact_force` (N) are the
    deepest penetration and the largest force of the tick that begins with the row; both are 0 without a
    contact. The plant's time step of 1 ms resolves forces at rest, but not impacts: with 0.25 ms their peaks
    were up to 1.6 times as large. `distance` (m) is that of the nearest pair of two links, or of a link and
    an object; NaN if no distance is measured. `distance_kept` (m) is the distance to keep, d_safe with its
    margin; NaN if no distance is kept.

    Fields of a task: `x/<task>` and `x_d/<task>` contain its coordinates, or a quaternion x y z w.
    `error/<task>`, `v_d/<task>` and `a_d/<task>` have one number per coordinate; for a task that points an
    axis at a point, `v_d` and `a_d` have three numbers. Fields of a level: cost, kkt, fallback (index into
    FALLBACKS), time_us, leak and active (number of active constraints); NaN for a level that was not solved.
    """

    size: int
    fields: dict[str, slice]
    tasks: tuple[TaskInfo, ...]
    levels: tuple[str, ...]
    joints: tuple[str, ...]


def layout_of(robot: Robot, stack: Stack) -> Layout:
    """Returns the layout for a robot and all levels of a stack. The order of the levels has no effect on the
    layout; the damping level comes last."""
    ordered = tuple(sorted(stack, key=lambda level: level.name))
    levels = (*(level.name for level in ordered), DAMPING_LEVEL.name)
    return arranged(robot, ordered, levels, _SCALARS, _PER_JOINT, PER_LEVEL)


def arranged(
    robot: Robot,
    stack: Stack,
    levels: tuple[str, ...],
    scalars: Sequence[str],
    per_joint: Sequence[str],
    per_level: Sequence[str],
    per_task: Sequence[str] = (),
) -> Layout:
    """Builds a layout with the fields in this order: scalars, joints, tasks, levels.

    Args:
        robot: gives the width of joint fields.
        stack: gives the tasks.
        levels: names of the levels.
        scalars, per_joint, per_level: names of the fields of each kind.
        per_task: names of further fields with one number per task.
    """
    fields: dict[str, slice] = {}
    size = 0

    def add(name: str, width: int) -> None:
        nonlocal size
        fields[name] = slice(size, size + width)
        size += width

    for name in scalars:
        add(name, 1)
    for name in per_joint:
        add(name, robot.n)
    tasks = []
    probe = Configuration(robot, robot.model.createData(), robot.home, np.zeros(robot.n))
    for level in stack:
        for task in level.tasks:
            coordinates = task.coordinates(robot)
            tasks.append(TaskInfo(task.name, level.name, coordinates, task.unit))
            value, target = task.value(probe), task.target(probe)
            add(f"x/{task.name}", 4 if value.ndim == 2 else value.size)
            add(f"x_d/{task.name}", 4 if target.ndim == 2 else target.size)
            add(f"error/{task.name}", len(coordinates))
            for name in ("v_d", "a_d"):
                add(f"{name}/{task.name}", len(coordinates) if target.ndim == 2 else target.size)
            for name in per_task:
                add(f"{name}/{task.name}", 1)
    for level in levels:
        for name in per_level:
            add(f"{name}/{level}", 1)
    return Layout(size, fields, tuple(tasks), levels, robot.joint_names)


def relaid(rows: Array, old: Layout, new: Layout) -> Array:
    """Converts rows, (k, size), to another layout. A field that the rows do not contain with the same width
    becomes NaN."""
    new_rows = np.full((len(rows), new.size), math.nan)
    for name, where in new.fields.items():
        before = old.fields.get(name)
        if before is not None and before.stop - before.start == where.stop - where.start:
            new_rows[:, where] = rows[:, before]
    return new_rows
