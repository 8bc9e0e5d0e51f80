"""The start page: a card per lesson and exercise, in order, with the learner's progress."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from importlib.resources import files

import viser

from app.html.markdown import rendered_line
from app.html.palette import DAMPING, GOOD, LEVELS, css
from app.html.palette import button as dark
from app.html.text import badge, block, esc, formula, readable
from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace, parts_of
from app.panels.widgets.command import on_click
from app.tab.context import PageContext
from lessons.course import COURSE, load_lesson
from lessons.exercises import EXERCISES, exercises_of, load_exercise
from lessons.exercises.exercise import Exercise
from lessons.replay.progress import LearnerProgress
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import Lesson

Choose = Callable[[SceneChoice], None]

LABORATORY = SceneChoice(RunSpec("iiwa14-hold"))
"""The scene with which the free laboratory begins."""


GROUPS: dict[str, tuple[str, tuple[str, ...]]] = {
    "Foundations": (
        "One arm, several tasks: what a hierarchy does, and how it is computed.",
        ("a-redundant-arm", "one-task", "no-model-needed", "two-tasks", "swap-the-priorities",
         "when-tasks-fight", "inside-the-qp", "your-robot"),
    ),
    "Limits": (
        "Torque, speed, range, time and a wrong model: what a real robot cannot do.",
        ("stretched-out", "torque-has-a-limit", "stopping-takes-distance", "how-far-ahead", "deadlines",
         "sensors-are-coarse", "the-model-is-wrong"),
    ),
    "Contact": ("Things in the way, seen and unseen.", ("a-blind-arm", "keeping-clear")),
    "Mobile": (
        "An arm that drives: tasks one after the other.",
        ("first-hold-then-reach", "how-strict-is-strict", "seeing-ahead", "deliveries", "told-wrong"),
    ),
}  # fmt: skip
"""The groups of the course: what each is about, and its lessons. Its picture is that of its first lesson."""
PATHS: dict[str, tuple[str, ...]] = {
    "Ten minutes": ("a-redundant-arm",),
    "An hour": ("a-redundant-arm", "two-tasks", "swap-the-priorities", "torque-has-a-limit", "a-blind-arm"),
    "The whole course": COURSE,
}
"""Lessons for the time that a learner has."""


def add_cards(page: PageContext, choose: Choose) -> None:
    """Adds the paths and the cards to the current container; every button can be reached by the keyboard.
    choose: opens a step or a scene."""
    gui, progress = page.gui, page.visitor.notebook.progress
    gui.add_html(block("<b>How much time do you have?</b> Your progress is stored in this browser."))
    for words, names in PATHS.items():
        name, place = _unfinished(names, progress)
        numbers = ", ".join(str(COURSE.index(each) + 1) for each in names)
        listed = f"{len(names)} lessons" if names == COURSE else f"lesson{'s' * (len(names) > 1)} {numbers}"
        _button(gui, f"{words}: {listed}", SceneChoice.of_lesson(LessonPlace(name, place)), choose, LEVELS[1])
    for title, (about, names) in GROUPS.items():
        done = sum(_offer(load_lesson(name), progress)[0] == "Again" for name in names)
        count = f"{len(names)} lessons, {done} done"
        gui.add_html(_framed(glyph(names[0]), f"<b>{title}</b> · {count}<br>{esc(about)}"))
        with gui.add_folder(f"Lessons: {title}", expand_by_default=False):
            for name in names:
                _add_card(gui, COURSE.index(name) + 1, load_lesson(name), progress, choose)
    gui.add_html(
        _framed(
            glyph("laboratory"),
            "<b>Free laboratory</b><br>Any robot, any scene, every setting, without a lesson.",
        )
    )
    _button(gui, "Go to the laboratory", LABORATORY, choose)


def _add_card(
    gui: viser.GuiApi, number: int, lesson: Lesson, progress: LearnerProgress, choose: Choose
) -> None:
    gui.add_html(_card(number, lesson, progress))
    word, place = _offer(lesson, progress)
    choice = SceneChoice.of_lesson(LessonPlace(lesson.name, place))
    _button(gui, f"{word} {number} · {lesson.card.title}", choice, choose)


def _unfinished(names: Sequence[str], progress: LearnerProgress) -> tuple[str, int]:
    """Returns the first lesson that is not finished, and the step to open; the first one if all are."""
    offers = {name: _offer(load_lesson(name), progress) for name in names}
    name = next((name for name, (word, _) in offers.items() if word != "Again"), names[0])
    return name, offers[name][1]


def add_invitation(page: PageContext) -> None:
    """Adds a button that leads to the next lesson or step, depending on the learner's progress."""
    progress = page.visitor.notebook.progress
    name, place = _unfinished(COURSE, progress)
    lesson, number = load_lesson(name), COURSE.index(name) + 1
    word, _ = _offer(lesson, progress)
    label = f"{word} lesson {number}: {lesson.card.title}"
    _button(page.gui, label, SceneChoice.of_lesson(LessonPlace(name, place)), page.choose, LEVELS[1])


