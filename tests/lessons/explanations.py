"""Every sentence that names a cause, wherever a user reads one, with the place where it stands.

`passages` walks what the page, the command line and the site say; `causal` picks the sentences that give a reason.
"""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

from docs.further import further
from docs.pages.api import INSIDE, PACKAGES
from lessons.course import COURSE, load_lesson
from lessons.exercises import EXERCISES, load_exercise
from lessons.teaching.lesson import Step

ROOT = Path(__file__).parents[2]
DOCUMENTS = {
    "README": "README.md",
    "contributing": "CONTRIBUTING.md",
    "examples": "examples/README.md",
    "site": "docs/site/index.md",
    "gallery": "docs/lessons/README.md",
    **{
        name: f"docs/{name}.md"
        for name in (
            "authoring", "disagreements", "house", "instructors", "results", "serving", "settings",
        )
    },
}  # fmt: skip
"""Name of a document in a place: its file. The changelog is not among them: it says what changed."""

CAUSE = re.compile(
    r"""
    \b(?:because|therefore|hence|thus|consequently|owing\ to|due\ to|thanks\ to|as\ a\ result)\b
    | \b(?<!ever\ )since\ (?!(?:the|a|its|their|it\ was|both)?\ ?
        (?:last|first|reset|start|then|row|begin|began|asked|before|switch|load))
    | \b(?:is|are|was|were)\ why\b | \breasons?\b | \bexplain(?:s|ed)\b
    | \bcaus(?:e|es|ed|ing)\b(?!.{0,2}\*\*) | \b(?:come|comes|came)\ (?:from|of)\b
    | \b(?:lead|leads|led)\ to\b | \bresult(?:s|ed)?\ (?:in|from)\b
    | (?:^|[,;:]\ |\band\ )so\ (?!far\b|many\b|much\b|long\b|often\b|few\b|does\b|do\b|is\b|are\b|on\b|would\b|it\ was)
    | \bso\ that\b
    """,
    re.VERBOSE | re.IGNORECASE,
)
"""Words that give a reason. *For* and a colon do so, too, and mean too much else."""

_END = re.compile(r"(?<=[.!?…])[*_\")]{0,3}\s+(?=[A-ZĤΔ$*`_\"(\[|])|\s*\n\s*\n\s*|\s*\|\s*|\n\s*(?:[-#]|\d+\.) ")


def sentences(text: str) -> list[str]:
    """Of a text in Markdown, each in one line; formulas and programs of their own lines are left out."""
    text = re.sub(r"```.*?```|\$\$.*?\$\$", " ", text, flags=re.DOTALL)
    return [" ".join(each.split()) for each in _END.split(text) if each and each.strip()]


def causal(text: str) -> list[str]:
    """Its sentences that give a reason."""
    return [each for each in sentences(text) if CAUSE.search(each)]


def of_step(step: Step) -> Iterator[str]:
    """What a step tells. What makes a claim false is held by the claim's own run under `fails_with`."""
    yield from (step.title, step.text, step.do, step.why)
    if step.prediction is not None:
        yield step.prediction.question
        yield from (each.text for each in getattr(step.prediction, "options", ()))
    for claim in step.claims:
        yield from (claim.text, claim.because)


def passages() -> Iterator[tuple[str, str]]:
    """(place, text) of all that is told."""
    for name in COURSE:
        lesson, more = load_lesson(name), further(name)
        yield name, lesson.card.question
        for number, step in enumerate(lesson.steps):
            yield from ((f"{name}/{number}", text) for text in of_step(step))
        if lesson.challenge is not None:
            yield name, lesson.challenge.text
        for line in more.derivation:
            yield f"further/{name}", line.words
        for each in more.questions:
            yield from ((f"further/{name}", text) for text in (each.asked, each.answered))
    for name in EXERCISES:
        exercise = load_exercise(name)
        told = [exercise.card.question, *exercise.hints, *(each.says for each in exercise.mistakes)]
        told += [text for check in exercise.checks(0) for text in (check.text, check.why)]
        yield from ((f"exercise/{name}", text) for text in told)
    for name, file in DOCUMENTS.items():
        yield name, (ROOT / file).read_text(encoding="utf-8")
    glossary = tomllib.loads((ROOT / "app/html/glossary.toml").read_text(encoding="utf-8"))
    yield from (("glossary", str(entry["means"])) for entry in glossary.values())
    yield from _programs()


_TOLD_ABOVE = ("lessons/course/", "lessons/exercises/")


def _programs() -> Iterator[tuple[str, str]]:
    """Words on the page and the command line, and docstrings of the reference and of the examples."""
    for top in (*PACKAGES, "app", "examples"):
        for path in sorted((ROOT / top).rglob("*.py")):
            place = path.relative_to(ROOT).as_posix()
            module = place.removesuffix(".py").replace("/", ".")
            if place.startswith("lessons/course/"):
                continue
            tree = ast.parse(path.read_text(encoding="utf-8"))
            notes = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
            shown = top == "examples" or (top in PACKAGES and not module.startswith(INSIDE))
            for node in ast.walk(tree):
                if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value:
                    if id(node) not in notes or shown:
                        yield place, node.value
