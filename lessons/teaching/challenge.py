"""A challenge: a measured goal that can be reached by tuning a few settings, in more than one way."""

from __future__ import annotations

from dataclasses import dataclass
from inspect import cleandoc

from lessons.teaching.claim import Claim
from lessons.teaching.control import Control, Script
from lessons.teaching.measure import Measure, RunRows


@dataclass(frozen=True)
class Score:
    """Points for the quality of a solution: 0 at `worst`, 100 at `best` and beyond, linear in between."""

    measure: Measure
    worst: float
    best: float

    def points(self, value: float) -> float:
        """Returns the points, 0 to 100; 0 for NaN."""
        share = (value - self.worst) / (self.best - self.worst)
        return 100.0 * min(1.0, max(0.0, share)) if share == share else 0.0


@dataclass(frozen=True)
class Result:
    """The result of an attempt: which goals are met, and the points (0 unless all goals are met)."""

    met: tuple[bool, ...]
    score: float

    @property
    def passed(self) -> bool:
        """Whether all goals are met."""
        return all(self.met)


@dataclass(frozen=True)
class Challenge:
    """A goal, the settings that may be changed to reach it, and the run that decides.

    Attributes:
        text: description of the goal; Markdown with equations in $…$.
        goals: claims that must all hold at the end of the run.
        knobs: the settings that may be changed; any other change disqualifies the attempt.
        score: the points for the quality of a solution.
        solutions: at least two different sets of assignments "PATH=VALUE" to knobs with which the challenge
            passes. With no assignments it does not pass.
        set: assignments in addition to the lesson's, made before the learner begins.
        duration: s.
        events: the script of the run.
    """

    text: str
    goals: tuple[Claim, ...]
    knobs: tuple[Control, ...]
    score: Score
    solutions: tuple[tuple[str, ...], ...]
    set: tuple[str, ...] = ()
    duration: float = 2.0
    events: Script = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "text", cleandoc(self.text))

    @property
    def measures(self) -> tuple[Measure, ...]:
        """The measures that a run needs."""
        return (*(goal.measure for goal in self.goals), self.score.measure)

    def grade(self, rows: RunRows) -> Result:
        """Evaluates a finished run."""
        return self.result([measure.value(rows) for measure in self.measures])

    def result(self, values: list[float]) -> Result:
        """Evaluates a run from the values of its `measures`, in their order."""
        met = tuple(goal.holds(value) for goal, value in zip(self.goals, values, strict=False))
        return Result(met, self.score.points(values[-1]) if all(met) else 0.0)
