"""One row of numbers per control tick: what recordings, plots and summaries are made of."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import RUNGS, ActiveRows
from himpc.constants import AT_POSITION, AT_TORQUE, AT_VELOCITY
from himpc.kinematics.configuration import Configuration
from himpc.limits import Rows
from himpc.plan import Plan
from himpc.references import Preview
from himpc.rotation import quaternion
from himpc.stack import DAMPING_LEVEL, Stack
from himpc.tasks.axes import AXES
from robots import Robot

Array = NDArray[np.float64]

__all__ = [
    "AT_POSITION",
    "AT_TORQUE",
    "AT_VELOCITY",
    "RUNGS",
    "Layout",
    "TaskInfo",
    "arranged",
    "layout_of",
    "relaid",
    "write_plan",
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
)
_PER_LEVEL = ("cost", "kkt", "rung", "time_us", "leak", "active")


@dataclass(frozen=True)
class TaskInfo:
    """A task as telemetry sees it: stable name, its level's name, coordinates and unit ("m" or "rad")."""

    name: str
    level: str
    coordinates: tuple[str, ...]
    unit: str


@dataclass(frozen=True)
class Layout:
    """Where each field of a row lies.

    `q` and `v` are the plant's, `q_measured` and `v_measured` what the controller was given; `tau_0` is what
    acted until then. Per task `x/<task>` and `x_d/<task>` (coordinates, or a quaternion x y z w),
    `error/<task>`, `v_d/<task>`, `a_d/<task>` (m each; three where the target is a point to look at); per
    level the fields cost, kkt, rung (index into RUNGS), time_us, leak and active (number of binding
    constraints), NaN where the level was not solved.
    """

    size: int
    fields: dict[str, slice]
    tasks: tuple[TaskInfo, ...]
    levels: tuple[str, ...]
    joints: tuple[str, ...]


def layout_of(robot: Robot, stack: Stack) -> Layout:
    """The layout for a robot and all levels of a stack, whatever their order; damping comes last."""
    ordered = tuple(sorted(stack, key=lambda level: level.name))
    levels = (*(level.name for level in ordered), DAMPING_LEVEL.name)
    return arranged(robot, ordered, levels, _SCALARS, _PER_JOINT, _PER_LEVEL)


def arranged(
    robot: Robot,
    stack: Stack,
    levels: tuple[str, ...],
    scalars: Sequence[str],
    per_joint: Sequence[str],
    per_level: Sequence[str],
    per_task: Sequence[str] = (),
) -> Layout:
    """Fields side by side in this order: scalars, joints, tasks, levels.

    Args:
        robot: gives the width of joint fields.
        stack: gives the tasks.
        levels: names of the levels.
        scalars, per_joint, per_level: names of the fields of each kind.
        per_task: names of further fields of one number per task.
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
    """Rows, (k, size), as another layout has them; NaN where they have nothing of that name and width."""
    found = np.full((len(rows), new.size), math.nan)
    for name, where in new.fields.items():
        before = old.fields.get(name)
        if before is not None and before.stop - before.start == where.stop - where.start:
            found[:, where] = rows[:, before]
    return found


def write_plan(row: Array, layout: Layout, plan: Plan, ahead: Mapping[str, Preview]) -> None:
    """Writes what a plan knows, and the references, into a row; the session adds time, states and what needs
    the plant's M. Fields that the plan says nothing about become NaN."""
    fields = layout.fields
    if plan.fill is None or not plan.fill(row, layout):
        row.fill(math.nan)
        _write_by_field(row, layout, plan)
        _write_references(row, layout, ahead)
    row[fields["step_us"].start] = plan.step_us
    row[fields["unsolved"].start] = plan.unsolved
    row[fields["iterations"].start] = plan.iterations


def _write_references(row: Array, layout: Layout, ahead: Mapping[str, Preview]) -> None:
    fields = layout.fields
    for task in layout.tasks:
        preview = ahead[task.name]
        value = preview.value
        row[fields[f"x_d/{task.name}"]] = quaternion(value) if value.ndim == 2 else value
        row[fields[f"v_d/{task.name}"]] = on_axes(task.coordinates, preview, preview.velocity)
        row[fields[f"a_d/{task.name}"]] = on_axes(task.coordinates, preview, preview.acceleration)


def on_axes(coordinates: Sequence[str], preview: Preview, motion: Array) -> Array:
    """ẋ_d or ẍ_d now; of a rotation, which turns about all axes, along those of the task."""
    now = motion[0]
    if preview.value.ndim == 1 or now.size == len(coordinates):
        return now
    return now[[AXES.index(axis) for axis in coordinates]]


def _write_by_field(row: Array, layout: Layout, plan: Plan) -> None:
    fields = layout.fields
    leak = plan.leak
    row[fields["priority_leak"]] = math.nan if leak is None else leak
    row[fields["delta_tau"]] = plan.tau - plan.tau_0
    row[fields["tau_0"]] = plan.tau_0
    # Six fields of n numbers each that stand side by side in the order of _PER_JOINT.
    limits = plan.limits
    block = row[fields["tau_demand"].start : fields["q_upper"].stop].reshape(6, -1)
    block[0], block[1], block[2] = plan.tau, limits.tau_lower, limits.tau_upper
    block[3], block[4], block[5] = limits.v_limit, limits.q_lower, limits.q_upper
    for name, value in plan.values.items():
        where = fields.get(f"x/{name}")
        if where is not None:
            row[where] = quaternion(value) if value.ndim == 2 else value
            row[fields[f"error/{name}"]] = plan.errors[name]
    # The per-level fields stand side by side, level by level, in the order of _PER_LEVEL.
    base = fields[f"cost/{layout.levels[0]}"].start
    evidence = [math.nan] * (len(_PER_LEVEL) * len(layout.levels))
    marks = [0] * len(layout.joints)
    for level in plan.levels:
        start = fields[f"cost/{level.name}"].start - base
        evidence[start : start + len(_PER_LEVEL)] = (
            level.cost,
            level.kkt_residual,
            RUNGS.index(level.rung),
            level.time_us,
            level.leak,
            level.active.row.size,
        )
        if level.active.row.size:
            _mark_bounds(marks, level.active, plan.rows)
    row[base : base + len(evidence)] = evidence
    row[fields["at_bound"]] = marks


_BITS = {"torque": AT_TORQUE, "velocity": AT_VELOCITY, "position": AT_POSITION}


def _mark_bounds(marks: list[int], active: ActiveRows, rows: Rows) -> None:
    found = zip(active.row.tolist(), active.joint.tolist(), active.multiplier.tolist(), strict=True)
    for row, joint, multiplier in found:
        marks[joint] |= _BITS[rows.kind(row, joint, multiplier > 0)]
