"""One page of all exercises, made from their files."""

from __future__ import annotations

from pathlib import Path

from docs.pages.lessons import cell
from lessons.course import load_lesson
from lessons.exercises import EXERCISES, load_exercise, start_of
from lessons.exercises.exercise import Exercise


def pages(_: Path) -> dict[str, str]:
    """Returns the name and Markdown of the page."""
    parts = [
        "# Exercises",
        "Write the missing lines of a controller in a file of your own. The page runs each version that you "
        "save, and `himpc-lab grade` grades the motion of the robot, not the text of the file.",
    ]
    return {"exercises": "\n\n".join([*parts, *(part(load_exercise(name)) for name in EXERCISES)]) + "\n"}


def part(exercise: Exercise) -> str:
    """Returns one exercise: card, equation, commands, the file to complete, checks, hints to unfold."""
    card, commands = exercise.card, "\n".join(exercise.commands())
    lesson = load_lesson(exercise.lesson).card.title
    checks = ["| points | check | bound |", "|--:|---|---|"]
    checks += [f"| {each.points} | {cell(each.text)} | {each.condition} |" for each in exercise.checks(0)]
    hints = [
        f"<details><summary>Hint {number}</summary>\n\n{hint.strip()}\n\n</details>"
        for number, hint in enumerate(exercise.hints, start=1)
    ]
    return "\n\n".join(
        [
            f"## {card.title}",
            f"*{card.question}*",
            f"About {card.minutes} minutes; after [{lesson}](lessons/{exercise.lesson}.md).",
            f"$$\n{exercise.equation}\n$$",
            f"```sh\n{commands}\n```",
            *([exercise.before] if exercise.before else []),
            f"```python\n{start_of(exercise.name).strip()}\n```",
            "\n".join(checks),
            *hints,
        ]
    )
