"""Figures that the summaries of both kinds of runs contain."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from himpc.telemetry import TaskInfo
from lessons.recording.recording import Recording
from lessons.settings.values import peak

Array = NDArray[np.float64]


def task_figures(
    recording: Recording, task: TaskInfo, level: int, rows: NDArray[np.bool_] | None = None
) -> dict[str, Any]:
    """Returns the errors of a task: root mean squares and peaks per coordinate, m or degrees.

    Args:
        recording: the run.
        task: the task.
        level: its place in the stack, 1 the highest.
        rows: (ticks,) of bool, the rows that count; None: all.
    """
    t = recording["t"][:, 0]
    counts = np.ones(len(t), bool) if rows is None else rows
    error = recording[f"error/{task.name}"] * (1.0 if task.unit == "m" else 180 / np.pi)
    late = counts & (t >= 1.0 - 1e-9)
    return {
        "name": task.name,
        "level": level,
        "coordinates": list(task.coordinates),
        "unit": "m" if task.unit == "m" else "deg",
        "rmse": _rms(error[counts]),
        "rmse_after_1s": _rms(error[late]),
        "max_abs": [float(x) for x in np.abs(error[counts]).max(axis=0)] if counts.any() else [],
    }


def _rms(error: Array) -> list[float]:
    return [float(x) for x in np.sqrt((error**2).mean(axis=0))] if len(error) else []


def qp_figures(recording: Recording) -> dict[str, Any]:
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


def position_share(recording: Recording) -> float | None:
    """Returns the largest distance of a joint from the middle of its range, divided by half its range."""
    with np.errstate(all="ignore"):
        middle = 0.5 * (recording["q_lower"] + recording["q_upper"])
        half = 0.5 * (recording["q_upper"] - recording["q_lower"])
        return peak(np.abs(recording["q"] - middle) / half)
