"""A page per lesson, made from its file: idea, prediction, run, claims with their measured values,
explanation."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from docs.figures.steps import robot_of, told_settings, why_not
from docs.further import further
from docs.further.kit import Further
from docs.pages.curves import figure
from docs.record import FOLDER
from lessons.course import COURSE, load_lesson
from lessons.exercises import exercises_of
from lessons.teaching.lesson import Claim, Lesson, Step
from lessons.teaching.prediction import Choice

MEASURED = "docs/site/measured.json"
"""The results of `himpc-lab lessons --check --json docs/site/measured.json`."""

RECORDED = FOLDER.relative_to(Path(__file__).parents[2])
"""The folder of the runs that `python -m docs.record` stored."""

Checks = dict[tuple[str, str], dict[str, Any]]


def pages(root: Path, live: bool = False) -> dict[str, str]:
    """Returns the name and Markdown of each page and of their index; live: whether the pages have live
    figures."""
    known = measured(root / MEASURED)
    found, rows = {}, []
    for number, name in enumerate(COURSE, start=1):
        lesson = load_lesson(name)
        picture = (root / "docs" / "lessons" / f"{name}.webp").exists()
        film = json.loads((root / RECORDED / f"{name}.json").read_text(encoding="utf-8"))
        found[f"lessons/{name}"] = page(lesson, known.get(name, {}), film, further(name), picture, live)
        card = lesson.card
        rows.append(f"| {number} | [{card.title}]({name}.md) | {cell(card.question)} | {card.minutes} |")
    listed = "\n".join(COURSE)
    found["lessons/index"] = (
        "# Lessons\n\nEach lesson asks for a prediction, runs the real controller and checks its claims. "
        "`himpc-lab --lesson NAME` opens a lesson on the page, and `himpc-lab lessons --check NAME` "
        "checks its claims without the page.\n\n"
        "| | lesson | asks | minutes |\n|---|---|---|---|\n"
        + "\n".join(rows)
        + f"\n\n```{{toctree}}\n:hidden:\n\n{listed}\n```\n"
    )
    return found


def measured(path: Path) -> dict[str, Checks]:
    """Returns the measured results of each lesson, by step and claim; an empty dictionary if the file does
    not exist."""
    if not path.exists():
        return {}
    told = json.loads(path.read_text(encoding="utf-8"))
    return {
        each["name"]: {(check["step"], check["what"]): check for check in each["checks"]}
        for each in told["lessons"]
    }


def page(
    lesson: Lesson, checks: Checks, film: Mapping[str, Any], more: Further, picture: bool, live: bool = False
) -> str:
    """Returns the page of one lesson."""
    card = lesson.card
    parts = [
        f"# {card.title}",
        f"*{card.question}*",
        f"About {card.minutes} minutes. You need: {card.needs}",
        f"`himpc-lab --lesson {lesson.name}` opens the lesson, "
        f"`himpc-lab lessons --check {lesson.name}` checks its claims.",
    ]
    for number, step in enumerate(lesson.steps, start=1):
        here = runs_here(lesson, number - 1) if live else ""
        parts += step_parts(step, number, checks, film["steps"][number - 1], here)
        if number - 1 == film["motion"]["step"]:
            parts.append(watch(lesson.name, f"{card.title}: {step.title}", step, "../"))
    if lesson.challenge is not None:
        goals = lesson.challenge.goals
        parts += ["## Challenge", unindented(lesson.challenge.text), table(goals, "challenge", checks)]
    parts += derivation(more)
    parts += questions(more)
    if own := exercises_of(lesson.name):
        anchors = (f"[{each.card.title}](../exercises.md)" for each in own)
        parts += ["## Write it yourself", "Exercise: " + ", ".join(anchors)]
    if picture:
        parts += [
            "## On the page",
            "The page before and after the run of each step. The predictions shown are tempting, and many "
            "are wrong.",
            f"![{card.title}, step by step]({lesson.name}.webp)",
        ]
    return "\n\n".join(parts) + "\n"


def watch(name: str, title: str, step: Step, up: str) -> str:
    """Returns the HTML of a 3D recording that is loaded on a click; up: the path from the page to the site's
    root."""
    ghost = f" Violet: the ghost, {escape(step.ghost.words)}." if step.ghost else ""
    return (
        f'<figure class="film"><button type="button" data-film="{up}films/player.html#{name}" '
        f'title="{escape(title)}">▶ Watch it move in 3D</button>'
        f"<figcaption>{escape(step.title)}, {step.duration:g} s, as recorded.{ghost} Turn it with the mouse."
        "</figcaption></figure>"
    )


def derivation(more: Further) -> list[str]:
    """Returns the derivation step by step, each equation on a line of its own."""
    told = "\n\n".join(f"{line.words}\n\n$$\n{line.equation}\n$$" for line in more.derivation)
    return ["## From the paper's equations", told]


def questions(more: Further) -> list[str]:
    """Returns the questions with answers to unfold."""
    parts = ["## On paper"]
    for number, each in enumerate(more.questions, start=1):
        parts += [
            f"**{number}.** {each.asked}",
            "<details><summary>Answer</summary>",
            each.answered,
            "</details>",
        ]
    return parts


def runs_here(lesson: Lesson, place: int) -> str:
    """Returns the HTML of a step's live figure, which is loaded on a click, or the reason why the step has no
    live figure."""
    reason = why_not(lesson.name, place)
    if reason is not None:
        told = f"This step runs in himpc-lab only. Its recording follows. {escape(reason)}."
        return f'<p class="recorded">{told}</p>'
    step = lesson.steps[place]
    robot, own = robot_of(lesson, step), told_settings(lesson, step)
    return (
        f'<figure class="live"><button type="button" data-live="{lesson.name}/{place + 1}/{robot}" '
        f"data-root='../' data-set='{escape(json.dumps(own))}'>▶ Run this step here, in the browser</button>"
        "<figcaption>Controller and MuJoCo run on this device: nothing is loaded from elsewhere.</figcaption>"
        "</figure>"
    )


def step_parts(step: Step, number: int, checks: Checks, film: Mapping[str, Any], here: str = "") -> list[str]:
    """Returns the part of a page about one step of the lesson; here: the HTML of its live figure."""
    parts = [f"## {number}. {step.title}", unindented(step.text)]
    if step.prediction is not None:
        asked = [f"**What do you think?** {step.prediction.question}"]
        if isinstance(step.prediction, Choice):
            asked.append("\n".join(f"- {option.text}" for option in step.prediction.options))
        parts += asked
    parts += [here] if here else []
    parts.append(figure(film, step.ghost.words if step.ghost else None))
    parts += ["**What the run shows**", table(step.claims, step.title, checks)]
    parts += ["<details><summary>Why</summary>", unindented(step.why), "</details>"]
    parts.append(f"**Then, by hand**: {unindented(step.do)}")
    return parts


def table(claims: Sequence[Claim], step: str, checks: Checks) -> str:
    """Returns a table of the claims, their bounds, their measured values, and the setting under which each
    fails."""
    rows = ["| claim | bound | measured | fails with |", "|---|---|---|---|"]
    for claim in claims:
        check = next(
            (found for (where, what), found in checks.items() if what == claim.text and step in where), {}
        )
        wrong = ", ".join(f"`{each}`" for each in claim.fails_with)
        wrong += f": {number_of(check.get('measured_there'), claim.measure.unit)}" if check and wrong else ""
        wrong += f" ({claim.because})" if claim.because else ""
        seen = number_of(check.get("measured"), claim.measure.unit)
        rows.append(f"| {cell(claim.text)} | {claim.condition} | {seen} | {cell(wrong)} |")
    return "\n".join(rows)


def number_of(value: float | None, unit: str) -> str:
    """Returns a number with three digits and its unit."""
    return "–" if value is None else f"{value:.3g} {unit}".rstrip()


def cell(text: str) -> str:
    """Returns a text in a form that is allowed in a cell of a table."""
    return " ".join(text.split()).replace("|", "\\|")


def unindented(text: str) -> str:
    """Returns a lesson's text without the space around it; formulas keep their own lines."""
    return text.strip()
