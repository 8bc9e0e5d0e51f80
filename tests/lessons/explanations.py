"""Finds every sentence that gives a reason, in all texts that users read, and the place of the sentence.

`passages` yields the texts of the page, the command line and the site; `causal` selects the sentences that
give a reason.
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
from lessons.exercises import EXERCISES, load_exercise, start_of
from lessons.teaching.lesson import Step

ROOT = Path(__file__).parents[2]
_IN_DOCS = (
    *(
        "authoring",
        "disagreements",
        "export",
        "house",
        "instructors",
        "results",
        "serving",
        "settings",
    ),
)
DOCUMENTS = {
    "README": "README.md",
    "contributing": "CONTRIBUTING.md",
    "examples": "examples/README.md",
    "site": "docs/site/index.md",
    "gallery": "docs/lessons/README.md",
    **{name: f"docs/{name}.md" for name in _IN_DOCS},
}
"""Name of a document in a place: its file. The changelog is not included, because it lists changes only."""

CAUSE = re.compile(
    r"""
    \b(?:because(?!:)|therefore|hence|thus|consequently|owing\ to|due\ to|thanks\ to|as\ a\ result)\b
    | (?<!ever\ )(?<!gone\ on\ )\bsince\b(?![.:,]|\ (?:t\ =|(?:when|then|it\ was|both\ began)\b)
        |\ (?:the|its|their)\ (?:last|first|start|reset|switch)\b)
    | \b(?:is|are|was|were)\ why\b | \bthe\ reason\b | \bcaus(?:e|es|ed|ing)\b
    | \b(?:comes?|came)\ from\b
    | \b(?:leads?|led)\ to\b | \bresult(?:s|ed)?\ (?:in|from)\b
    | (?:^|[,;:]\ |\band\ )so\b(?!\ (?:far|many|much|long|often|few|little|large|on)\b
        |\ (?:what|would|does|do|it\ was|are\ those)\b)
    | \bso\ that\b | \bto\ blame\b | (?:'s|s')\ doing\b
    """,
    re.VERBOSE | re.IGNORECASE,
)
"""Words that give a reason. *For* and a colon are not included, because they have many other meanings."""

GIVEN = re.compile(r"\bgiven, not\b|\(given\b", re.IGNORECASE)
"""Marks a sentence whose reason was not measured here."""

_PROGRAM = re.compile(r"```.*?```|\$\$.*?\$\$", re.DOTALL)
_LABEL = re.compile(r"\*\*(?:Likely cause|Our evidence|See it)\.\*\*")
_END = re.compile(
    r"""
    (?<=[.!?…])[*_")]{0,3}\s+(?=[^\sa-z])  # a sentence
    | \s*\n\s*\n\s*  # a paragraph
    | \s*(?:^|\s)\|(?:\s|$)\s*  # a cell of a table
    | \n\s*(?:[-#]|\d+\.)\s  # a line of a list
    | \n\s+(?=[\w, *]+:\s)  # an argument or attribute
    """,
    re.VERBOSE,
)


def sentences(text: str) -> list[str]:
    """Returns the sentences of a Markdown text, each in one line; displayed formulas and programs are
    omitted."""
    plain = _LABEL.sub("\n\n", _PROGRAM.sub(" … ", text))
    found = (" ".join(each.split()).strip("| ") for each in _END.split(plain) if each)
    return [each for each in found if each]


def causal(text: str) -> list[str]:
    """Returns the sentences that give a reason. Questions, and reasons that are marked as given, are
    omitted."""
    found = [each for each in sentences(text) if CAUSE.search(each) and not GIVEN.search(each)]
    return [each for each in found if not each.endswith("?")]


def of_step(step: Step) -> Iterator[str]:
    """Yields the statements of a step. The options of a prediction are not statements. The reason of a claim
    is tested by the run of its `fails_with`."""
    yield from (step.text, step.do, step.why)
    if step.prediction is not None:
        yield step.prediction.question
    for claim in step.claims:
        yield from (claim.text, claim.because)


def passages() -> Iterator[tuple[str, str]]:
    """Yields (place, text) of all texts. The place is written as in `interventions.Intervention.at`, as
    "exercise/name", or as the name of a source file."""
    for name in COURSE:
        lesson, more = load_lesson(name), further(name)
        yield name, lesson.card.question
        for number, step in enumerate(lesson.steps):
            yield from ((f"{name}/{number}", text) for text in of_step(step))
        if lesson.challenge is not None:
            yield name, lesson.challenge.text
        told = [line.words for line in more.derivation]
        told += [text for each in more.questions for text in (each.asked, each.answered)]
        yield from ((f"further/{name}", text) for text in told)
    for name in EXERCISES:
        exercise = load_exercise(name)
        told = [
            exercise.card.question,
            start_of(name),
            *exercise.hints,
            *(each.says for each in exercise.mistakes),
        ]
        told += [text for check in exercise.checks(0) for text in (check.text, check.why)]
        yield from ((f"exercise/{name}", text) for text in told)
    for name, file in DOCUMENTS.items():
        yield name, (ROOT / file).read_text(encoding="utf-8")
    glossary = tomllib.loads((ROOT / "app/html/glossary.toml").read_text(encoding="utf-8"))
    yield from (("glossary", str(entry["means"])) for entry in glossary.values())
    yield from _sources()


def _sources() -> Iterator[tuple[str, str]]:
    """Yields texts of the page and the command line, and the docstrings that the site shows."""
    for top in (*PACKAGES, "app", "examples"):
        for path in sorted((ROOT / top).rglob("*.py")):
            place = path.relative_to(ROOT).as_posix()
            if not place.startswith(("lessons/course/", "lessons/exercises/")):
                yield from ((place, text) for text in _strings(path, place))


def _strings(path: Path, place: str) -> Iterator[str]:
    module = place.removesuffix(".py").replace("/", ".")
    shown = place.startswith("examples/") or (not place.startswith("app/") and not module.startswith(INSIDE))
    tree = ast.parse(path.read_text(encoding="utf-8"))
    notes = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        value = node.value if isinstance(node, ast.Constant) else None
        if isinstance(value, str) and " " in value and (shown or id(node) not in notes):
            yield value
