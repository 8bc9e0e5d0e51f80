"""A sweep: a grid of runs, with every combination of the values of one or more settings. A run that fails or
loses control becomes a cell, and the sweep continues.

The finished cells are stored in a folder, and a stopped sweep continues from there. The folder contains
`sweep.json` (the definition), `cells.jsonl` (one line per finished cell, appended as it finishes) and, at the
end, `results.json` (the cells in the order of the grid).
"""

from __future__ import annotations

import itertools
import json
import math
import os
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from lessons.experiments.jobs import TIMING_KEYS
from lessons.outputs import write_files
from lessons.own.files import fingerprint, is_file
from lessons.parallel import FailedJob, Spread
from lessons.plots.heat import SweepMap, draw_map
from lessons.recording.run import run
from lessons.recording.summary import summary
from lessons.scenes.run_spec import RunSpec
from lessons.settings.settings import SceneSettings
from lessons.settings.values import WHOLE
from robots import InputError
from robots.errors import unknown_name

MAX_CELLS = 100_000
_DECADE = 10.0
"""A range is divided in equal ratios instead of equal steps if its upper end is at least this many times its
lower end."""


@dataclass(frozen=True)
class Axis:
    """One swept path and its values; `log`: the values have equal ratios."""

    path: str
    values: tuple[float, ...]
    log: bool


@dataclass(frozen=True)
class Sweep:
    """A sweep: every combination of the axes' values on top of a run."""

    base: RunSpec
    axes: tuple[Axis, ...]

    @cached_property
    def points(self) -> list[tuple[float, ...]]:
        """The values of every cell, one per axis; the last axis changes fastest."""
        return list(itertools.product(*(axis.values for axis in self.axes)))

    def run(self, cell: int) -> RunSpec:
        """Returns the run of a cell."""
        at = zip(self.axes, self.points[cell], strict=True)
        return self.base.but(*(f"{axis.path}={value!r}" for axis, value in at))

    def as_data(self) -> dict[str, Any]:
        """Returns the sweep as JSON-ready data; two sweeps with equal data have equal cells."""
        base = self.base
        return {
            "scene": base.scene,
            "controller": base.controller or base.prepared().settings.controller,
            "set": list(base.set),
            "duration": base.duration,
            "seed": base.seed,
            "over": [{"path": axis.path, "values": list(axis.values)} for axis in self.axes],
            **self.files(),
        }

    def files(self) -> dict[str, list[str]]:
        """Returns the fingerprints of the user's files that the sweep uses; empty if there are none. Raises
        InputError if a file cannot be read."""
        base = self.base
        own = [name for name in (base.scene, base.controller or "", *base.tasks) if is_file(name)]
        return {"files": [fingerprint(name) for name in own]} if own else {}


def make_sweep(base: RunSpec, over: Sequence[str]) -> Sweep:
    """Returns a sweep from "PATH=lo:hi:n" texts.

    Values have equal steps, or equal ratios if hi ≥ 10 lo > 0 and the setting may have fractions;
    "PATH=lo:hi:n:lin" and "…:log" choose explicitly. Settings of whole numbers get whole numbers.

    Raises:
        InputError: a text that cannot be read, a path or value that the scene refuses, no cells or too many.
    """
    if not over:
        raise InputError("--over is missing: give at least one, e.g. --over M_bar_scale=0.2:4:20")
    settings = base.prepared().settings
    spans = tuple(map(_span, over))
    paths = [span.path for span in spans]
    if len(set(paths)) < len(paths):
        raise InputError(f"--over names {max(paths, key=paths.count)} twice: give each path once")
    cells = math.prod(span.count for span in spans)
    if cells > MAX_CELLS:
        raise InputError(f"--over gives {cells} cells: at most {MAX_CELLS} are possible; give fewer values")
    return Sweep(base, tuple(_axis(span, settings) for span in spans))


@dataclass(frozen=True)
class _Span:
    """The parts of "PATH=lo:hi:n:kind"; kind: "lin", "log", or "" if it was not given."""

    text: str
    path: str
    low: float
    high: float
    count: int
    kind: str


def _span(text: str) -> _Span:
    path, equals, span = text.partition("=")
    parts = span.split(":")
    try:
        if not equals or not path or len(parts) not in (3, 4) or parts[3:] not in ([], ["lin"], ["log"]):
            raise ValueError
        low, high, count = float(parts[0]), float(parts[1]), int(parts[2])
        if not (math.isfinite(low) and math.isfinite(high)):
            raise ValueError
    except ValueError:
        raise InputError(
            f"--over {text}: write it as PATH=lo:hi:n, e.g. --over M_bar_scale=0.2:4:20 "
            "(or …:20:log, …:20:lin)"
        ) from None
    if count < 1 or (count > 1 and not low < high):
        raise InputError(f"--over {text}: needs lo < hi and n of 1 or more")
    return _Span(text, path, low, high, count, "".join(parts[3:]))


def _axis(span: _Span, settings: SceneSettings) -> Axis:
    text, path, low, high, count = span.text, span.path, span.low, span.high, span.count
    whole = settings.setting(path).form.kind == WHOLE
    log = span.kind == "log" if span.kind else low > 0 and high >= _DECADE * low and not whole
    if log and low <= 0:
        raise InputError(f"--over {text}: equal ratios need lo above 0; use …:lin for equal steps")
    spaced = np.geomspace(low, high, count) if log else np.linspace(low, high, count)
    values = tuple(round(float(value)) if whole else float(f"{value:.9g}") for value in spaced)
    if len(set(values)) < count:
        raise InputError(
            f"--over {text}: {path} has whole numbers, and the range contains fewer than {count} of them"
        )
    for value in values:
        settings.changed(path, value)
    return Axis(path, values, log)


