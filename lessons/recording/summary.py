"""The summary of a run: the object of `himpc-lab run --json`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from himpc.catalog import qp_method
from himpc.telemetry import TaskInfo
from lessons.recording.run import Recording
from lessons.session.session import Session
from lessons.session.torque import TorqueSession
from lessons.session.velocity import VelocitySession
from lessons.settings.period import warning
from lessons.settings.values import finite, peak
from robots.arrays import Array, Mask


def summary(recording: Recording) -> dict[str, Any]:
    """Returns the run as one JSON-ready object; its keys are part of the interface of the command line.

    Ratios are relative to the limit in force at that tick, before any tightening. Numbers that are not
    finite become None. Figures that differ between torque and velocity level are in a block of their own.
    """
    session = recording.session
    step_ms = recording["step_us"][:, 0] / 1e3
    return finite(
        {
            "scene": session.scene.name,
            "robot": session.robot.name,
            "controller": session.settings.controller,
            "seed": session.seed,
            "duration_s": round(recording.duration, 9),
            "diverged": session.diverged_at is not None,
            "diverged_at_s": session.diverged_at,
            "finite": bool(np.isfinite(recording["q"]).all() and np.isfinite(recording["tau"]).all()),
            **_BLOCKS[type(session)](recording),
            "priority_leak_max": peak(recording["priority_leak"]),
            "step_ms": {
                "median": float(np.median(step_ms)),
                "p99": float(np.percentile(step_ms, 99)),
                "max": float(step_ms.max()),
            },
            "real_time_factor": recording.duration / recording.wall_s,
        }
    )


# ---------------------------------------------------------------- at torque level


def _torque(recording: Recording) -> dict[str, Any]:
    session, layout = recording.session, recording.layout
    settings, iterations = session.settings, recording["iterations"]
    level_index = {level.name: index for index, level in enumerate(settings.levels, start=1)}
    tasks = sorted(layout.tasks, key=lambda task: level_index[task.level])
    v, tau, every = recording["v"], recording["tau_demand"], np.ones(len(recording.rows), bool)
    with np.errstate(all="ignore"):
        limits = _limits(
            recording,
            # While a limit is tightened, its two sides may differ.
            torque=(_share(tau, recording), _share(recording["tau"], recording)),
            velocity=np.abs(v) / _bounded(recording["v_limit"]),
            acceleration=np.abs(np.diff(v, axis=0) / settings.T_s) / session.robot.a_max,
        )
    return {
        "tasks": [_task(recording, task, level_index[task.level], every) for task in tasks],
        # The number of rows of a level, and of directions that it can control at the robot's final pose.
        "levels": [
            {"name": name, "rank": rank, "rows": rows} for name, (rank, rows) in session.ranks().items()
        ],
        "average_cost": [_average_cost(recording, level.name) for level in settings.levels if level.enabled],
        "limits": limits,
        "solver": {
            "backend": qp_method(settings.controller, settings.solver),
            "route": "printed" if settings.controller == "himpc_printed" else "compiled",
            **_qps(recording),
            "iterations": {"mean": float(iterations.mean()), "max": float(iterations.max())},
        },
        "dynamic_leak_max": peak(recording["dynamic_leak"]),
        "bound_active_share": float((recording["at_bound"] > 0).any(axis=1).mean()),
        "late_ticks": int(recording["late"].sum()),
        "warning": warning(session.robot, settings) or None,
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


def _share(tau: Array, recording: Recording) -> Array:
    """Returns the ratio of a torque to the bound on its side."""
    return np.maximum(tau / _bounded(recording["tau_upper"]), tau / _bounded(recording["tau_lower"]))


def _bounded(limit: Array) -> Array:
    """NaN where there is no limit: unbounded joints are left out."""
    return np.where(np.isfinite(limit), limit, np.nan)


def _velocity(recording: Recording) -> dict[str, Any]:
    session, layout = recording.session, recording.layout
    options, progress, bounds = session.settings.options, session.progress, session.bounds
    steps = np.concatenate([recording[f"step/{name}"][:, 0] for name in layout.levels])
    steps = steps[np.isfinite(steps)]
    active = np.nan_to_num(np.hstack([recording[f"active/{name}"] for name in layout.levels]))
    way = {}
    if "base" in session.roles:
        path = np.diff(recording["x/base"], axis=0)
        way["base_path_m"] = float(np.linalg.norm(path, axis=1).sum())
    with np.errstate(all="ignore"):
        limits = _limits(
            recording,
            velocity=np.abs(recording["tau"]) / recording["v_limit"],
            acceleration=np.abs(recording["acceleration"]) / bounds.a,
            jerk=np.abs(recording["jerk"]) / bounds.j,
        )
    return {
        "tasks": [
            # A role that is not in the window has no error.
            _task(recording, task, index, np.isfinite(recording[f"error/{task.name}"].sum(axis=1)))
            for index, task in enumerate(layout.tasks, start=1)
        ],
        "average_cost": [_mean(recording[f"cost/{name}"]) for name in layout.levels],
        "limits": limits,
        "solver": {
            "backend": qp_method(session.settings.controller, session.settings.htmpc.solver),
            "route": "condensed",
            **_qps(recording),
        },
        "dynamic_leak_max": None,
        "bound_active_share": float((active > 0).any(axis=1).mean()),
        "parts": [
            _part(recording, name, index * options.part_s, (index + 1) * options.part_s)
            for index, name in enumerate(options.parts)
        ],
        "line_search": {"mean_step": _mean(steps), "zero_share": _mean((steps == 0).astype(float))},
        **way,
        "clearance_min_m": float(recording["clearance"].min()),
        "clearance_reported_min_m": float(recording["clearance_reported"].min()),
        "report": _report(recording),
        "completed": progress.done,
        "completion_time_s": round(progress.completed[-1][1], 9) if progress.done else None,
        "mission": [{"task": name, "completed_s": round(t, 9)} for name, t in progress.completed],
    }


def _mean(values: Array) -> float | None:
    numbers = values[np.isfinite(values)]
    return float(numbers.mean()) if numbers.size else None


def _part(recording: Recording, name: str, start: float, end: float) -> dict[str, Any]:
    """Returns one part of a run; a normalised error is the base error divided by its value at the start of
    the part."""
    t = recording["t"][:, 0]
    rows = (t >= start - 1e-9) & (t < end - 1e-9)
    base = np.linalg.norm(recording["error/base"][rows], axis=1)
    ee = 1e3 * np.linalg.norm(recording["error/ee"][rows], axis=1)
    known = len(base) > 0
    return {
        "name": name,
        "normalised_base_error": float(base.mean() / base[0]) if known else None,
        "final_base_error": float(base[-1] / base[0]) if known else None,
        "ee_error_mm": {key: float(getattr(ee, key)()) if known else None for key in ("mean", "std", "max")},
    }


def _report(recording: Recording) -> dict[str, Any] | None:
    """Returns the largest error of each task before, while and after an obstacle is reported wrongly, m, and
    the error at the end; None for runs without wrong reports."""
    wrong = recording.session.settings.options.misreported
    if wrong is None:
        return None
    t, (start, end) = recording["t"][:, 0], wrong
    spans = {"before": t < start - 1e-9, "after": t >= end - 1e-9}
    spans["wrong"] = ~spans["before"] & ~spans["after"]
    report: dict[str, Any] = {"wrong_from_s": start, "wrong_until_s": end}
    for task in recording.layout.tasks:
        error = np.linalg.norm(recording[f"error/{task.name}"], axis=1)
        report[task.name] = {
            **{f"max_{name}_m": peak(error[spans[name]]) for name in ("before", "wrong", "after")},
            "end_m": float(error[-1]),
        }
    return report


_BLOCKS: Mapping[type[Session], Callable[[Recording], dict[str, Any]]] = {
    TorqueSession: _torque,
    VelocitySession: _velocity,
}


# ---------------------------------------------------------------- at both levels


def _task(recording: Recording, task: TaskInfo, level: int, rows: Mask) -> dict[str, Any]:
    """Returns the errors of a task: root mean squares and peaks per coordinate, m or degrees.

    Args:
        recording: the run.
        task: the task.
        level: its place in the stack, 1 the highest.
        rows: (ticks,) of bool, the rows that count.
    """
    error = recording[f"error/{task.name}"] * (1.0 if task.unit == "m" else 180 / np.pi)
    late = rows & (recording["t"][:, 0] >= 1.0 - 1e-9)
    return {
        "name": task.name,
        "level": level,
        "coordinates": list(task.coordinates),
        "unit": "m" if task.unit == "m" else "deg",
        "rmse": _rms(error[rows]),
        "rmse_after_1s": _rms(error[late]),
        "max_abs": [float(x) for x in np.abs(error[rows]).max(axis=0)] if rows.any() else [],
    }


def _rms(error: Array) -> list[float]:
    return [float(x) for x in np.sqrt((error**2).mean(axis=0))] if len(error) else []


def _limits(
    recording: Recording,
    velocity: Array,
    acceleration: Array,
    torque: tuple[Array, Array] | None = None,
    jerk: Array | None = None,
) -> dict[str, dict[str, float | None]]:
    """Returns the largest ratio of each quantity to its limit, from the ratios at every tick. torque: those
    of the demand and of the torque that acts. A position counts from the middle of the joint's range."""
    middle = 0.5 * (recording["q_lower"] + recording["q_upper"])
    half = 0.5 * (recording["q_upper"] - recording["q_lower"])
    demand, applied = (None, None) if torque is None else map(peak, torque)
    return {
        "torque": {"max_ratio": demand, "applied_max_ratio": applied},
        "velocity": {"max_ratio": peak(velocity)},
        "position": {"max_ratio": peak(np.abs(recording["q"] - middle) / half)},
        "acceleration": {"max_ratio": peak(acceleration)},
        # The catalog's torque-controlled arms have no jerk limit.
        "jerk": {"max_ratio": None if jerk is None else peak(jerk)},
    }


def _qps(recording: Recording) -> dict[str, Any]:
    """Returns figures about the QPs of a run."""
    layout = recording.layout
    counts: Counter[str] = Counter()
    for name in layout.levels:
        codes = recording[f"fallback/{name}"][:, 0]
        counts.update(layout.fallbacks[int(code)] for code in codes[np.isfinite(codes)] if code > 0)
    return {
        "solves": int(sum(np.isfinite(recording[f"kkt/{name}"]).sum() for name in layout.levels)),
        "unsolved": int(np.nansum(recording["unsolved"])),
        "fallbacks": dict(counts),
        "max_kkt_residual": max(peak(recording[f"kkt/{name}"]) or 0.0 for name in layout.levels),
    }
