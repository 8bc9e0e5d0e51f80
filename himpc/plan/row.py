"""A plan as a row of telemetry."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from himpc.cascade.level import ActiveRows
from himpc.limits import Rows
from himpc.limits.constraints import bit_of
from himpc.plan.plan import Plan, SolvedLevel
from himpc.references import Preview
from himpc.rotation import quaternion
from himpc.tasks.axes import AXES
from himpc.telemetry import Layout, TaskInfo
from robots.arrays import Array


def write_plan(row: Array, layout: Layout, plan: Plan, ahead: Mapping[str, Preview]) -> None:
    """Writes the data of a plan and the references into a row. The session adds the time, the states and the
    fields that need the plant's M. Fields for which the plan has no data become NaN."""
    fields = layout.fields
    if plan.fill is None or not plan.fill(row, layout):
        row.fill(math.nan)
        _write_by_field(row, layout, plan)
        for task in layout.tasks:
            write_reference(row, layout, task, ahead[task.name])
    elif plan.behind is not None:
        _write_behind(row, layout, plan)
    row[fields["step_us"].start] = plan.step_us
    row[fields["unsolved"].start] = plan.unsolved
    row[fields["iterations"].start] = plan.iterations


def _write_behind(row: Array, layout: Layout, plan: Plan) -> None:
    """Writes the data of a filter that follows the levels into the row of the levels."""
    fields, behind = layout.fields, plan.behind
    assert behind is not None
    row[fields["tau_demand"]], row[fields["delta_tau"]] = plan.tau, plan.tau - plan.tau_0
    leak = row[fields["priority_leak"].start]
    if not math.isnan(leak):
        row[fields["priority_leak"]] = max(leak, behind.solution.leak)
    marks = [0 if math.isnan(mark) else int(mark) for mark in row[fields["at_bound"]].tolist()]
    _mark_bounds(marks, behind.solution.active, behind.rows)
    row[fields["at_bound"]] = marks


def write_reference(row: Array, layout: Layout, task: TaskInfo, preview: Preview) -> None:
    """Writes the present reference of a task: x_d, ẋ_d and ẍ_d. Of the motion of a rotation, which has
    components along all axes, it writes the components along the task's axes."""
    fields = layout.fields
    row[fields[f"x_d/{task.name}"]] = as_numbers(preview.value)
    for name, motion in (("v_d", preview.velocity[0]), ("a_d", preview.acceleration[0])):
        if preview.value.ndim == 2 and motion.size != len(task.coordinates):
            motion = motion[[AXES.index(axis) for axis in task.coordinates]]
        row[fields[f"{name}/{task.name}"]] = motion


def as_numbers(value: Array) -> Array:
    """Returns a value of a task as a row contains it: a rotation matrix as a quaternion x y z w."""
    return quaternion(value) if value.ndim == 2 else value


def write_levels(row: Array, layout: Layout, levels: Iterable[SolvedLevel]) -> None:
    """Writes the fields that levels have at torque level and at velocity level."""
    for level in levels:
        first = layout.fields[f"cost/{level.name}"].start  # the next three fields follow
        row[first], row[first + 1] = level.cost, level.kkt_residual
        row[first + 2], row[first + 3] = layout.fallbacks.index(level.fallback), level.time_us
        row[layout.fields[f"active/{level.name}"].start] = len(level.active)


def _write_by_field(row: Array, layout: Layout, plan: Plan) -> None:
    fields = layout.fields
    leak = plan.leak
    row[fields["priority_leak"]] = math.nan if leak is None else leak
    row[fields["delta_tau"]] = plan.tau - plan.tau_0
    row[fields["tau_0"]] = plan.tau_0
    # Six fields of n numbers each, which are adjacent in the order of the layout.
    limits = plan.limits
    block = row[fields["tau_demand"].start : fields["q_upper"].stop].reshape(6, -1)
    block[0], block[1], block[2] = plan.tau, limits.tau_lower, limits.tau_upper
    block[3], block[4], block[5] = limits.v_limit, limits.q_lower, limits.q_upper
    for task in layout.tasks:
        if task.name in plan.values:
            row[fields[f"x/{task.name}"]] = as_numbers(plan.values[task.name])
            row[fields[f"error/{task.name}"]] = plan.errors[task.name]
    write_levels(row, layout, plan.levels)
    marks = [0] * len(layout.joints)
    for level in plan.levels:
        row[fields[f"leak/{level.name}"].start] = level.leak
        if len(level.active):
            _mark_bounds(marks, level.active, plan.rows)
    if plan.behind is not None:
        _mark_bounds(marks, plan.behind.solution.active, plan.behind.rows)
    row[fields["at_bound"]] = marks


def _mark_bounds(marks: list[int], active: ActiveRows, rows: Rows) -> None:
    entries = zip(active.row.tolist(), active.joint.tolist(), active.multiplier.tolist(), strict=True)
    for row, column, multiplier in entries:
        bit = bit_of(rows.constraint(row, column, multiplier > 0))
        for joint in rows.joints_of(row, column):
            marks[joint] |= bit