# ---------------------------------------------------------------- cells


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


# ---------------------------------------------------------------- the folder


def usual_folder(sweep: Sweep) -> Path:
    """Returns the default folder of a sweep. Different sweeps have different folders; a repeated sweep
    continues in its folder."""
    wanted = json.dumps(sweep.as_data(), sort_keys=True)
    names = "-".join([Path(sweep.base.scene).stem, *(axis.path for axis in sweep.axes)])
    readable = re.sub(r"[^\w.-]+", "_", names, flags=re.ASCII)[:80]
    return Path("out", "sweeps", f"{readable}-{sha256(wanted.encode()).hexdigest()[:8]}")


def finished_cells(sweep: Sweep, folder: Path) -> dict[int, Cell]:
    """Returns the finished cells of the folder; creates the folder if it does not exist.

    Raises:
        InputError: the folder holds another sweep, or cannot be written.
    """
    wanted = sweep.as_data()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        definition, file = folder / "sweep.json", folder / "cells.jsonl"
        if not definition.exists():
            file.write_text("")
            write_files({definition: json.dumps(wanted, indent=2) + "\n"})
        held = json.loads(definition.read_text())
        if held != wanted:
            different = ", ".join(key for key in wanted if held.get(key) != wanted[key])
            raise InputError(
                f"--out {folder} holds another sweep ({different} differ): give another folder, or repeat "
                "the command that began that sweep"
            )
        written = file.read_bytes()
        whole = written[: written.rfind(b"\n") + 1]
        if len(whole) < len(written):
            # A sweep that was stopped while writing leaves an incomplete last line; that cell is run again.
            os.truncate(file, len(whole))
        cells = [Cell(**json.loads(line)) for line in whole.splitlines()]
    except OSError as error:
        raise InputError(f"--out {folder}: cannot be used ({error.strerror}); give another folder") from None
    except (json.JSONDecodeError, TypeError, AttributeError):
        raise InputError(f"--out {folder}: its files are not those of a sweep; give another folder") from None
    return {cell.index: cell for cell in cells}


def carry_on(
    sweep: Sweep, folder: Path, spread: Spread, progress: Callable[[int, int], None] | None = None
) -> list[Cell]:
    """Runs the cells that are missing and writes `results.json`.

    Args:
        sweep: the sweep.
        folder: folder in which its cells are stored.
        spread: function that spreads the work.
        progress: called with (finished cells, all cells).

    Returns:
        all cells in the order of the grid. After an interruption, the folder contains all finished cells.

    Raises:
        InputError: see `finished_cells`; or the folder cannot be written any more; or a user's file that the
            sweep uses was changed during the sweep.
    """
    cells = finished_cells(sweep, folder)
    total, files = len(sweep.points), sweep.files()
    missing = [index for index in range(total) if index not in cells]
    if progress is not None:
        progress(len(cells), total)
    work = spread(perform_cell, [sweep.run(index) for index in missing])
    with _written(folder), (folder / "cells.jsonl").open("a") as file, closing(work) as outcomes:
        for index, outcome in outcomes:
            if sweep.files() != files:
                raise InputError(
                    f"{', '.join(files['files'])}: was changed during the sweep, and the cells before and "
                    "after this change cannot be compared: repeat the command with another folder for --out"
                )
            if isinstance(outcome, FailedJob):
                cell = Cell(missing[index], None, outcome.reason)
            else:
                cell = Cell(missing[index], outcome, None)
            file.write(json.dumps(asdict(cell), allow_nan=False) + "\n")
            file.flush()
            cells[cell.index] = cell
            if progress is not None:
                progress(len(cells), total)
    ordered = [cells[index] for index in range(total)]
    data = {**sweep.as_data(), "cells": [_as_data(sweep, cell) for cell in ordered]}
    with _written(folder):
        write_files({folder / "results.json": json.dumps(data, indent=1, allow_nan=False) + "\n"})
    return ordered


@contextmanager
def _written(folder: Path) -> Iterator[None]:
    """Raises InputError if a file of the folder cannot be written."""
    try:
        yield
    except OSError as error:
        raise InputError(
            f"--out {folder}: cannot be written ({error.strerror}); free some space, and the same command "
            "continues"
        ) from None


def _as_data(sweep: Sweep, cell: Cell) -> dict[str, Any]:
    at = dict(zip((axis.path for axis in sweep.axes), sweep.points[cell.index], strict=True))
    return {"at": at, "summary": cell.summary, "error": cell.error}


# ---------------------------------------------------------------- the picture


def draw_sweep(sweep: Sweep, cells: Sequence[Cell], metric: str, folder: Path) -> Path | None:
    """Draws `map.png` and returns its path; returns None for more than two axes."""
    if len(sweep.axes) > 2:
        return None
    shape = tuple(len(axis.values) for axis in sweep.axes)
    path, unit = folder / "map.png", unit_of(cells, metric)
    swept = SweepMap(
        f"{sweep.base.scene} · {sweep.base.controller}",
        f"{metric} ({unit})" if unit else metric,
        tuple(axis.path for axis in sweep.axes),
        tuple(axis.values for axis in sweep.axes),
        tuple(axis.log for axis in sweep.axes),
        np.array([cell.value(metric) for cell in cells]).reshape(shape),
        np.array([cell.diverged for cell in cells]).reshape(shape),
        np.array([cell.error is not None for cell in cells]).reshape(shape),
    )
    draw_map(path, swept)
    return path
