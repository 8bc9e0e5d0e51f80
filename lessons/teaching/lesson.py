"""A lesson: a card, a scene and ordered steps. A lesson is data that a page shows and a check runs
headless."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from inspect import cleandoc
from typing import Any, Literal

from lessons.events import Event
from lessons.scenes.run_spec import RunSpec
from lessons.settings.settings import SceneSettings
from lessons.teaching.measure import Measure, RunRows, Signal
from lessons.teaching.prediction import Prediction

Relation = Literal["at most", "at least"]
_SIGNS: dict[Relation, str] = {"at most": "≤", "at least": "≥"}


@dataclass(frozen=True)
class Claim:
    """A sentence, the number that decides it, and the bound on that number.

    Attributes:
        text: the sentence, for the learner.
        measure: the number.
        relation: whether the number must be "at most" or "at least" the bound.
        bound: bound on the number, in the unit of the measure.
        fails_with: assignments "PATH=VALUE", in addition to those of the step, under which the sentence is
            false. Goals of a challenge have none: they are not met at its start.
        because: why the sentence is false under these assignments, in a few words.
    """

    text: str
    measure: Measure
    relation: Relation
    bound: float
    fails_with: tuple[str, ...] = ()
    because: str = ""

    def holds(self, value: float) -> bool:
        """Returns whether a measured value fulfils the claim; False for NaN."""
        return holds(value, self.relation, self.bound)

    @property
    def condition(self) -> str:
        """The claim as an inequality, e.g. "≤ 1 mm"."""
        return condition(self.relation, self.bound, self.measure.unit)


def holds(value: float, relation: Relation, bound: float) -> bool:
    """Returns whether a value is at most, or at least, a bound; False for NaN."""
    return value <= bound if relation == "at most" else value >= bound


def condition(relation: Relation, bound: float, unit: str) -> str:
    """Returns the condition as an inequality, e.g. "≤ 1 mm"."""
    return f"{_SIGNS[relation]} {bound:g} {unit}".rstrip()


Script = tuple[tuple[float, Event], ...]
"""A script: (time in s, event) in order. A torque-level scene accepts only the events of `lessons.events`."""


@dataclass(frozen=True)
class Control:
    """A setting that the learner can change in a step.

    Attributes:
        path: as in `lessons.settings.settings.Settings.changed`.
        words: its label.
        low, high: the ends of a slider; for a number only.
        log: the slider is logarithmic; low > 0.
        choices: the values of a menu, which replaces the slider; (False, True) gives a switch.
    """

    path: str
    words: str
    low: float = 0.0
    high: float = 0.0
    log: bool = False
    choices: tuple[Any, ...] = ()

    def __post_init__(self) -> None:
        if not self.choices and not self.low < self.high:
            raise ValueError(f"control '{self.path}' needs choices or low < high")
        if self.log and self.low <= 0:
            raise ValueError(f"control '{self.path}' is logarithmic: low must be above 0")

    def takes(self, value: Any) -> bool:
        """Returns whether the control can be set to a value."""
        if self.choices:
            return value in self.choices
        return isinstance(value, (int, float)) and self.low <= value <= self.high


def chosen(settings: SceneSettings, control: Control) -> Any:
    """Returns the choice of a control that is equal to the present setting; None if no choice is equal to
    it."""
    fitting = (choice for choice in control.choices if settings.changed(control.path, choice) == settings)
    return next(fitting, None)


def within(settings: SceneSettings, control: Control) -> bool:
    """Returns whether the control can set the present value of the setting."""
    if control.choices:
        return chosen(settings, control) is not None
    return control.takes(settings.value_at(control.path))


@dataclass(frozen=True)
class Score:
    """Points for the quality of a solution: 0 at `worst`, 100 at `best` and beyond, linear in between."""

    measure: Measure
    worst: float
    best: float

    def points(self, value: float) -> float:
        """Returns the points, 0 to 100; 0 for NaN."""
        share = (value - self.worst) / (self.best - self.worst)
        return 100.0 * min(1.0, max(0.0, share)) if share == share else 0.0


@dataclass(frozen=True)
class Result:
    """The result of an attempt: which goals are met, and the points (0 unless all goals are met)."""

    met: tuple[bool, ...]
    score: float

    @property
    def passed(self) -> bool:
        """Whether all goals are met."""
        return all(self.met)


@dataclass(frozen=True)
class Challenge:
    """A goal, the settings that may be changed to reach it, and the run that decides.

    Attributes:
        text: description of the goal; Markdown with equations in $…$.
        goals: claims that must all hold at the end of the run.
        knobs: the settings that may be changed; any other change disqualifies the attempt.
        score: the points for the quality of a solution.
        solutions: at least two different sets of assignments "PATH=VALUE" to knobs with which the challenge
            passes. With no assignments it does not pass.
        set: assignments in addition to the lesson's, made before the learner begins.
        duration: s.
        events: the script of the run.
    """

    text: str
    goals: tuple[Claim, ...]
    knobs: tuple[Control, ...]
    score: Score
    solutions: tuple[tuple[str, ...], ...]
    set: tuple[str, ...] = ()
    duration: float = 2.0
    events: Script = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "text", cleandoc(self.text))

    @property
    def measures(self) -> tuple[Measure, ...]:
        """The measures that a run needs."""
        return (*(goal.measure for goal in self.goals), self.score.measure)

    def grade(self, rows: RunRows) -> Result:
        """Evaluates a finished run."""
        return self.result([measure.value(rows) for measure in self.measures])

    def result(self, values: list[float]) -> Result:
        """Evaluates a run from the values of its `measures`, in their order."""
        met = tuple(goal.holds(value) for goal, value in zip(self.goals, values, strict=False))
        return Result(met, self.score.points(values[-1]) if all(met) else 0.0)


Range = tuple[float, float]


@dataclass(frozen=True)
class Note:
    """What allows a sentence: a range in which a number lies, in a run with the cause that the sentence names
    and in a run without it; or the statement that the number or reason is given, or tested elsewhere.

    Attributes:
        label: the name of the note in its file.
        says: the words before the first mark of the note, from the beginning of their sentence.
        measure: the number that the sentence names; None: it is not measured here.
        inside: least and greatest value of the number, in the unit of the measure.
        set: assignments of the run in addition to those of the step.
        ghost: whether the run is that of the step's ghost.
        on: the scene, if the run is not that of the step; then the step's settings and events do not count.
        seconds: the duration, if it is not that of the run.
        without: assignments that remove the cause which the sentence names.
        outside: as `inside`, without the cause. The two ranges are disjoint if the cause has this effect, and
            overlap if the sentence says that it has not.
        statement: what is said instead of a measure: "given: …" or "tested by FILE::NAME".
    """

    label: str
    says: str = ""
    measure: Measure | None = None
    inside: Range = (0.0, 0.0)
    set: tuple[str, ...] = ()
    ghost: bool = False
    on: str = ""
    seconds: float | None = None
    without: tuple[str, ...] = ()
    outside: Range = (0.0, 0.0)
    statement: str = ""

    def runs(self, own: RunSpec | None = None, ghost: tuple[str, ...] = ()) -> tuple[RunSpec, ...]:
        """Returns the run with the cause and, if the note removes the cause, the run without it. A measure
        that compares with the ghost needs the ghost's run, too, which comes last.

        Args:
            own: the run of the step; None: the note names a scene.
            ghost: the settings of the step's ghost.
        """
        base = RunSpec(self.on) if self.on or own is None else own
        if self.seconds is not None:
            base = replace(base, duration=self.seconds)
        if self.ghost:
            base = base.but(*ghost)
        runs = [base.but(*self.set)]
        if self.without:
            runs.append(base.but(*self.set, *self.without))
        if self.measure is not None and self.measure.over_ghost and own is not None:
            runs.append(own.but(*ghost))
        return tuple(runs)


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
