"""The map of a sweep."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from lessons.experiments.sweep.cells import Cell
from lessons.experiments.sweep.grid import Sweep
from lessons.plots.heat import draw_map


def draw_sweep(sweep: Sweep, cells: Sequence[Cell], metric: str, folder: Path) -> Path | None:
    """Draws `map.png` and returns its path; returns None for more than two axes."""
    if len(sweep.axes) > 2:
        return None
    shape = tuple(len(axis.values) for axis in sweep.axes)
    path = folder / "map.png"
    draw_map(
        path,
        f"{sweep.base.scene} · {sweep.base.controller}",
        f"{metric}{_unit(cells, metric)}",
        tuple(axis.path for axis in sweep.axes),
        tuple(axis.values for axis in sweep.axes),
        tuple(axis.log for axis in sweep.axes),
        np.array([cell.value(metric) for cell in cells]).reshape(shape),
        np.array([cell.diverged for cell in cells]).reshape(shape),
        np.array([cell.error is not None for cell in cells]).reshape(shape),
    )
    return path


def _unit(cells: Sequence[Cell], metric: str) -> str:
    kind, _, rest = metric.partition(".")
    found = next((cell.summary for cell in cells if cell.summary), None)
    if kind == "tasks" and found is not None:
        return next(f" ({task['unit']})" for task in found["tasks"] if rest.startswith(f"{task['name']}."))
    return ""