def _button(
    gui: viser.GuiApi,
    label: str,
    choice: SceneChoice,
    choose: Choose,
    colour: tuple[int, int, int] | None = None,
) -> None:
    button = gui.add_button(label, color=None if colour is None else dark(colour))

    on_click(button, lambda: choose(choice))


def _offer(lesson: Lesson, progress: LearnerProgress) -> tuple[str, int]:
    """Returns the label of the button ("Start", "Continue" or "Again") and the index of the step that it
    opens."""
    seen = progress.seen.get(lesson.name, frozenset())
    parts = len(parts_of(lesson))
    place = progress.next_step(lesson.name, parts)
    return ("Start" if not seen else "Continue" if place else "Again"), place


def _card(number: int, lesson: Lesson, progress: LearnerProgress) -> str:
    card = lesson.card
    parts = parts_of(lesson)
    seen = progress.seen.get(lesson.name, frozenset())
    steps = "".join("●" if place in seen else "○" for place in range(len(parts)))
    state = f'<span title="{len(seen)} of {len(parts)} parts seen">{steps} {len(seen)}/{len(parts)}</span>'
    if len(seen) >= len(parts):
        state = badge("✓ DONE", GOOD)
    if lesson.name in progress.best:
        state += f" best score {progress.best[lesson.name]:.0f}"
    return _framed(
        glyph(lesson.name),
        f"<b>{number} · {esc(card.title)}</b><br>{esc(card.question)}"
        f'<div style="opacity:0.75">{card.minutes} min · needs {esc(_needs(card.needs))}</div>{state}',
    )


def _needs(needs: str) -> str:
    """Replaces names of lessons by their titles."""
    for name in COURSE:
        needs = needs.replace(f'"{name}"', f"“{load_lesson(name).card.title}”")
    return needs


def _framed(picture: str, words: str) -> str:
    return block(
        f'<div style="display:flex;gap:0.8em;align-items:flex-start">'
        f'<div style="flex:0 0 4.6em">{picture}</div><div style="min-width:0">{words}</div></div>',
        f"border-top:1px solid {css((139, 149, 161), 0.35)};padding-top:0.6em;margin-top:0.3em",
    )


@cache
def glyph(name: str) -> str:
    """Returns the icon of a lesson: SVG in the colour of the surrounding text."""
    folder = files("app.panels.lesson") / "glyphs"
    found = folder / f"{name}.svg"
    return (found if found.is_file() else folder / "lesson.svg").read_text(encoding="utf-8")


def exercise_cards() -> str:
    said = (
        f"<b>{len(EXERCISES)} exercises</b>: write the missing lines of a controller in a file of your own. "
        "This page runs the file whenever you save it. The last command judges the robot's motion."
    )
    return block(said) + "".join(card(load_exercise(name)) for name in EXERCISES)


def belonging_to(lesson: str) -> str:
    """Returns the cards of the exercises that belong to a lesson; "" if there are none."""
    cards = "".join(card(each) for each in exercises_of(lesson))
    return cards and block(f"<details><summary><b>Write it yourself</b></summary>{cards}</details>")


def card(exercise: Exercise) -> str:
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
