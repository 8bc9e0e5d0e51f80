"""Tests whether a teacher's own exercise can be graded: the solution gets all points, every known mistake
loses some points, and every check detects a mistake."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, replace

from lessons.exercises.exercise import Exercise
from lessons.exercises.grade import Submission, grade_apart
from lessons.exercises.own import exercise_in
from lessons.exercises.result import Grade
from lessons.own.files import Source, read
from lessons.parallel import FailedJob, Spread


@dataclass(frozen=True)
class Proof:
    """The grades of the solution, the start and the known mistakes of a teacher's own exercise.

    Attributes:
        exercise: the exercise.
        solution: the grade of the solution.
        start: the grade of the file that students begin with, in which lines are missing.
        mistakes: for every known mistake, in order, the sentence that names it and its grade.
    """

    exercise: Exercise
    solution: Grade
    start: Grade
    mistakes: tuple[tuple[str, Grade], ...]

    @property
    def faults(self) -> tuple[str, ...]:
        """Sentences that say what must be corrected; () if the exercise can be used."""
        faults: list[str] = []
        for name, grade in (("the solution", self.solution), ("the start", self.start)):
            if grade.error:
                faults.append(f"{name} cannot be run: {grade.error}")
        faults += [
            f"the solution misses the check '{line.check}': {line.why}"
            for line in self.solution.lines
            if line.why
        ]
        if self.start.passed:
            faults.append("the start already gets all points: leave something to be written")
        for says, grade in self.mistakes:
            if grade.error:
                faults.append(f"the mistake '{says}' cannot be run: {grade.error}")
            elif grade.passed:
                faults.append(
                    f"the mistake '{says}' gets all points: add a check that this mistake does not pass"
                )
            elif not any(says in line.why for line in grade.lines):
                faults.append(f"the mistake '{says}' is not named: another mistake returns the same torques")
        missed = {index for _, grade in self.mistakes for index, line in enumerate(grade.lines) if line.why}
        faults += [
            f"the check '{check.text}' is passed by every mistake: add a mistake that does not pass it"
            for index, check in enumerate(self.exercise.checks(0))
            if index not in missed
        ]
        return tuple(faults)


def prove(path: str, seed: int, spread: Spread, progress: Callable[[float], None]) -> Proof:
    """Grades the solution, the start and the mistakes of a teacher's file, each in a separate process, like
    submissions.

    Args:
        path: the teacher's file.
        seed: seed of the disturbances.
        spread: function that distributes the work over the cores.
        progress: called with the completed share.

    Raises:
        InputError: the file cannot be used.
    """
    exercise = exercise_in(path)
    model = Submission.to(path, read(path), seed)
    texts = [("solution", exercise.solution), ("start", exercise.start)]
    texts += [(f"mistake {k}", mistake.text) for k, mistake in enumerate(exercise.mistakes, start=1)]
    work = [replace(model, source=Source(f"{path}, {name}", text)) for name, text in texts]
    grades: dict[int, Grade] = {}
    with closing(spread(grade_apart, work)) as outcomes:
        for index, outcome in outcomes:
            if isinstance(outcome, FailedJob):
                outcome = Grade(work[index].source.path, "", exercise.name, error=outcome.reason)
            grades[index] = outcome
            progress(len(grades) / len(work))
    mistakes = tuple((mistake.says, grades[k]) for k, mistake in enumerate(exercise.mistakes, start=2))
    return Proof(exercise, grades[0], grades[1], mistakes)
