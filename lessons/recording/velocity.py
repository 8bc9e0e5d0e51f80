"""What a velocity-level run amounts to: the object of `himpc-lab run --json` and the arrays of `--npz`."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from himpc.telemetry import TaskInfo
from lessons.session.velocity import MobileSession
from lessons.session.velocity_rows import RUNGS
from lessons.settings.values import finite, peak
from lessons.velocity_events import as_data

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MobileRecording:
    """The rows of one run, one per control tick, and how long the run took in wall time."""

    session: MobileSession
    rows: Array
    wall_s: float = field(default=float("nan"))

    @classmethod
    def of(cls, session: MobileSession, rows: Sequence[Array], wall_s: float) -> MobileRecording:
        """A recording of the rows that `tick` returned."""
        return cls(session, np.array(rows).reshape(len(rows), session.layout.size), wall_s)

    def __getitem__(self, name: str) -> Array:
        """A field over time, (ticks, width)."""
        return self.rows[:, self.session.layout.fields[name]]

    @property
    def duration(self) -> float:
        """Simulated seconds."""
        return len(self.rows) * self.session.settings.htmpc.period


def mobile_summary(recording: MobileRecording) -> dict[str, Any]:
    """The run as one JSON-ready object; its keys are the contract of the command line."""
    session, layout = recording.session, recording.session.layout
    settings, options = session.settings, session.settings.options
    step_ms = recording["step_us"][:, 0] / 1e3
    steps = np.concatenate([recording[f"step/{name}"][:, 0] for name in layout.levels])
    steps = steps[np.isfinite(steps)]
    data = {
        "scene": session.scene.name,
        "robot": session.robot.name,
        "controller": settings.controller,
        "seed": session.seed,
        "duration_s": round(recording.duration, 9),
        "diverged": session.diverged_at is not None,
        "diverged_at_s": session.diverged_at,
        "finite": bool(np.isfinite(recording["q"]).all() and np.isfinite(recording["tau"]).all()),
        "tasks": [_task(recording, task, place) for place, task in enumerate(layout.tasks, start=1)],
        "average_cost": [_mean(recording[f"cost/{name}"]) for name in layout.levels],
        "limits": _limits(recording),
        "solver": {
            "backend": settings.htmpc.solver,
            "route": "condensed",
            "solves": int(sum(np.isfinite(recording[f"kkt/{name}"]).sum() for name in layout.levels)),
            "unsolved": int(np.nansum(recording["unsolved"])),
            "fallbacks": _fallbacks(recording),
            "max_kkt_residual": max(peak(recording[f"kkt/{name}"]) or 0.0 for name in layout.levels),
        },
        "priority_leak_max": peak(recording["priority_leak"]),
        "dynamic_leak_max": None,
        "bound_active_share": float(
            (np.nan_to_num(np.hstack([recording[f"active/{name}"] for name in layout.levels])) > 0)
            .any(axis=1)
            .mean()
        ),
        "step_ms": {
            "median": float(np.median(step_ms)),
            "p99": float(np.percentile(step_ms, 99)),
            "max": float(step_ms.max()),
        },
        "real_time_factor": recording.duration / recording.wall_s,
        "parts": [
            _part(recording, name, place * options.part_s, (place + 1) * options.part_s)
            for place, name in enumerate(options.parts)
        ],
        "line_search": {
            "mean_step": _mean(steps),
            "zero_share": _mean((steps == 0).astype(float)),
        },
    }
    if "base" in session.roles:
        path = np.diff(recording["x/base"], axis=0)
        data["base_path_m"] = float(np.linalg.norm(path, axis=1).sum())
    clearance = recording["clearance"]
    data["clearance_min_m"] = float(clearance.min())
    progress = session.progress
    data["completed"] = progress.done
    data["completion_time_s"] = round(progress.completed[-1][1], 9) if progress.done else None
    data["mission"] = [{"task": name, "completed_s": round(t, 9)} for name, t in progress.completed]
    return finite(data)


def _task(recording: MobileRecording, task: TaskInfo, place: int) -> dict[str, Any]:
    error = recording[f"error/{task.name}"] * (1.0 if task.unit == "m" else 180 / np.pi)
    shown = np.isfinite(error).all(axis=1)
    late = error[shown & (recording["t"][:, 0] >= 1.0 - 1e-9)]
    error = error[shown]
    return {
        "name": task.name,
        "level": place,
        "coordinates": list(task.coordinates),
        "unit": "m" if task.unit == "m" else "deg",
        "rmse": _rms(error),
        "rmse_after_1s": _rms(late),
        "max_abs": [float(x) for x in np.abs(error).max(axis=0)] if len(error) else [],
    }


def _mean(values: Array) -> float | None:
    found = values[np.isfinite(values)]
    return float(found.mean()) if found.size else None


def _rms(error: Array) -> list[float]:
    return [float(x) for x in np.sqrt((error**2).mean(axis=0))] if len(error) else []


def _part(recording: MobileRecording, name: str, start: float, end: float) -> dict[str, Any]:
    """One part of a run; normalised errors are the base error over that at the part's start."""
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


def _limits(recording: MobileRecording) -> dict[str, dict[str, float | None]]:
    bounds = recording.session.bounds
    q = recording["q"]
    with np.errstate(all="ignore"):
        middle = 0.5 * (recording["q_lower"] + recording["q_upper"])
        half = 0.5 * (recording["q_upper"] - recording["q_lower"])
        return {
            "torque": {"max_ratio": None, "applied_max_ratio": None},
            "velocity": {"max_ratio": peak(np.abs(recording["tau"]) / recording["v_limit"])},
            "position": {"max_ratio": peak(np.abs(q - middle) / half)},
            "acceleration": {"max_ratio": peak(np.abs(recording["acceleration"]) / bounds.a)},
            "jerk": {"max_ratio": peak(np.abs(recording["jerk"]) / bounds.j)},
        }


def _fallbacks(recording: MobileRecording) -> dict[str, int]:
    counts: Counter[str] = Counter()
    for name in recording.session.layout.levels:
        codes = recording[f"rung/{name}"][:, 0]
        counts.update(RUNGS[int(code)] for code in codes[np.isfinite(codes)] if code > 0)
    return dict(counts)


def mobile_arrays(recording: MobileRecording, how: dict[str, Any]) -> dict[str, Any]:
    """The arrays of `--npz`: one row per tick and field, and what reproduces the run.

    Args:
        recording: the run.
        how: scene, seed and settings as given, to which the event log is added.
    """
    session, layout = recording.session, recording.session.layout
    n = np.full((len(recording.rows), session.robot.n), np.nan)
    data: dict[str, Any] = {"t": recording["t"][:, 0], "tau_lower": n, "tau_upper": n}
    for name in ("q", "v", "tau", "tau_demand", "v_limit", "q_lower", "q_upper", "acceleration", "jerk"):
        data[name] = recording[name]
    for task in layout.tasks:
        for name in ("x", "x_d", "v_d", "a_d", "error"):
            data[f"{name}/{task.name}"] = recording[f"{name}/{task.name}"]
        data[f"level/{task.name}"] = recording[f"level/{task.name}"][:, 0]
    data["joint_names"] = np.array(session.robot.joint_names)
    events = [{"t": t, **as_data(event)} for t, event in session.log]
    in_force = asdict(session.settings)
    data["settings"] = np.array(json.dumps({**how, "events": events, "in_force": in_force}, default=str))
    return data
