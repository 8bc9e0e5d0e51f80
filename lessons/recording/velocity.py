"""The part of a run's summary that only velocity-level runs have."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from himpc.catalog import qp_method
from lessons.recording.figures import position_share, qp_figures, task_figures
from lessons.recording.recording import Recording
from lessons.settings.values import peak

Array = NDArray[np.float64]


def block(recording: Recording) -> dict[str, Any]:
    """Returns the part of `lessons.recording.summary.summary` for the velocity level."""
    session, layout = recording.session, recording.layout
    options, progress = session.settings.options, session.progress
    steps = np.concatenate([recording[f"step/{name}"][:, 0] for name in layout.levels])
    steps = steps[np.isfinite(steps)]
    active = np.nan_to_num(np.hstack([recording[f"active/{name}"] for name in layout.levels]))
    way = {}
    if "base" in session.roles:
        path = np.diff(recording["x/base"], axis=0)
        way["base_path_m"] = float(np.linalg.norm(path, axis=1).sum())
    return {
        "tasks": [
            # A role that is not in the window has no error.
            task_figures(recording, task, index, np.isfinite(recording[f"error/{task.name}"].sum(axis=1)))
            for index, task in enumerate(layout.tasks, start=1)
        ],
        "average_cost": [_mean(recording[f"cost/{name}"]) for name in layout.levels],
        "limits": _limits(recording),
        "solver": {
            "backend": qp_method(session.settings.controller, session.settings.htmpc.solver),
            "route": "condensed",
            **qp_figures(recording),
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
    if not len(base):
        nothing = {"mean": None, "std": None, "max": None}
        return {"name": name, "normalised_base_error": None, "final_base_error": None, "ee_error_mm": nothing}
    return {
        "name": name,
        "normalised_base_error": float(base.mean() / base[0]),
        "final_base_error": float(base[-1] / base[0]),
        "ee_error_mm": {"mean": float(ee.mean()), "std": float(ee.std()), "max": float(ee.max())},
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


def _limits(recording: Recording) -> dict[str, dict[str, float | None]]:
    bounds = recording.session.bounds
    with np.errstate(all="ignore"):
        return {
            "torque": {"max_ratio": None, "applied_max_ratio": None},
            "velocity": {"max_ratio": peak(np.abs(recording["tau"]) / recording["v_limit"])},
            "position": {"max_ratio": position_share(recording)},
            "acceleration": {"max_ratio": peak(np.abs(recording["acceleration"]) / bounds.a)},
            "jerk": {"max_ratio": peak(np.abs(recording["jerk"]) / bounds.j)},
        }
