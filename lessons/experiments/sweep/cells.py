"""A finished cell and its metrics."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from lessons.experiments.jobs import TIMING_KEYS
from lessons.experiments.sweep.grid import Sweep
from lessons.recording.run import run
from lessons.recording.summary import summary
from lessons.scenes.run_spec import RunSpec
from robots.errors import unknown_name


@dataclass(frozen=True)
class Cell:
    """A finished cell: the run's summary without its timing, or the error of a run without a summary."""

    index: int
    summary: dict[str, Any] | None
    error: str | None

    @property
    def diverged(self) -> bool:
        """Whether the run lost control."""
        return self.summary is not None and bool(self.summary["diverged"])

    def value(self, metric: str) -> float:
        """Returns a metric of the run; NaN if it has none, failed or lost control."""
        if self.summary is None or self.diverged:
            return math.nan
        return dict(_numbers(self.summary)).get(metric, math.nan)


_NO_METRIC = ("seed", "duration_s", "level", "finite", "diverged")
"""Numbers of a summary that are not offered as a metric."""


def metrics(sweep: Sweep) -> list[str]:
    """Returns the metrics of a cell, the default first; one tick of the base scene is run to find them."""
    scene = sweep.base.prepared()
    recording = run(scene, scene.settings.T_s, sweep.base.seed)
    figures = dict(_numbers(_without_timing(summary(recording))))
    names = [name for name in figures if not name.endswith(_NO_METRIC)]
    measure = "rmse_after_1s" if scene.duration > 1.0 else "rmse"
    first = min(summary(recording)["tasks"], key=lambda task: task["level"])["name"]
    default = f"tasks.{first}.{measure}"
    return [default, *(name for name in names if name != default)]


def check_metric(metric: str, choices: Sequence[str]) -> str:
    """Returns the metric. Raises InputError if it is not one of the choices."""
    if metric not in choices:
        raise unknown_name("metric", metric, choices)
    return metric


def _numbers(data: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """Every number of a summary by its dotted path. A list of numbers counts as the root of its sum of
    squares."""
    if isinstance(data, dict):
        for key, value in data.items():
            yield from _numbers(value, f"{path}.{key}" if path else str(key))
    elif isinstance(data, list):
        if all(isinstance(entry, dict) for entry in data):
            for entry in data:
                yield from _numbers(entry, f"{path}.{entry.get('name')}")
        elif path.startswith("average_cost"):
            for level, cost in enumerate(data, start=1):
                yield f"{path}.{level}", math.nan if cost is None else float(cost)
        elif not any(isinstance(entry, str) for entry in data):
            known = data and all(number is not None for number in data)
            yield path, math.sqrt(sum(number**2 for number in data)) if known else math.nan
    elif data is None:
        yield path, math.nan
    elif not isinstance(data, str):
        yield path, float(data)


def _without_timing(data: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in data.items() if key not in TIMING_KEYS}


def perform_cell(spec: RunSpec) -> dict[str, Any]:
    """Returns the summary of a run, without its timing. Raises InputError for an invalid run."""
    return _without_timing(summary(run(spec.prepared(), None, spec.seed)))


def unit_of(cells: Sequence[Cell], metric: str) -> str:
    """Returns the unit of a metric of a task; "" for other metrics, whose names contain their unit if they
    have one."""
    kind, _, rest = metric.partition(".")
    sample = next((cell.summary for cell in cells if cell.summary), None)
    if kind == "tasks" and sample is not None:
        return next(task["unit"] for task in sample["tasks"] if rest.startswith(f"{task['name']}."))
    return ""


def best_cell(cells: Sequence[Cell], metric: str) -> Cell | None:
    """Returns the cell with the least value of a metric; None if no cell has a value."""
    known = [cell for cell in cells if math.isfinite(cell.value(metric))]
    return min(known, key=lambda cell: cell.value(metric), default=None)
