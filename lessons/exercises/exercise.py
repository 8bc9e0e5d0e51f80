"""An exercise as data: the task, and the checks that grade a solution."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from lessons.events import Push
from lessons.exercises.mistakes import Law, Mistake
from lessons.scenes.run_spec import RunSpec
from lessons.settings.schema import settings_of
from lessons.settings.torque import TorqueSettings
from lessons.teaching.lesson import Card, Relation, Script, condition, holds
from lessons.teaching.measure import Measure

TORQUE_UNIT = "N·m"


@dataclass(frozen=True)
class GradeCheck:
    """One statement about a submission, and the measured value that decides it.

    Attributes:
        text: the statement, as a sentence.
        why: a possible cause, shown if the statement does not hold and no known mistake fits.
        run: the run in which the value is measured; its controller is the submission.
        relation, bound: the condition: the value is "at most" or "at least" the bound.
        measure: the quantity that is measured in the submission's own run. None: the difference in torque
            from the controller `beside` is measured.
        beside: the lab's controller, or a control law, that moves the robot while the submission receives
            the same states. The value is the largest difference in torque, N·m.
        points: number of points if the statement holds.
    """

    text: str
    why: str
    run: RunSpec
    bound: float
    relation: Relation = "at most"
    measure: Measure | None = None
    beside: str | Law = ""
    points: int = 1

    def holds(self, value: float) -> bool:
        """Returns whether a value meets the condition; False for NaN."""
        return holds(value, self.relation, self.bound)

    @property
    def unit(self) -> str:
        return TORQUE_UNIT if self.measure is None else self.measure.unit

    @property
    def condition(self) -> str:
        """The condition as an inequality, e.g. "≤ 1 mm"."""
        return condition(self.relation, self.bound, self.unit)


@dataclass(frozen=True)
class Exercise:
    """The task of an exercise and the checks that grade a solution.

    Attributes:
        name: its key in `lessons.exercises.EXERCISES`, or the name of a teacher's own exercise.
        card: title, question, duration and required knowledge.
        equation: the equation in LaTeX.
        plain: the equation as plain text, for a terminal.
        hints: hints for students, shown one by one.
        lesson: the lesson to which the exercise belongs; "" if there is none.
        checks: function that returns the checks for a seed; the seed decides the disturbances.
        mistakes: frequent mistakes that the grade can name.
        start, solution: the file with missing lines and the complete file, for a teacher's own exercise; ""
            for the lab's exercises.
        live: assignments "PATH=VALUE" that are needed to watch a solution on the page.
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
        """The scene in which a solution is shown live."""
        return self.checks(0)[-1].run.scene

    @property
    def before(self) -> str:
        """The sentence that says what to set on the page before a solution is watched; "" if nothing."""
        pairs = [assignment.split("=", 1) for assignment in self.live]
        labels = {setting.path: setting.shown.label for setting in settings_of(TorqueSettings)}
        changes = [f"“{labels[path]}” to {value}" for path, value in pairs]
        return f"On the page, first set {', '.join(changes)}." if changes else ""

    @property
    def file(self) -> str:
        """The suggested name for the file with a solution."""
        return f"my_{self.name.replace('-', '_')}.py"

    def commands(self, file: str | None = None) -> tuple[str, str, str]:
        """Returns the commands that create a file for a solution (by default `self.file`), show it on the
        page, and grade it.
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
    """Returns the run with an additional push of 0.1 s, whose direction depends on the seed. plane: whether
    the push lies in the plane of a planar arm."""
    direction = np.random.default_rng(seed).normal(size=3)
    if plane:
        direction[2] = 0.0
    x, y, z = (newtons * direction / np.linalg.norm(direction)).tolist()
    events: Script = (*(run.events or ()), (at, Push(body, (x, y, z), seconds=0.1)))
    return replace(run, events=events)


def with_gains(run: RunSpec, seed: int, *levels: str, K_p: float = 100.0) -> RunSpec:
    """Returns the run with gains of these levels that depend on the seed: K_p, 1/s², is up to twice or half
    as large as given, and K_v, 1/s, is 0.7 to 1.3 times the critical damping 2 √K_p. A law with the gains of
    another run then returns other torques."""
    rng, gains = np.random.default_rng([seed, 1]), []
    for level in levels:
        drawn = K_p * 2.0 ** rng.uniform(-1.0, 1.0)
        K_v = 2.0 * drawn**0.5 * rng.uniform(0.7, 1.3)
        gains += [f"levels.{level}.K_p={drawn:.4g}", f"levels.{level}.K_v={K_v:.4g}"]
    return run.but(*gains)
