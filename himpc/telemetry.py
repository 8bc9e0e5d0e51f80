"""The layout of a telemetry row: one row of numbers per control tick, for recordings, plots and summaries."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from himpc.cascade.level import FALLBACKS
from himpc.constants import AT_TORQUE
from himpc.kinematics.configuration import Configuration
from himpc.stack import DAMPING_LEVEL, Stack
from robots import Robot
from robots.arrays import Array

AT_ACCELERATION = AT_TORQUE
"""Bit of `at_bound`: at velocity level the input is the acceleration, at torque level it is the torque."""


class RowFields(NamedTuple):
    """The names of the fields of a row: one number per row, per joint, per level of the stack and per task.
    The fields of a level are adjacent. `fallbacks` contains the names of the fallbacks in the order of their
    codes."""

    scalars: tuple[str, ...]
    per_joint: tuple[str, ...]
    per_level: tuple[str, ...]
    fallbacks: tuple[str, ...]
    per_task: tuple[str, ...] = ()


# fmt: off
TORQUE_ROW = RowFields(
    scalars=(
        "t", "step_us", "priority_leak", "dynamic_leak", "gauge_norm", "gauge_radius", "unsolved",
        "iterations", "late", "contact_depth", "contact_force", "distance", "distance_kept",
    ),
    per_joint=(
        "q", "v", "tau", "tau_demand", "tau_lower", "tau_upper", "v_limit", "q_lower", "q_upper", "at_bound",
        "delta_tau", "tau_0", "q_measured", "v_measured", "v_limit_lowered",
    ),
    per_level=("cost", "kkt", "fallback", "time_us", "leak", "active"),
    fallbacks=FALLBACKS,
)
VELOCITY_ROW = RowFields(
    scalars=(
        "t", "step_us", "priority_leak", "unsolved", "place", "left", "clearance", "clearance_reported",
        "manipulability",
    ),
    per_joint=(
        "q", "v", "tau", "tau_demand", "v_limit", "a_limit", "q_lower", "q_upper", "at_bound", "acceleration",
        "jerk", "tau_0", "q_measured", "v_measured",
    ),
    per_level=("cost", "kkt", "fallback", "time_us", "step", "active", "bound"),
    fallbacks=("solve", "widened", "keep"),
    per_task=("level",),
)
# fmt: on


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

    In every row, `q` and `v` are the plant's state, `q_measured` and `v_measured` the values that the
    controller received. `tau` is the torque that is applied from this tick on, `tau_demand` the controller's,
    and `tau_0` the torque that acted until this tick; at velocity level they are velocities, and `tau` equals
    `tau_demand`. `v_limit` is the user's velocity limit. `at_bound` contains the bits of the constraints
    that are active for a joint; at velocity level AT_ACCELERATION, AT_VELOCITY and AT_POSITION.

    Fields of a task: `x/<task>` and `x_d/<task>` contain its coordinates, or a quaternion x y z w.
    `error/<task>`, `v_d/<task>` and `a_d/<task>` have one number per coordinate; for a task that points an
    axis at a point, `v_d` and `a_d` have three numbers. Fields of a level: cost, kkt, fallback (index into
    `fallbacks`), time_us and active (number of active constraints); NaN for a level that was not solved.

    Only at torque level: `v_limit_lowered` is the velocity limit that the controller imposed: a guard lowers
    it, for example while the robot comes to rest before an obstacle. `contact_depth` (m) and `contact_force`
    (N) are the deepest penetration and the largest force of the tick that begins with the row; both are 0
    without a contact. The plant's time step of 1 ms resolves forces at rest, but not impacts: with 0.25 ms
    their peaks were up to 1.6 times as large. `distance` (m) is that of the nearest pair of two links, or of
    a link and an object; NaN if no distance is measured. `distance_kept` (m) is the distance to keep, d_safe
    with its margin; NaN if no distance is kept. Per level: leak.

    Only at velocity level: `place` is the number of completed tasks of the mission, `left` the number of the
    others. `clearance` is the least distance to an obstacle in the control period, m, and
    `clearance_reported` the least distance to the obstacles as they are reported; they are infinite if no
    obstacle is near. `acceleration` and `jerk` are those of the command. `manipulability` is w = √det(J Jᵀ)
    of the hand's position under the arm's joints alone, m³. Per task: `level/<task>`, its place in the
    mission's window (NaN: it is not in the window). Per level: `step`, the accepted step of the line search,
    and `bound`, the bound ‖|e*| + δ‖ of (12) on its error at the next knot (NaN if there is none).
    """

    size: int
    fields: dict[str, slice]
    tasks: tuple[TaskInfo, ...]
    levels: tuple[str, ...]
    joints: tuple[str, ...]
    fallbacks: tuple[str, ...] = FALLBACKS


def layout_of(robot: Robot, stack: Stack) -> Layout:
    """Returns the layout at torque level for a robot and all levels of a stack. The order of the levels has
    no effect on the layout; the damping level comes last."""
    ordered = tuple(sorted(stack, key=lambda level: level.name))
    return _arranged(robot, ordered, (*ordered, DAMPING_LEVEL), TORQUE_ROW)


def velocity_layout_of(robot: Robot, stack: Stack) -> Layout:
    """Returns the layout at velocity level for a robot and all levels of a stack, one per role."""
    return _arranged(robot, stack, stack, VELOCITY_ROW)


def _arranged(robot: Robot, stack: Stack, levels: Stack, row: RowFields) -> Layout:
    """Returns a layout with the fields in this order: scalars, joints, tasks of the stack, levels."""
    fields: dict[str, slice] = {}
    size = 0

    def add(name: str, width: int) -> None:
        nonlocal size
        fields[name] = slice(size, size + width)
        size += width

    for name in row.scalars:
        add(name, 1)
    for name in row.per_joint:
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
            for name in row.per_task:
                add(f"{name}/{task.name}", 1)
    names = tuple(level.name for level in levels)
    for level in names:
        for name in row.per_level:
            add(f"{name}/{level}", 1)
    return Layout(size, fields, tuple(tasks), names, robot.joint_names, row.fallbacks)


def relaid(rows: Array, old: Layout, new: Layout) -> Array:
    """Converts rows, (k, size), to another layout. A field that the rows do not contain with the same width
    becomes NaN."""
    new_rows = np.full((len(rows), new.size), math.nan)
    for name, where in new.fields.items():
        before = old.fields.get(name)
        if before is not None and before.stop - before.start == where.stop - where.start:
            new_rows[:, where] = rows[:, before]
    return new_rows
