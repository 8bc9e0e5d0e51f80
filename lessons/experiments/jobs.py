"""A run as a description that can be sent to another process, compared and used as a key."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from contextlib import closing
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from lessons.parallel import FailedJob, on_cores, one_by_one
from lessons.recording.run import Recording, run
from lessons.recording.summary import summary
from lessons.scenes.run_spec import RunSpec
from robots.arrays import Array

TIMING_KEYS = ("step_ms", "real_time_factor")
"""Keys of a summary whose values differ from run to run; all other values are equal to the last bit."""

_KEPT = (
    *("t", "q", "v", "tau", "v_limit", "at_bound", "tau_demand", "step_us", "x", "x_d", "error", "cost"),
    *("tau_lower", "tau_upper", "delta_tau", "step"),
)
"""The data of a run that plots need: fields, and prefixes of the fields per task and level."""


@dataclass(frozen=True)
class Work(ABC):
    """A piece of work whose result is a run.

    Attributes:
        spec: the run.
        timed: whether the run measures step times; then no other work runs at the same time.
    """

    spec: RunSpec
    timed: bool = False

    @abstractmethod
    def do(self) -> JobResult:
        """Returns the run. Raises InputError for invalid input."""


@final
@dataclass(frozen=True)
class Job(Work):
    """One run, as `himpc-lab run` performs it."""

    def do(self) -> JobResult:
        recording = run(self.spec.prepared(), None, self.spec.seed)
        return JobResult(self, summary(recording), _arrays(recording))


@dataclass(frozen=True, eq=False)
class JobResult:
    """The result of a job: the summary of `himpc-lab run --json` and the rows that plots need.

    A run that failed has an `error`, an empty summary and no arrays; its figures are NaN.
    """

    job: Work
    summary: Mapping[str, Any]
    arrays: Mapping[str, Array]
    error: str | None = None

    def __getitem__(self, field: str) -> Array:
        """Returns a field over time, (ticks, width); no rows if the run failed."""
        return self.arrays.get(field, np.empty((0, 1)))

    def column(self, field: str, k: int = 0) -> Array:
        """Returns one number of a field over time, (ticks,); no rows if the run failed."""
        return self.arrays[field][:, k] if field in self.arrays else np.empty(0)

    @property
    def controller(self) -> str:
        """The requested controller, or the scene's own."""
        return self.job.spec.controller or str(self.summary.get("controller"))

    @property
    def t(self) -> Array:
        """Times of the rows, s."""
        return self.column("t")

    @property
    def lost_at(self) -> float | None:
        """The time at which control was lost, s; None if it was not lost."""
        return self.summary.get("diverged_at_s")

    @property
    def completed(self) -> bool:
        """Whether the run reached its end without losing control."""
        return self.error is None and not self.summary["diverged"]

    def figure(self, *path: str | int) -> float:
        """Returns a number of the summary, e.g. figure("limits", "torque", "max_ratio"); NaN where there is
        none."""
        value: Any = self.summary
        try:
            for key in path:
                value = value[key]
        except (KeyError, IndexError):
            return float("nan")
        return float("nan") if value is None else float(value)

    def error_of(self, task: str, coordinate: int = 0, measure: str = "rmse_after_1s") -> float:
        """Returns an error figure of one coordinate of a task, m or deg; NaN if there is none or control was
        lost."""
        if not self.completed:
            return float("nan")
        tasks = self.summary.get("tasks", ())
        index = next((k for k, entry in enumerate(tasks) if entry["name"] == task), -1)
        return self.figure("tasks", index, measure, coordinate) if index >= 0 else float("nan")


Results = Mapping[Any, JobResult]
"""The results by job."""


def _do(job: Work) -> JobResult:
    return job.do()


def _arrays(recording: Recording) -> dict[str, Array]:
    names = (name for name in recording.layout.fields if name.partition("/")[0] in _KEPT)
    return {name: np.ascontiguousarray(recording[name]) for name in names}


def perform_all(jobs: Iterable[Work], progress: Callable[[float], None] | None = None) -> Results:
    """Runs jobs, equal jobs only once. The jobs that are not timed run first, on all cores; then the timed
    jobs run one after the other in this process.

    Args:
        jobs: what to run.
        progress: called after each job with the share of the expected work that is done.

    Returns:
        the runs by job. A job that cannot be done is a run with an error sentence.
    """
    # Long jobs run first: no core is left idle at the end.
    unique = sorted(dict.fromkeys(jobs), key=_work, reverse=True)
    shared = [job for job in unique if not job.timed]
    timed = [job for job in unique if job.timed]
    total = sum(map(_work, unique))
    results: dict[Work, JobResult] = {}
    done = 0.0
    for batch, spread in ((shared, on_cores), (timed, one_by_one)):
        with closing(spread(_do, batch)) as outcomes:
            for index, outcome in outcomes:
                job = batch[index]
                results[job] = (
                    JobResult(job, {}, {}, outcome.reason) if isinstance(outcome, FailedJob) else outcome
                )
                done += _work(job)
                if progress is not None:
                    progress(done / total)
    return results


def _work(job: Work) -> float:
    """Returns an estimate of a job's cost, for the order of the jobs and for the progress."""
    spec = job.spec
    horizons = [float(text.partition("=")[2]) for text in spec.set if text.startswith("horizon=")]
    horizon = horizons[-1] if horizons else 5.0
    return (spec.duration or 8.0) * (1.0 + 0.1 * horizon) * (20.0 if spec.controller == "nhimpc" else 1.0)
