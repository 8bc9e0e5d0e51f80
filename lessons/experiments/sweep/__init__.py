"""A grid of runs over one or more settings. A run that fails or loses control becomes a cell, and the sweep
continues.
"""

from lessons.experiments.sweep.cells import Cell, best_cell, check_metric, metrics, unit_of
from lessons.experiments.sweep.folder import carry_on, finished_cells, usual_folder
from lessons.experiments.sweep.grid import Axis, Sweep, make_sweep
from lessons.experiments.sweep.picture import draw_sweep

__all__ = [
    "Axis",
    "Cell",
    "Sweep",
    "best_cell",
    "carry_on",
    "check_metric",
    "draw_sweep",
    "finished_cells",
    "make_sweep",
    "metrics",
    "unit_of",
    "usual_folder",
]
