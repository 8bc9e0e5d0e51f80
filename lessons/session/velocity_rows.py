"""One row of numbers per control tick of a velocity-level session."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from himpc.htmpc import VelocityPlan, base_joints
from himpc.kinematics.configuration import Configuration
from himpc.plan import on_axes
from himpc.references import Reference
from himpc.rotation import quaternion
from himpc.stack import Stack
from himpc.tasks import Task
from himpc.telemetry import AT_POSITION, AT_TORQUE, AT_VELOCITY, Layout, arranged
from robots import Robot

Array = NDArray[np.float64]

AT_ACCELERATION = AT_TORQUE
"""Bit of `at_bound`: at velocity level the input is the acceleration, at torque level it is the torque."""
_AT = 1e-3
"""A value whose distance from its bound is less than this share of the bound counts as at the bound."""

_SCALARS = (
    "t",
    "step_us",
    "priority_leak",
    "unsolved",
    "place",
    "left",
    "clearance",
    "clearance_reported",
    "manipulability",
)
_PER_JOINT = (
    "q",
    "v",
    "tau",
    "tau_demand",
    "v_limit",
    "a_limit",
    "q_lower",
    "q_upper",
    "at_bound",
    "acceleration",
    "jerk",
    "tau_0",
    "q_measured",
    "v_measured",
)
_PER_LEVEL = ("cost", "kkt", "fallback", "time_us", "step", "active", "bound")


def layout_of(robot: Robot, roles: Stack) -> Layout:
    """Returns the indices of the fields of a row.

    `place` is the number of completed tasks of the mission, `left` the number of the others. `clearance` is
    the least distance to an obstacle in the control period, m, and `clearance_reported` the least distance
    to the obstacles as they are reported; they are infinite if no obstacle is near. Per joint, besides the
    usual fields: `tau` is the velocity commanded from that tick on, `tau_demand` the same, `tau_0` the
    velocity commanded until then, `acceleration` and `jerk` those of the command, `at_bound` the bits
    AT_ACCELERATION, AT_VELOCITY and AT_POSITION. Per role the fields of a task and `level/<role>`, its place
    in the window (NaN: it is not in the window). Per level of the stack cost, kkt, fallback, time_us, the
    accepted line-search step, the number of active constraints and `bound`, see `write_plan`.
    `manipulability` is w = √det(J Jᵀ) of the hand's position under the arm's joints alone, m³.
    """
    levels = tuple(level.name for level in roles)
    return arranged(robot, roles, levels, _SCALARS, _PER_JOINT, _PER_LEVEL, per_task=("level",))


FALLBACKS = ("solve", "widened", "keep")
"""The fallbacks with which a level was solved, in the order in which they are tried; see
`himpc.htmpc.plan.LevelEvidence`."""


def write_plan(row: Array, layout: Layout, plan: VelocityPlan, delta: float | None) -> None:
    """Writes the values of a plan into a row filled with NaN; a level without a role is left out.

    delta: δ of (12), m (or rad), which gives `bound`: the bound on a level's error at knot 1 that the levels
    below must respect, ‖|e*| + δ‖ over its coordinates. None: (12) is not in force, and there is no such
    bound.
    """
    fields = layout.fields
    row[fields["step_us"]] = plan.step_us
    row[fields["priority_leak"]] = np.nan if plan.leak is None else plan.leak
    row[fields["unsolved"]] = plan.unsolved
    row[fields["v_limit"]], row[fields["a_limit"]] = plan.bounds.v, plan.bounds.a
    row[fields["q_lower"]], row[fields["q_upper"]] = plan.bounds.q_lower, plan.bounds.q_upper
    if delta is not None:
        for level in plan.levels[:-1]:
            if level.name in layout.levels:
                row[fields[f"bound/{level.name}"]] = float(np.linalg.norm(np.abs(level.best[0]) + delta))
    for level in plan.levels:
        role = level.name
        if role in layout.levels:
            row[fields[f"cost/{role}"]] = level.cost
            row[fields[f"kkt/{role}"]] = level.kkt_residual
            row[fields[f"fallback/{role}"]] = FALLBACKS.index(level.fallback)
            row[fields[f"time_us/{role}"]] = level.time_us
            row[fields[f"step/{role}"]] = float(np.mean(level.steps)) if level.steps else np.nan
            row[fields[f"active/{role}"]] = len(level.active.kind)


def write_truth(
    row: Array,
    layout: Layout,
    at: Configuration,
    roles: Mapping[str, Task],
    level_index: Mapping[str, int],
    references: Mapping[str, Reference],
) -> None:
    """Writes the true positions of the points, their present references, and the errors.

    level_index: by role, the place of its task in the window, counted from 1.
    references: by role, the reference of its task, as far as the task is in the window.
    """
    fields = layout.fields
    t = float(row[fields["t"]][0])
    for name, task in roles.items():
        value = task.value(at)
        row[fields[f"x/{name}"]] = quaternion(value) if value.ndim == 2 else value
        if name not in references:
            continue
        wanted, along = references[name].preview(t, 1e-3, 0), task.coordinates(at.robot)
        row[fields[f"x_d/{name}"]] = quaternion(wanted.value) if value.ndim == 2 else wanted.value
        row[fields[f"v_d/{name}"]] = on_axes(along, wanted, wanted.velocity)
        row[fields[f"a_d/{name}"]] = on_axes(along, wanted, wanted.acceleration)
        row[fields[f"error/{name}"]] = task.error(value, wanted.value)
        row[fields[f"level/{name}"]] = level_index[name]
    row[fields["manipulability"]] = manipulability(at)


def manipulability(at: Configuration) -> float:
    """w = √det(J Jᵀ), m³, with J, (3, k), the Jacobian of the tip's position for the joints of the arm
    alone."""
    arm = [joint for joint in range(at.robot.n) if joint not in base_joints(at.robot)]
    J = at.frame_jacobians()[0, :3, arm].T
    return float(np.sqrt(max(0.0, np.linalg.det(J @ J.T))))


def write_bounds(row: Array, layout: Layout) -> None:
    """Writes which joints are at a bound of the command, of its acceleration, or of the position."""
    fields = layout.fields
    q, lower, upper = row[fields["q"]], row[fields["q_lower"]], row[fields["q_upper"]]
    near = 1.0 - _AT
    with np.errstate(invalid="ignore"):
        room = np.where(np.isfinite(upper - lower), _AT * (upper - lower), 0.0)
        marks = AT_ACCELERATION * (row[fields["acceleration"]] >= near * row[fields["a_limit"]])
        marks = marks + AT_VELOCITY * (np.abs(row[fields["tau"]]) >= near * row[fields["v_limit"]])
        marks = marks + AT_POSITION * ((q <= lower + room) | (q >= upper - room))
    row[fields["at_bound"]] = marks
