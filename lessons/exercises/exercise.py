"""An exercise as data: the task, and the checks that grade a solution."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from lessons.events import Push
from lessons.exercises.mistakes import Mistake
from lessons.scenes.run_spec import RunSpec
from lessons.settings.entry import entry_at
from lessons.settings.torque_entries import TORQUE_ENTRIES
from lessons.teaching.claim import Relation, condition, holds
from lessons.teaching.control import Script
from lessons.teaching.lesson import Card
from lessons.teaching.measure import Measure

TORQUE_UNIT = "N·m"


@dataclass(frozen=True)
class GradeCheck:
    """One statement about a submission that is measured.

    Attributes:
        text: the statement, as a sentence.
        why: a possible cause if the statement does not hold and no known mistake fits.
        run: the run in which it is measured; the controller is the submission.
        relation, bound: the condition: the value is "at most" or "at least" the bound.
        measure: the measured quantity of the submission's own run; None: the difference in torque from the
            controller `beside`.
        beside: the lab's controller that drives the run while the submission is shown the same states; the
            largest difference in torque is measured, N·m.
        points: number of points if it holds.
    """

    text: str
    why: str
    run: RunSpec
    bound: float
    relation: Relation = "at most"
    measure: Measure | None = None
    beside: str = ""
    points: int = 1

    def holds(self, value: float) -> bool:
        """Whether a value meets the condition; NaN does not."""
        return holds(value, self.relation, self.bound)

    @property
    def unit(self) -> str:
        return TORQUE_UNIT if self.measure is None else self.measure.unit

    @property
    def condition(self) -> str:
        """E.g. "≤ 1 mm"."""
        return condition(self.relation, self.bound, self.unit)


@dataclass(frozen=True)
class Exercise:
    """The task of an exercise and the checks that grade a solution.

    Attributes:
        name: its name in `lessons.exercises.EXERCISES`, or that of a teacher's own exercise.
        card: the docstring of its file.
        equation: LaTeX.
        plain: the equation as plain text, for a terminal.
        hints: shown one by one.
        lesson: the lesson it belongs to; "" if there is none.
        checks: function of a seed, which decides the disturbances.
        mistakes: frequent mistakes, which the grade names.
        start, solution: the file with the missing lines and the right one, of a teacher's own exercise; ""
            for the lab's.
        live: assignments "PATH=VALUE" with which to watch a solution.
    """

    name: str
    card: Card
    equation: str
    plain: str
    hints: tuple[str, ...]
    lesson: str
    checks: Callable[[int], tuple[GradeCheck, ...]]
    mistakes: tuple[Mistake, ...] = ()
    start: str = ""
    solution: str = ""
    live: tuple[str, ...] = ()

    @property
    def scene(self) -> str:
        """The scene in which to watch the solution live."""
        return self.checks(0)[-1].run.scene

    @property
    def before(self) -> str:
        """What to set on the page before a solution is watched there; "" if nothing."""
        pairs = [each.split("=", 1) for each in self.live]
        said = [f"“{entry_at(TORQUE_ENTRIES, path).label}” to {value}" for path, value in pairs]
        return f"On the page, first set {', '.join(said)}." if said else ""

    @property
    def file(self) -> str:
        """A name for the file with a solution."""
        return f"my_{self.name.replace('-', '_')}.py"

    def commands(self, file: str | None = None) -> tuple[str, str, str]:
        """The commands that start a solution in a file (by default `file`), show it on the page, and grade
        it.
        """
        file = file or self.file
        return (
            f"himpc-lab new controller {file} --from {self.name}",
            f"himpc-lab --scene {self.scene} --controller {file}",
            f"himpc-lab grade {file}",
        )


def pushed(
    run: RunSpec, seed: int, body: str, newtons: float, at: float = 0.2, plane: bool = False
) -> RunSpec:
    """The run with a push of 0.1 s in a direction that the seed decides; in the plane of a planar arm."""
    direction = np.random.default_rng(seed).normal(size=3)
    if plane:
        direction[2] = 0.0
    x, y, z = (newtons * direction / np.linalg.norm(direction)).tolist()
    events: Script = (*(run.events or ()), (at, Push(body, (x, y, z), seconds=0.1)))
    return replace(run, events=events)
