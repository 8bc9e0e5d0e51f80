"""Predictions: a learner's answer before the run, and its comparison with the result of the run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lessons.teaching.measure import Measure, RunRows, Signal


@dataclass(frozen=True)
class PredictionResult:
    """The grade of a prediction.

    Attributes:
        score: 0 (far off) to 1 (right).
        words: one sentence with the measured value.
    """

    score: float
    words: str


@dataclass(frozen=True)
class Option:
    """One answer of a choice. The answer is right if the measured number is in [low, high)."""

    text: str
    low: float = -math.inf
    high: float = math.inf


@dataclass(frozen=True)
class Choice:
    """Several answers; the run decides which one is right.

    Attributes:
        question: one sentence.
        options: their intervals do not overlap.
        measure: the number that decides which option is right.
        tempting: index of a wrong answer that many learners give.
    """

    question: str
    options: tuple[Option, ...]
    measure: Measure
    tempting: int

    def right(self, value: float) -> int | None:
        """Returns the index of the right option for a measured number; None if no option is right."""
        return next((k for k, option in enumerate(self.options) if option.low <= value < option.high), None)

    def hits(self, picked: float, value: float) -> bool | None:
        """Returns whether an option is right for a measured number; None if no option is right."""
        right = self.right(value)
        return None if right is None else picked == right

    def grade(self, picked: int, rows: RunRows, ghost: RunRows | None = None) -> PredictionResult:
        """Compares the chosen option with the run."""
        value = self.measure.value(rows, ghost)
        right = self.right(value)
        if right is None:
            return PredictionResult(0.0, "The run gave nothing to measure.")
        answer = f"{self.options[right].text} ({_number(value, self.measure.unit)})."
        return (
            PredictionResult(1.0, f"Right: {answer}")
            if picked == right
            else PredictionResult(0.0, f"It was: {answer}")
        )


@dataclass(frozen=True)
class Value:
    """A number that the learner sets on a scale before the run.

    Attributes:
        question: one sentence.
        measure: the number to predict, which must be above 0.
        low, high: ends of the scale, 0 < low < high; the scale is logarithmic.
        factor: a guess within this factor of the measured number is right; a guess that is wrong by the
            square of this factor has the score 0.
    """

    question: str
    measure: Measure
    low: float
    high: float
    factor: float = 1.5

    def hits(self, guess: float, value: float) -> bool | None:
        """Returns whether a guess above 0 is right for a measured number; None if nothing was measured."""
        if not (math.isfinite(value) and value > 0):
            return None
        return abs(math.log(guess / value)) <= math.log(self.factor)

    def grade(self, guess: float, rows: RunRows, ghost: RunRows | None = None) -> PredictionResult:
        """Compares the guess with the run."""
        value = self.measure.value(rows, ghost)
        unit = self.measure.unit
        if not (math.isfinite(value) and value > 0 and guess > 0):
            return PredictionResult(0.0, "The run gave nothing to measure.")
        off = abs(math.log(guess / value)) / math.log(self.factor)
        score = min(1.0, max(0.0, 2.0 - off))
        return PredictionResult(score, f"You said {_number(guess, unit)}, it was {_number(value, unit)}.")


@dataclass(frozen=True)
class Sketch:
    """A curve that the learner draws before the run.

    Attributes:
        question: one sentence.
        signal: the signal that is drawn over time.
        low, high: the vertical range of the drawing, in the unit of the signal.
        until: the horizontal range of the drawing is 0 to `until`, s.
        band: a point counts as right within this share of the vertical range.
    """

    question: str
    signal: Signal
    low: float
    high: float
    until: float
    band: float = 0.1

    @property
    def measure(self) -> Measure:
        """The largest absolute value of the signal, which must fit into the drawing."""
        return Measure(self.signal, until=self.until)

    def grade(self, points: Sequence[tuple[float, float]], rows: RunRows) -> PredictionResult:
        """Compares the drawn points (t in s, value), connected by straight lines, with the run so far."""
        t, truth = rows["t"][:, 0], self.signal.over(rows)
        seen = np.isfinite(truth) & (t <= self.until)
        if not points or not seen.any():
            return PredictionResult(0.0, "There is nothing to compare yet.")
        times, values = np.array(sorted(points), float).T
        off = np.abs(np.interp(t[seen], times, values) - truth[seen])
        score = float((off <= self.band * (self.high - self.low)).mean())
        return PredictionResult(score, f"Your curve is close to the run for {score:.0%} of the time.")


Prediction = Choice | Value | Sketch


def _number(value: float, unit: str) -> str:
    return f"{value:.3g} {unit}".rstrip()
