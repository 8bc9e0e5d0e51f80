"""Finds the sentences that give a reason and the numbers in explanations, and reads the notes of documents.

A lesson has its notes beside its sentences. `evidence_of_documents.md` has those of the other texts that
users read.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from docs.further import further
from lessons.course import COURSE, lesson_file, load_lesson
from lessons.exercises import EXERCISES, load_exercise, start_of
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import Lesson, Note, Step
from lessons.teaching.reader import read_lesson, read_note

ROOT = Path(__file__).parents[2]
_IN_DOCS = (
    "authoring",
    "disagreements",
    "export",
    "house",
    "instructors",
    "results",
    "serving",
    "settings",
    "starting",
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

MARK = "¶"
"""Stands for a mark of a note in a text."""
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
_WORDS = "half|third|quarter|fifth|tenth|thousand|million|doubles|halves"
_NUMBER = re.compile(rf"(?<![\w.−-])−?\d+(?:\.\d+)?(?!/s)|\b(?:{_WORDS})\b|{MARK}")
"""Digits, and words that denote numbers; marks of notes."""
_NAME = re.compile(
    r"\(\d+\w?\)|(?:[Ll]evels?|[Jj]oints?|links|Remark|Part|Table|Theorem|Lemma|task|disc) "
    r"[\dIVX]+(?: and \d)?"
)


class Told(NamedTuple):
    """A sentence of a document or a part of it, and a note that allows it.

    at: name of a document of `DOCUMENTS`, "glossary", or "further/LESSON" for the page of a lesson.
    run: the run of the lesson's step with which the line of the note begins, if it names one.
    """

    at: str
    says: str
    note: Note
    run: RunSpec | None


@cache
def documents() -> tuple[Told, ...]:
    """Returns the notes of `evidence_of_documents.md`."""
    path = Path(__file__).with_name("evidence_of_documents.md")
    text = path.read_text(encoding="utf-8")
    found, at, says = [], "", ""
    for match in re.finditer(r"^(## |- |  - )(.*(?:\n +[^-\s].*)*)", text, re.MULTILINE):
        line, words = text.count("\n", 0, match.start()) + 1, " ".join(match[2].split())
        if match[1] == "## ":
            at = words
        elif match[1] == "- ":
            says = words
        else:
            step = re.match(r"([\w-]+) step (\d+): ", words)
            lesson = load_lesson(step[1]) if step else None
            run = lesson.run_of(lesson.steps[int(step[2]) - 1]) if step and lesson else None
            found.append(Told(at, says, read_note(path.name, line, words[step.end() if step else 0 :]), run))
    return tuple(found)


@cache
def marked(name: str) -> Lesson:
    """Returns a lesson of the course with the marks of its notes in its texts."""
    path = lesson_file(name)
    return read_lesson(name, str(path), path.read_text(encoding="utf-8"), marks=True)


def with_marks(text: str) -> str:
    """Returns a text in which `MARK` stands for each mark of a note, in front of the end of a sentence."""
    return re.sub(rf"([.!?…,;:]+)({MARK}+)", r"\2\1", re.sub(r"\[\^[\w-]+\]", MARK, text))


def unmarked_numbers(text: str) -> list[str]:
    """Returns the numbers after which no mark stands before the next number or the end of the sentence.
    Equations, names such as *level 1*, and numbers of equations are not numbers here."""
    found = []
    for sentence in sentences(re.sub(r"\$\$?.+?\$\$?", "§", with_marks(text), flags=re.DOTALL)):
        tokens = [*_NUMBER.findall(_NAME.sub("§", sentence)), ""]
        found += [one for one, following in pairwise(tokens) if MARK not in (one, following)]
    return found


def unmarked_reasons(text: str) -> list[str]:
    """Returns the sentences that give a reason and have no mark."""
    return [each for each in causal(with_marks(text)) if MARK not in each]


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
    """Yields (place, text) of all texts that users read, except for lessons and sources. The place is written
    as in `Told.at`, or as "exercise/name"."""
    for name in COURSE:
        more = further(name)
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
