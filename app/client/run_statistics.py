"""The figures of a run since its last reset, computed from running sums over every tick."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from himpc.telemetry import Layout


@dataclass(frozen=True)
class RunFigures:
    """Figures of a run.

    Attributes:
        seconds: duration of the run, simulated time.
        rmse: per task, RMS of ‖x̃‖, m or rad.
        torque_share: largest ratio of a commanded |τ| to its bound; NaN if the controller commands no torque.
        unsolved: number of QPs without a solution.
        step_ms, slow_ms: median and 99th percentile of the control step's time, ms, to 3 %.
    """

    seconds: float
    rmse: dict[str, float]
    torque_share: float
    unsolved: int
    step_ms: float
    slow_ms: float


_PER_DECADE = 80  # number of bins in the histogram of step times
_DECADES = 8  # from 1 µs


class RunStatistics:
    """Adds up portions of rows in their order; `clear` begins a new run."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self.clear()

    def clear(self) -> None:
        self._ticks = 0
        self._squares = {task.name: 0.0 for task in self._layout.tasks}
        self._known = dict.fromkeys(self._squares, 0)
        self._share = 0.0
        self._times = np.zeros(_PER_DECADE * _DECADES, np.int64)
        self._unsolved = 0
        self._t = -1.0
        self._first = 0.0

    def append_rows(self, rows: np.ndarray) -> None:
        fields = self._layout.fields
        t = rows[:, fields["t"].start]
        if t[0] < self._t:
            self.clear()
        if self._ticks == 0:
            self._first = float(t[0])
        self._t = float(t[-1])
        self._ticks += len(rows)
        for name in self._squares:
            squares = (rows[:, fields[f"error/{name}"]] ** 2).sum(axis=1)
            known = np.isfinite(squares)
            self._squares[name] += float(squares[known].sum())
            self._known[name] += int(known.sum())
        self._share = max(self._share, self._torque_share(rows))
        self._unsolved += int(np.nansum(rows[:, fields["unsolved"]]))
        step = rows[:, fields["step_us"].start]
        bins = (_PER_DECADE * np.log10(np.maximum(step, 1.0))).astype(np.int64)
        self._times += np.bincount(np.minimum(bins, len(self._times) - 1), minlength=len(self._times))

    def _torque_share(self, rows: np.ndarray) -> float:
        fields = self._layout.fields
        if "tau_lower" not in fields:
            return 0.0
        tau = rows[:, fields["tau_demand"]]
        with np.errstate(all="ignore"):
            share = np.maximum(tau / rows[:, fields["tau_upper"]], tau / rows[:, fields["tau_lower"]])
        finite = share[np.isfinite(share)]
        return float(finite.max()) if finite.size else 0.0

    def result(self) -> RunFigures | None:
        """Returns the figures so far; None before the first row."""
        if not self._ticks:
            return None
        return RunFigures(
            seconds=self._t - self._first,
            rmse={
                name: float(np.sqrt(total / self._known[name])) if self._known[name] else float("nan")
                for name, total in self._squares.items()
            },
            torque_share=self._share if "tau_lower" in self._layout.fields else float("nan"),
            unsolved=self._unsolved,
            step_ms=self._quantile(0.5),
            slow_ms=self._quantile(0.99),
        )

    def _quantile(self, share: float) -> float:
        """Returns the time in ms below which the given share of the control steps stayed."""
        index = int(np.searchsorted(np.cumsum(self._times), share * self._ticks))
        return 1e-3 * float(10 ** ((index + 0.5) / _PER_DECADE))
