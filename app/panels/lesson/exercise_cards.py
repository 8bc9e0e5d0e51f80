"""Cards of exercises: the task, the commands that begin and judge the exercise, the criteria, and hints."""

from __future__ import annotations

from collections.abc import Sequence

from app.html.markdown import rendered_line
from app.html.palette import DAMPING, LEVELS, css
from app.html.text import badge, block, esc, formula, readable
from lessons.course import load_lesson
from lessons.exercises import EXERCISES, exercises_of, load_exercise
from lessons.exercises.exercise import Exercise


def exercise_cards() -> str:
    """Returns the cards of all exercises, in order."""
    said = (
        f"<b>{len(EXERCISES)} exercises</b>: write the missing lines of a controller in a file of your own. "
        "This page runs the file whenever you save it. The last command judges the robot's motion."
    )
    return block(said) + "".join(card(load_exercise(name)) for name in EXERCISES)


def belonging_to(lesson: str) -> str:
    """Returns the cards of the exercises that belong to a lesson; "" if there are none."""
    return "".join(block(f"<b>Write it yourself.</b> {card(each)}") for each in exercises_of(lesson))


def card(exercise: Exercise) -> str:
    """Returns the card of one exercise."""
    lesson = load_lesson(exercise.lesson).card.title
    lines = "<br>".join(f"<code>{esc(each)}</code>" for each in exercise.commands())
    return block(
        f"<b>{esc(exercise.card.title)}</b><br>{rendered_line(exercise.card.question)}"
        f'<div style="opacity:0.75">{exercise.card.minutes} min · after “{esc(lesson)}”</div>'
        f"{formula(exercise.equation)}"
        f'<div style="overflow-wrap:anywhere">{lines}</div>{esc(exercise.before)}'
        f"{_judged_by(exercise)}{_hints(exercise.hints)}",
        f"border-left:3px solid {css(LEVELS[0])};margin:0.3em 0",
    )


def _judged_by(exercise: Exercise) -> str:
    lines = "".join(
        f"<li>{esc(each.text)} {esc(readable(each.condition))} {badge(f'{each.points}', DAMPING)}</li>"
        for each in exercise.checks(0)
    )
    return f"<details><summary>The criteria and their points</summary><ul>{lines}</ul></details>"


def _hints(hints: Sequence[str], number: int = 1) -> str:
    """Returns the first hint as a folded element, which contains the next hint."""
    if not hints:
        return ""
    first = rendered_line(hints[0])
    return f"<details><summary>Hint {number}</summary>{first}{_hints(hints[1:], number + 1)}</details>"
