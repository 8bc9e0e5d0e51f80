"""The map of a sweep."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from lessons.experiments.sweep.cells import Cell, unit_of
from lessons.experiments.sweep.grid import Sweep
from lessons.plots.heat import draw_map


def draw_sweep(sweep: Sweep, cells: Sequence[Cell], metric: str, folder: Path) -> Path | None:
    """Draws `map.png` and returns its path; returns None for more than two axes."""
    if len(sweep.axes) > 2:
        return None
    shape = tuple(len(axis.values) for axis in sweep.axes)
    path, unit = folder / "map.png", unit_of(cells, metric)
    draw_map(
        path,
        f"{sweep.base.scene} · {sweep.base.controller}",
        f"{metric} ({unit})" if unit else metric,
        tuple(axis.path for axis in sweep.axes),
        tuple(axis.values for axis in sweep.axes),
        tuple(axis.log for axis in sweep.axes),
        np.array([cell.value(metric) for cell in cells]).reshape(shape),
        np.array([cell.diverged for cell in cells]).reshape(shape),
        np.array([cell.error is not None for cell in cells]).reshape(shape),
    )
    return path
