"""Exercises as cards: what to write, and the commands that begin and judge it."""

from __future__ import annotations

from app.html.markdown import rendered_line
from app.html.palette import LEVELS, css
from app.html.text import block, esc
from lessons.course import load_lesson
from lessons.exercises import EXERCISES, exercises_of, load_exercise
from lessons.exercises.exercise import Exercise


def exercise_cards() -> str:
    """All of them, in order."""
    said = (
        f"<b>{len(EXERCISES)} exercises</b>: write the missing lines of a controller in a file of your own; "
        "what you save runs here, and the last command judges what the robot does."
    )
    return block(said) + "".join(card(load_exercise(name)) for name in EXERCISES)


def belonging_to(lesson: str) -> str:
    """The exercises that a lesson leads to; nothing if there is none."""
    return "".join(block(f"<b>Write it yourself.</b> {card(each)}") for each in exercises_of(lesson))


def card(exercise: Exercise) -> str:
    """One exercise."""
    lesson = load_lesson(exercise.lesson).card.title
    lines = "<br>".join(f"<code>{esc(each)}</code>" for each in exercise.commands())
    return block(
        f"<b>{esc(exercise.card.title)}</b><br>{rendered_line(exercise.card.question)}"
        f'<div style="opacity:0.75">{exercise.card.minutes} min · after “{esc(lesson)}”</div>'
        f'<div style="overflow-wrap:anywhere">{lines}</div>',
        f"border-left:3px solid {css(LEVELS[0])};margin:0.3em 0",
    )
