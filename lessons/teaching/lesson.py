"""A lesson: a card, a scene and ordered steps. Pure data that a page shows and a check runs headless."""

from __future__ import annotations

import re
from dataclasses import dataclass
from inspect import cleandoc

from lessons.scenes.run_spec import RunSpec
from lessons.teaching.challenge import Challenge
from lessons.teaching.claim import Claim
from lessons.teaching.control import Control, Script
from lessons.teaching.measure import Signal
from lessons.teaching.prediction import Prediction


@dataclass(frozen=True)
class Card:
    """The card of a lesson: the docstring of its file.

    Attributes:
        title: a few words.
        question: one sentence.
        minutes: how long it takes.
        needs: what one must know before.
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
    found = _CARD.fullmatch((docstring or "").strip())
    if found is None:
        raise ValueError(
            "a lesson's docstring is a title, an empty line, a question in one line, an empty line, "
            f"'Minutes: …' and 'You need: …'; this one is {docstring!r}"
        )
    return Card(found["title"], found["question"], int(found["minutes"]), " ".join(found["needs"].split()))


@dataclass(frozen=True)
class Ghost:
    """A second robot in the same scene: the same events and clock, other settings.

    Attributes:
        words: what it is, for the legend.
        set: assignments on top of the step's.
    """

    words: str
    set: tuple[str, ...]


@dataclass(frozen=True)
class Step:
    """One idea: what to do, what will happen, and why.

    Texts are Markdown with equations in $…$ (LaTeX), numbered as in the paper; their indentation in the file
    does not count.

    Attributes:
        title: a few words.
        text: the idea.
        do: what to do by hand once the scripted run was seen.
        why: shown after the run: why it came out like this.
        claims: what the run shows.
        set: assignments on top of the lesson's.
        events: the script.
        duration: s.
        prediction: asked before the run.
        ghost: a second robot to compare with.
        controls: the few settings that matter here.
        plots: the signals to look at.
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

    def __post_init__(self) -> None:
        for field in ("text", "do", "why"):
            object.__setattr__(self, field, cleandoc(getattr(self, field)))
        if not self.claims:
            raise ValueError(f"step '{self.title}' claims nothing")
        for claim in self.claims:
            if not claim.fails_with or not claim.because:
                raise ValueError(f"claim '{claim.text}' does not say under which setting it fails, and why")
            if claim.measure.over_ghost and self.ghost is None:
                raise ValueError(f"claim '{claim.text}' compares with a ghost and there is none")


@dataclass(frozen=True)
class Lesson:
    """A card, a scene and what happens in it.

    Attributes:
        name: its file's name with dashes.
        card: what it is about.
        scene: name of a scene of `lessons.scenes.catalog.load_scene`.
        steps: in order.
        set: assignments "PATH=VALUE" for all steps.
        challenge: at the end, if there is one.
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
        """The run of a step, or of the start of the challenge."""
        return RunSpec(
            self.scene,
            self.urdf,
            set=(*self.set, *step.set),
            events=step.events,
            duration=step.duration,
        )
