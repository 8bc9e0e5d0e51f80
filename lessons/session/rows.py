"""The numbers of a row that a session computes from the plant's true state, and the row at velocity level."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from himpc.constants import AT_POSITION, AT_VELOCITY
from himpc.htmpc import VelocityPlan, base_joints
from himpc.kinematics.configuration import Configuration
from himpc.plan import AtOnce, Plan
from himpc.plan.row import as_numbers, write_levels, write_reference
from himpc.references import Reference
from himpc.stack import Stack
from himpc.tasks import Task
from himpc.telemetry import AT_ACCELERATION, Layout
from robots.arrays import Array


def dynamic_leak(M: Array, done: AtOnce) -> float:
    """max over p of ‖J_p M⁻¹(τ − τ_{≤p})‖∞ with the plant's M: the true effect of the lower levels on level
    p.

    Args:
        M: the plant's mass matrix, (n, n).
        done: at least two levels, with the increments τ_{≤p} − τ₀ of each.
    """
    first = done.increments
    acceleration = np.linalg.solve(M, (first[-1] - first[:-1]).T).T
    effects = (np.abs(J @ a).max() for J, a in zip(done.jacobians, acceleration, strict=True) if len(J))
    return float(max(effects, default=0.0))


def at_once(plan: Plan, stack: Stack, configuration: Configuration) -> AtOnce:
    """`Plan.at_once` for a controller whose plan does not have it.

    Args:
        plan: only its levels are used.
        stack: the levels' tasks.
        configuration: the plant's true positions.
    """
    tasks = {level.name: level.tasks for level in stack}
    nothing = np.empty((0, configuration.q.size))
    return AtOnce(
        np.array([level.U[0] for level in plan.levels]),
        [
            np.concatenate(
                [nothing, *(task.jacobian(configuration)[0] for task in tasks.get(level.name, ()))]
            )
            for level in plan.levels[:-1]
        ],
    )


_AT = 1e-3
"""A value whose distance from its bound is less than this share of the bound counts as at the bound."""


def write_velocity_plan(row: Array, layout: Layout, plan: VelocityPlan, delta: float | None) -> None:
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
    levels = [level for level in plan.levels if level.name in layout.levels]
    write_levels(row, layout, levels)
    for level in levels:
        row[fields[f"step/{level.name}"]] = level.step
        if delta is not None and level is not plan.levels[-1]:
            row[fields[f"bound/{level.name}"]] = float(np.linalg.norm(np.abs(level.best[0]) + delta))


def write_truth(
    row: Array,
    layout: Layout,
    t: float,
    at: Configuration,
    roles: Mapping[str, Task],
    level_index: Mapping[str, int],
    references: Mapping[str, Reference],
) -> None:
    """Writes the true positions of the points, their present references, and the errors.

    t: the time, s.
    at: the plant's true state.
    level_index: by role, the place of its task in the window, counted from 1.
    references: by role, the reference of its task, as far as the task is in the window.
    """
    fields = layout.fields
    for info in layout.tasks:
        name, task = info.name, roles[info.name]
        value = task.value(at)
        row[fields[f"x/{name}"]] = as_numbers(value)
        if name in references:
            wanted = references[name].preview(t, 1e-3, 0)
            write_reference(row, layout, info, wanted)
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
