"""A plan as a row of telemetry."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import ActiveRows
from himpc.limits import Rows
from himpc.limits.constraints import bit_of
from himpc.plan.plan import Plan
from himpc.references import Preview
from himpc.rotation import quaternion
from himpc.tasks.axes import AXES
from himpc.telemetry import FALLBACKS, PER_LEVEL, Layout

Array = NDArray[np.float64]


def write_plan(row: Array, layout: Layout, plan: Plan, ahead: Mapping[str, Preview]) -> None:
    """Writes the data of a plan and the references into a row. The session adds the time, the states and the
    fields that need the plant's M. Fields for which the plan has no data become NaN."""
    fields = layout.fields
    if plan.fill is None or not plan.fill(row, layout):
        row.fill(math.nan)
        _write_by_field(row, layout, plan)
        _write_references(row, layout, ahead)
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


def _write_references(row: Array, layout: Layout, ahead: Mapping[str, Preview]) -> None:
    fields = layout.fields
    for task in layout.tasks:
        preview = ahead[task.name]
        value = preview.value
        row[fields[f"x_d/{task.name}"]] = quaternion(value) if value.ndim == 2 else value
        row[fields[f"v_d/{task.name}"]] = on_axes(task.coordinates, preview, preview.velocity)
        row[fields[f"a_d/{task.name}"]] = on_axes(task.coordinates, preview, preview.acceleration)


def on_axes(coordinates: Sequence[str], preview: Preview, motion: Array) -> Array:
    """Returns the present ẋ_d or ẍ_d. For a rotation, whose motion has components along all axes, it returns
    the components along the task's axes."""
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
    # Six fields of n numbers each, which are adjacent in the order of the layout.
    limits = plan.limits
    block = row[fields["tau_demand"].start : fields["q_upper"].stop].reshape(6, -1)
    block[0], block[1], block[2] = plan.tau, limits.tau_lower, limits.tau_upper
    block[3], block[4], block[5] = limits.v_limit, limits.q_lower, limits.q_upper
    for name, value in plan.values.items():
        where = fields.get(f"x/{name}")
        if where is not None:
            row[where] = quaternion(value) if value.ndim == 2 else value
            row[fields[f"error/{name}"]] = plan.errors[name]
    # The per-level fields are adjacent, level by level, in the order of PER_LEVEL.
    base = fields[f"cost/{layout.levels[0]}"].start
    evidence = [math.nan] * (len(PER_LEVEL) * len(layout.levels))
    marks = [0] * len(layout.joints)
    for level in plan.levels:
        start = fields[f"cost/{level.name}"].start - base
        evidence[start : start + len(PER_LEVEL)] = (
            level.cost,
            level.kkt_residual,
            FALLBACKS.index(level.fallback),
            level.time_us,
            level.leak,
            level.active.row.size,
        )
        if level.active.row.size:
            _mark_bounds(marks, level.active, plan.rows)
    row[base : base + len(evidence)] = evidence
    if plan.behind is not None:
        _mark_bounds(marks, plan.behind.solution.active, plan.behind.rows)
    row[fields["at_bound"]] = marks


def _mark_bounds(marks: list[int], active: ActiveRows, rows: Rows) -> None:
    entries = zip(active.row.tolist(), active.joint.tolist(), active.multiplier.tolist(), strict=True)
    for row, column, multiplier in entries:
        bit = bit_of(rows.constraint(row, column, multiplier > 0))
        for joint in rows.joints_of(row, column):
            marks[joint] |= bit
