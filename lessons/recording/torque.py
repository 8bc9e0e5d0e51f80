"""What a run amounts to: the object of `himpc-lab run --json` and the arrays of `--npz`."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from himpc.telemetry import RUNGS, Layout
from lessons.events import as_data
from lessons.session.torque import Session
from lessons.settings.values import finite, peak

Array = NDArray[np.float64]


class Recording:
    """The rows of one run, one per control tick, and how long the run took."""

    def __init__(self, session: Session, rows: Sequence[Array], wall_s: float) -> None:
        self.session = session
        self.layout: Layout = session.layout
        self.rows = np.array(rows) if len(rows) else np.empty((0, session.layout.size))
        self.wall_s = wall_s

    def __getitem__(self, field: str) -> Array:
        """A field over time, (ticks, width)."""
        return self.rows[:, self.layout.fields[field]]

    @property
    def duration(self) -> float:
        """Simulated seconds."""
        return len(self.rows) * self.session.settings.T_s


def summary(recording: Recording) -> dict[str, Any]:
    """The run as one JSON-ready object; its keys are the contract of the command line.

    Ratios compare with the limit in force at that tick, before any tightening. Numbers that are not
    finite become None.
    """
    session, layout = recording.session, recording.layout
    settings = session.settings
    place = {level.name: index for index, level in enumerate(settings.levels, start=1)}
    step_ms = recording["step_us"][:, 0] / 1e3
    data = {
        "scene": session.scene.name,
        "robot": session.robot.name,
        "controller": settings.controller,
        "seed": session.seed,
        "duration_s": round(recording.duration, 9),
        "diverged": session.diverged_at is not None,
        "diverged_at_s": session.diverged_at,
        "finite": bool(np.isfinite(recording["q"]).all() and np.isfinite(recording["tau"]).all()),
        "tasks": [
            {
                "name": task.name,
                "level": place[task.level],
                "coordinates": list(task.coordinates),
                "unit": "m" if task.unit == "m" else "deg",
                **_errors(recording, task.name, 1.0 if task.unit == "m" else 180 / np.pi),
            }
            for task in sorted(layout.tasks, key=lambda task: place[task.level])
        ],
        "average_cost": [_average_cost(recording, level.name) for level in settings.levels if level.enabled],
        "limits": _limits(recording),
        "solver": {
            "backend": settings.solver,
            "route": settings.route,
            "solves": int(sum(np.isfinite(recording[f"kkt/{name}"]).sum() for name in layout.levels)),
            "unsolved": int(np.nansum(recording["unsolved"])),
            "iterations": {
                "mean": float(recording["iterations"].mean()),
                "max": float(recording["iterations"].max()),
            },
            "fallbacks": _fallbacks(recording),
            "max_kkt_residual": max(peak(recording[f"kkt/{name}"]) or 0.0 for name in layout.levels),
        },
        "priority_leak_max": peak(recording["priority_leak"]),
        "dynamic_leak_max": peak(recording["dynamic_leak"]),
        "bound_active_share": float((recording["at_bound"] > 0).any(axis=1).mean()) if len(step_ms) else 0.0,
        "step_ms": {
            "median": float(np.median(step_ms)),
            "p99": float(np.percentile(step_ms, 99)),
            "max": float(step_ms.max()),
        },
        "late_ticks": int(recording["late"].sum()),
        "real_time_factor": recording.duration / recording.wall_s,
    }
    return finite(data)


def _errors(recording: Recording, task: str, unit: float) -> dict[str, list[float]]:
    error = recording[f"error/{task}"] * unit
    late = error[recording["t"][:, 0] >= 1.0 - 1e-9]
    return {
        "rmse": [float(x) for x in np.sqrt((error**2).mean(axis=0))],
        "rmse_after_1s": [float(x) for x in np.sqrt((late**2).mean(axis=0))] if len(late) else [],
        "max_abs": [float(x) for x in np.abs(error).max(axis=0)],
    }


def _average_cost(recording: Recording, level: str) -> float:
    """(41): the mean of ‖e(x(k))‖²_Q + ‖Δτ(k)‖²_R with e from measurements."""
    session = recording.session
    found = next(each for each in session.settings.levels if each.name == level)
    T_s = session.settings.T_s
    total = np.zeros(max(len(recording.rows) - 1, 1))
    Q = np.asarray(found.Q, float)
    start = 0
    for task in found.tasks:
        error = recording[f"error/{task.name}"]
        m = error.shape[1]
        K_p, K_v = task.gains(m)
        rate = np.gradient(error, T_s, axis=0) if len(error) > 2 else np.zeros_like(error)
        acceleration = np.gradient(rate, T_s, axis=0) if len(error) > 2 else np.zeros_like(error)
        e = (acceleration + K_v * rate + K_p * error)[: len(total)]
        weight = Q if Q.ndim == 0 else Q[start : start + m]
        total += (weight * e**2).sum(axis=1)
        start += m
    total += (np.asarray(found.R, float) * recording["delta_tau"][: len(total)] ** 2).sum(axis=1)
    return float(total.mean())


def _limits(recording: Recording) -> dict[str, dict[str, float | None]]:
    q, v = recording["q"], recording["v"]
    T_s = recording.session.settings.T_s
    with np.errstate(all="ignore"):
        middle = 0.5 * (recording["q_lower"] + recording["q_upper"])
        half = 0.5 * (recording["q_upper"] - recording["q_lower"])
        acceleration = np.diff(v, axis=0) / T_s
        return {
            "torque": {
                # While a limit is being tightened the two sides may differ.
                "max_ratio": peak(_share(recording["tau_demand"], recording)),
                "applied_max_ratio": peak(_share(recording["tau"], recording)),
            },
            "velocity": {"max_ratio": peak(np.abs(v) / _bounded(recording["v_limit"]))},
            "position": {"max_ratio": peak(np.abs(q - middle) / half)},
            "acceleration": {"max_ratio": peak(np.abs(acceleration) / recording.session.robot.a_max)},
            # The catalog's torque-controlled arms have no jerk limit.
            "jerk": {"max_ratio": None},
        }


def _share(tau: Array, recording: Recording) -> Array:
    """Torque over the bound on its side."""
    return np.maximum(tau / _bounded(recording["tau_upper"]), tau / _bounded(recording["tau_lower"]))


def _bounded(limit: Array) -> Array:
    """NaN where there is no limit: unbounded joints are left out."""
    return np.where(np.isfinite(limit), limit, np.nan)


def _fallbacks(recording: Recording) -> dict[str, int]:
    counts: Counter[str] = Counter()
    for name in recording.layout.levels:
        codes = recording[f"rung/{name}"][:, 0]
        for code in codes[np.isfinite(codes)]:
            if code > 0:
                counts[RUNGS[int(code)]] += 1
    return dict(counts)


def arrays(recording: Recording, how: dict[str, Any]) -> dict[str, Any]:
    """The arrays of `--npz`: one row per tick and field, and what reproduces the run.

    Args:
        recording: the run.
        how: scene, URDF, seed and settings as given, to which the event log is added.
    """
    session, layout = recording.session, recording.layout
    place = {level.name: index for index, level in enumerate(session.settings.levels, start=1)}
    common = ("q", "v", "tau", "tau_demand", "tau_lower", "tau_upper", "v_limit", "q_lower", "q_upper")
    data: dict[str, Any] = {"t": recording["t"][:, 0]}
    data |= {name: recording[name] for name in common}
    for task in layout.tasks:
        for name in ("x", "x_d", "v_d", "a_d", "error"):
            data[f"{name}/{task.name}"] = recording[f"{name}/{task.name}"]
        data[f"level/{task.name}"] = np.array(place[task.level])
    data["joint_names"] = np.array(session.robot.joint_names)
    events = [{"t": t, **as_data(event)} for t, event in session.log]
    data["settings"] = np.array(json.dumps({**how, "events": events, "in_force": _plain(session)}))
    return data


def _plain(session: Session) -> dict[str, Any]:
    return asdict(session.settings)
