"""The grid of a sweep: every combination of the values of one or more settings, on top of one run."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from lessons.own.files import fingerprint, is_file
from lessons.scenes.run_spec import RunSpec
from lessons.settings.settings import SceneSettings
from lessons.settings.values import WHOLE
from robots import InputError

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
