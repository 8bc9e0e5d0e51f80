"""One row of numbers per control tick of a velocity-level session."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc.htmpc import VelocityPlan
from himpc.stack import Stack
from himpc.telemetry import Layout, arranged
from robots import Robot

Array = NDArray[np.float64]

_SCALARS = ("t", "step_us", "priority_leak", "unsolved", "place", "clearance")
_PER_JOINT = (
    "q",
    "v",
    "tau",
    "tau_demand",
    "v_limit",
    "q_lower",
    "q_upper",
    "acceleration",
    "jerk",
)
_PER_LEVEL = ("cost", "kkt", "rung", "time_us", "step", "active")


def layout_of(robot: Robot, roles: Stack) -> Layout:
    """Where each field of a row lies.

    Per joint besides the usual ones: `tau` is the velocity commanded from that tick on, `tau_demand` the
    same, `acceleration` and `jerk` the command's. Per role the fields of a task and `level/<role>`, its
    place in the window (NaN: it is not in it). Per level of the stack cost, kkt, rung, time_us, the accepted
    line-search step and the number of active constraints.
    """
    levels = tuple(level.name for level in roles)
    return arranged(robot, roles, levels, _SCALARS, _PER_JOINT, _PER_LEVEL, per_task=("level",))


RUNGS = ("solve", "widened", "keep")
"""What was needed to solve a level, in the order of need; see `himpc.htmpc.plan.LevelEvidence`."""


def write_plan(row: Array, layout: Layout, plan: VelocityPlan) -> None:
    """Writes what a plan knows into a row filled with NaN; a level that is no role's is left out."""
    fields = layout.fields
    row[fields["step_us"]] = plan.step_us
    row[fields["priority_leak"]] = np.nan if plan.leak is None else plan.leak
    row[fields["unsolved"]] = plan.unsolved
    row[fields["v_limit"]] = plan.bounds.v
    row[fields["q_lower"]], row[fields["q_upper"]] = plan.bounds.q_lower, plan.bounds.q_upper
    for level in plan.levels:
        role = level.name
        if role in layout.levels:
            row[fields[f"cost/{role}"]] = level.cost
            row[fields[f"kkt/{role}"]] = level.kkt_residual
            row[fields[f"rung/{role}"]] = RUNGS.index(level.rung)
            row[fields[f"time_us/{role}"]] = level.time_us
            row[fields[f"step/{role}"]] = float(np.mean(level.steps)) if level.steps else np.nan
            row[fields[f"active/{role}"]] = len(level.binding)
