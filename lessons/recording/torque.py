"""The part of a run's summary that only torque-level runs have."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from himpc.catalog import qp_method
from lessons.recording.figures import position_share, qp_figures, task_figures
from lessons.recording.recording import Recording
from lessons.settings.period import warning
from lessons.settings.values import peak

Array = NDArray[np.float64]


def block(recording: Recording) -> dict[str, Any]:
    """Returns the part of `lessons.recording.summary.summary` for the torque level."""
    settings, layout = recording.session.settings, recording.layout
    level_index = {level.name: index for index, level in enumerate(settings.levels, start=1)}
    tasks = sorted(layout.tasks, key=lambda task: level_index[task.level])
    iterations = recording["iterations"]
    return {
        "tasks": [task_figures(recording, task, level_index[task.level]) for task in tasks],
        "levels": _levels(recording),
        "average_cost": [_average_cost(recording, level.name) for level in settings.levels if level.enabled],
        "limits": _limits(recording),
        "solver": {
            "backend": qp_method(settings.controller, settings.solver),
            "route": "printed" if settings.controller == "himpc_printed" else "compiled",
            **qp_figures(recording),
            "iterations": {"mean": float(iterations.mean()), "max": float(iterations.max())},
        },
        "dynamic_leak_max": peak(recording["dynamic_leak"]),
        "bound_active_share": float((recording["at_bound"] > 0).any(axis=1).mean()),
        "late_ticks": int(recording["late"].sum()),
        "warning": warning(recording.session.robot, settings) or None,
        "contact": _contact(recording),
    }


def _contact(recording: Recording) -> dict[str, float]:
    """Returns the deepest penetration (m), the largest force (N) and the time in contact (s), with the
    robot's own links and with the world; a contact counts for the whole tick in which it occurs. The largest
    force is a peak, which depends on the plant's time step (see `himpc.telemetry.Layout`)."""
    force, depth = recording["contact_force"], recording["contact_depth"]
    touching = (force > 0.0) | (depth > 0.0)
    return {
        "max_depth_m": peak(depth) or 0.0,
        "max_force_N": peak(force) or 0.0,
        "time_s": float(touching.sum() * recording.session.settings.T_s),
    }


def _levels(recording: Recording) -> list[dict[str, Any]]:
    """Returns, per enabled level, the number of its rows, and the number of directions that the level can
    control at the robot's final pose."""
    ranks = recording.session.ranks()
    return [{"name": name, "rank": rank, "rows": rows} for name, (rank, rows) in ranks.items()]


def _average_cost(recording: Recording, level: str) -> float:
    """Returns the cost of (41): the mean of ‖e(x(k))‖²_Q + ‖Δτ(k)‖²_R with e from measurements."""
    session = recording.session
    stack_level = next(candidate for candidate in session.settings.levels if candidate.name == level)
    T_s = session.settings.T_s
    total = np.zeros(max(len(recording.rows) - 1, 1))
    Q = np.asarray(stack_level.Q, float)
    start = 0
    for task in stack_level.tasks:
        error = recording[f"error/{task.name}"]
        m = error.shape[1]
        K_p, K_v = task.gains(m)
        rate = np.gradient(error, T_s, axis=0) if len(error) > 2 else np.zeros_like(error)
        acceleration = np.gradient(rate, T_s, axis=0) if len(error) > 2 else np.zeros_like(error)
        e = (acceleration + K_v * rate + K_p * error)[: len(total)]
        weight = Q if Q.ndim == 0 else Q[start : start + m]
        total += (weight * e**2).sum(axis=1)
        start += m
    total += (np.asarray(stack_level.R, float) * recording["delta_tau"][: len(total)] ** 2).sum(axis=1)
    return float(total.mean())


def _limits(recording: Recording) -> dict[str, dict[str, float | None]]:
    session, v = recording.session, recording["v"]
    with np.errstate(all="ignore"):
        acceleration = np.diff(v, axis=0) / session.settings.T_s
        return {
            "torque": {
                # While a limit is tightened, its two sides may differ.
                "max_ratio": peak(_share(recording["tau_demand"], recording)),
                "applied_max_ratio": peak(_share(recording["tau"], recording)),
            },
            "velocity": {"max_ratio": peak(np.abs(v) / _bounded(recording["v_limit"]))},
            "position": {"max_ratio": position_share(recording)},
            "acceleration": {"max_ratio": peak(np.abs(acceleration) / session.robot.a_max)},
            # The catalog's torque-controlled arms have no jerk limit.
            "jerk": {"max_ratio": None},
        }


def _share(tau: Array, recording: Recording) -> Array:
    """Returns the ratio of a torque to the bound on its side."""
    return np.maximum(tau / _bounded(recording["tau_upper"]), tau / _bounded(recording["tau_lower"]))


def _bounded(limit: Array) -> Array:
    """NaN where there is no limit: unbounded joints are left out."""
    return np.where(np.isfinite(limit), limit, np.nan)
