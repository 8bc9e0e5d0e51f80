"""Shows an exercise in the terminal, and tests the exercise of a teacher's own file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from app.commands.output import print_table, write_json
from app.commands.progress import progress_bar

if TYPE_CHECKING:
    from lessons.exercises.exercise import Exercise
    from lessons.exercises.result import CheckResult


def print_exercise(exercise: Exercise, begin: str, hints: int) -> None:
    """Prints the card of an exercise, its checks and its first hints; begin: the command that starts it."""
    card = exercise.card
    of = f"; belongs to lesson {exercise.lesson}" if exercise.lesson else ""
    print(f"{exercise.name}: {card.title} ({card.minutes} minutes{of})")
    print(f"  {card.question}")
    print(f"  {exercise.plain}")
    print(f"  begin: {begin}")
    for check in exercise.checks(0):
        print(f"    {check.points} points: {check.text} {check.condition}")
    print_hints(exercise.hints, hints)


def print_hints(all_hints: tuple[str, ...], count: int) -> None:
    for number, hint in enumerate(all_hints[:count], start=1):
        print(f"hint {number} of {len(all_hints)}: {hint}")


def check_exercise(file: Path, seed: int, hints: int, json: str | None) -> int:
    """Shows and tests the exercise of a teacher's file. Exit code 0: the exercise can be used; 1: the report
    names errors."""
    from lessons.exercises.own import exercise_in
    from lessons.exercises.prove import prove
    from lessons.parallel import on_cores

    exercise = exercise_in(str(file))
    if json is None:
        print_exercise(exercise, f"himpc-lab new controller {exercise.file} --from {file}", hints)
    with progress_bar(f"grading the solution and the mistakes of {file} …", json is None) as advance:
        proof = prove(str(file), seed, on_cores, advance)
    if json is not None:
        write_json({"name": exercise.name, "faults": list(proof.faults)}, json)
        return 1 if proof.faults else 0
    graded = [("the solution", proof.solution), ("the start", proof.start), *proof.mistakes]
    rows = [[says, f"{grade.points}/{grade.of}", _missed(grade.lines)] for says, grade in graded]
    print_table(str(file), ("file", "points", "checks that it fails"), rows)
    print("\n".join(proof.faults) or "the exercise can be used")
    return 1 if proof.faults else 0


def _missed(lines: tuple[CheckResult, ...]) -> str:
    return ", ".join(str(place) for place, line in enumerate(lines, start=1) if line.why)
