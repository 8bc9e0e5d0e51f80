"""Numbers that texts of the course state in addition to those of the claims, and the runs that measure them.

A claim says "at most" or "at least"; a sentence like "it dips by a few millimetres" implies both bounds.
`quoted_all` contains every such number of the steps' texts that a run gives; `course_runs` computes all runs.
"""

from __future__ import annotations

from dataclasses import dataclass

from lessons.course import load_lesson
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import Step
from lessons.teaching.measure import Measure


@dataclass(frozen=True)
class Quoted:
    """A number in a sentence.

    Attributes:
        step: "lesson/place" of the step.
        phrase: words of its texts, its question or its claims.
        measure: the quantity that the phrase names.
        low, high: the range that the phrase states, in the unit of the measure.
        of: settings of the run in addition to those of the step; None: the settings of the ghost.
    """

    step: str
    phrase: str
    measure: Measure
    low: float
    high: float
    of: tuple[str, ...] | None = ()


def step_of(name: str) -> Step:
    lesson, place = name.split("/")
    return load_lesson(lesson).steps[int(place)]


def specs(quoted: Quoted) -> tuple[RunSpec, RunSpec | None]:
    """Returns the run, and the run of the ghost if the measure compares with it."""
    step = step_of(quoted.step)
    own = load_lesson(quoted.step.split("/")[0]).run_of(step)
    ghost = None if step.ghost is None else own.but(*step.ghost.set)
    spec = ghost if quoted.of is None else own.but(*quoted.of)
    assert spec is not None
    return spec, ghost if quoted.measure.over_ghost else None
