"""What the course says in numbers beside its claims: what such a number is, and the runs that give it.

A claim says "at most" or "at least"; a sentence like "it dips by a few millimetres" says both. `quoted_all`
holds every such number of the steps' texts that a run gives; `course_runs` makes all the runs.
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
        phrase: of its texts, its question or its claims.
        measure: what the phrase speaks of.
        low, high: what the phrase says of it, in the measure's unit.
        of: settings on top of the step's that it speaks of; None: the ghost's.
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
    """Its run, and the ghost's if it compares."""
    step = step_of(quoted.step)
    own = load_lesson(quoted.step.split("/")[0]).run_of(step)
    ghost = None if step.ghost is None else own.but(*step.ghost.set)
    spec = ghost if quoted.of is None else own.but(*quoted.of)
    assert spec is not None
    return spec, ghost if quoted.measure.over_ghost else None
