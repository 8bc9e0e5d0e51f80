"""A lesson: a card, a scene and ordered steps. A lesson is data that a page shows and a check runs
headless."""

from __future__ import annotations

import re
from dataclasses import dataclass
from inspect import cleandoc

from lessons.scenes.run_spec import RunSpec
from lessons.teaching.challenge import Challenge
from lessons.teaching.claim import Claim
from lessons.teaching.control import Control, Script
from lessons.teaching.measure import Signal
from lessons.teaching.note import Note
from lessons.teaching.prediction import Prediction


@dataclass(frozen=True)
class Card:
    """The card of a lesson: the docstring of its file.

    Attributes:
        title: a few words.
        question: one sentence.
        minutes: duration.
        needs: required knowledge.
    """

    title: str
    question: str
    minutes: int
    needs: str


_CARD = re.compile(
    r"(?P<title>[^\n]+)\n\n(?P<question>[^\n]+\?)\n\nMinutes: (?P<minutes>\d+)\nYou need: (?P<needs>.+)", re.S
)


def card_of(docstring: str | None) -> Card:
    """Reads the card from a lesson file's docstring: title, question, `Minutes: …`, `You need: …`.

    Raises:
        ValueError: something is missing.
    """
    match = _CARD.fullmatch((docstring or "").strip())
    if match is None:
        raise ValueError(
            "a lesson's docstring is a title, an empty line, a question in one line, an empty line, "
            f"'Minutes: …' and 'You need: …'; this one is {docstring!r}"
        )
    return Card(match["title"], match["question"], int(match["minutes"]), " ".join(match["needs"].split()))


@dataclass(frozen=True)
class Ghost:
    """A second robot in the same scene: the same events and clock, other settings.

    Attributes:
        words: name of the ghost in the legend.
        set: assignments in addition to those of the step.
    """

    words: str
    set: tuple[str, ...]


@dataclass(frozen=True)
class Step:
    """One step: an idea, a run, its claims and an explanation.

    Texts are Markdown with equations in $…$ (LaTeX), numbered as in the paper; their indentation in the file
    does not count.

    Attributes:
        title: a few words.
        text: the idea.
        do: a task for the learner after the scripted run.
        why: explanation of the result, shown after the run.
        claims: statements about the run.
        set: assignments in addition to those of the lesson.
        events: the script.
        duration: s.
        prediction: question that is asked before the run.
        ghost: a second robot to compare with.
        controls: the few settings that the learner can change.
        plots: the signals that are plotted.
        notes: what allows the sentences, for the check; learners do not see them.
    """

    title: str
    text: str
    do: str
    why: str
    claims: tuple[Claim, ...]
    set: tuple[str, ...] = ()
    events: Script = ()
    duration: float = 2.0
    prediction: Prediction | None = None
    ghost: Ghost | None = None
    controls: tuple[Control, ...] = ()
    plots: tuple[Signal, ...] = ()
    notes: tuple[Note, ...] = ()

    def __post_init__(self) -> None:
        for field in ("text", "do", "why"):
            object.__setattr__(self, field, cleandoc(getattr(self, field)))
        if not self.claims:
            raise ValueError(f"step '{self.title}' has no claims: give at least one")
        for claim in self.claims:
            if not claim.fails_with or not claim.because:
                raise ValueError(f"claim '{claim.text}': fails_with=… is missing or not explained")
            if claim.measure.over_ghost and self.ghost is None:
                raise ValueError(f"claim '{claim.text}' compares with a ghost: give the step one")


@dataclass(frozen=True)
class Lesson:
    """A card, a scene and the steps in this scene.

    Attributes:
        name: name of the file, with dashes.
        card: title, question, duration and required knowledge.
        scene: name of a scene of `lessons.scenes.catalog.load_scene`.
        steps: in order.
        set: assignments "PATH=VALUE" for all steps.
        challenge: challenge at the end of the lesson, if there is one.
        urdf: the robot, for the scene "hold".
    """

    name: str
    card: Card
    scene: str
    steps: tuple[Step, ...]
    set: tuple[str, ...] = ()
    challenge: Challenge | None = None
    urdf: str | None = None

    def run_of(self, step: Step | Challenge) -> RunSpec:
        """Returns the run of a step, or of the start of the challenge."""
        return RunSpec(
            self.scene,
            self.urdf,
            set=(*self.set, *step.set),
            events=step.events,
            duration=step.duration,
        )
