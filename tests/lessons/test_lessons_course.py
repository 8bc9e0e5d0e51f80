"""In the course, every card is complete, every number on it is measured, and every claim can fail."""

from __future__ import annotations

import math
import pickle
import re
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from course_runs import CourseRuns
from latex2mathml.converter import convert

from himpc.telemetry import layout_of, velocity_layout_of
from lessons.course import COURSE, load_lesson
from lessons.events import MoveTarget, Push, Set
from lessons.parallel import one_by_one
from lessons.scenes.run_spec import RunSpec
from lessons.scenes.scene import Scene, TorqueScene
from lessons.settings.assignments import parse_assignment
from lessons.teaching.check import Verdict, check, measured
from lessons.teaching.lesson import Card, Challenge, Claim, Control, Ghost, Lesson, Note, Score, Step, card_of
from lessons.teaching.measure import DERIVED, Measure, Signal
from lessons.teaching.prediction import Choice, Option, Sketch, Value
from robots import InputError

HAND = Signal("error/position", "mm")


CLAIMED = ("one-task", "how-far-ahead", "how-strict-is-strict")
"""Lessons whose claims are judged at every push: about the planar arm, the iiwa, and a mobile base. All runs
of the course take a core three minutes."""
RUNS = (
    "himpc/",
    "lessons/scenes",
    "lessons/session",
    "lessons/settings",
    "lessons/teaching",
    "robots/plant.py",
)
"""What a run of any lesson depends on."""


@pytest.mark.parametrize(
    "name",
    [
        name
        if name in CLAIMED
        else pytest.param(name, marks=pytest.mark.nightly(f"lessons/course/{name}.", *RUNS))
        for name in COURSE
    ],
)
def test_everything_a_lesson_claims_is_so(name: str, course_runs: CourseRuns) -> None:
    """Claims hold, and fail with their wrong setting; answers are measured; challenges can be solved."""
    own = [each for each in course_runs.verdicts if each.lesson == name and not is_of_a_note(each)]
    assert sum(bool(each.wrong) for each in own) == sum(len(step.claims) for step in load_lesson(name).steps)
    assert faults_of(own) == []


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.nightly(f"lessons/course/{name}.")) for name in COURSE]
)
def test_the_notes_of_a_lesson_are_so(name: str, course_runs: CourseRuns) -> None:
    """The number of each note lies in its range, and without its cause in the other range."""
    own = [each for each in course_runs.verdicts if each.lesson == name and is_of_a_note(each)]
    notes = [note for step in load_lesson(name).steps for note in step.notes if note.measure is not None]
    assert len(own) == len(notes)
    assert sum(bool(each.wrong) for each in own) == sum(bool(note.without) for note in notes)
    assert faults_of(own) == []


def is_of_a_note(verdict: Verdict) -> bool:
    return verdict.what.startswith("[^")


def faults_of(verdicts: Iterable[Verdict]) -> list[str]:
    return [f"{each.where}: {each.what}: {each.fault}" for each in verdicts if each.fault]


def texts(lesson: Lesson) -> Iterator[str]:
    for step in lesson.steps:
        yield from (step.text, step.do, step.why)
        yield from (claim.text for claim in step.claims)
    if lesson.challenge is not None:
        yield lesson.challenge.text


def fields_of(scene: Scene) -> dict[str, slice]:
    """Returns the telemetry fields of a scene."""
    if isinstance(scene, TorqueScene):
        return layout_of(scene.robot, scene.settings.levels).fields
    return velocity_layout_of(scene.robot, scene.settings.levels).fields


@pytest.mark.parametrize("name", COURSE)
def test_a_card_is_complete(name: str) -> None:
    """A card has a name, a question, a duration, the prerequisites, and two to five steps with one idea
    each."""
    lesson = load_lesson(name)
    assert lesson.name == name
    assert lesson.card.question.endswith("?")
    assert 5 <= lesson.card.minutes <= 20
    assert lesson.card.needs
    assert 2 <= len(lesson.steps) <= 5
    assert any(step.prediction is not None for step in lesson.steps)
    assert all(step.text and step.do and step.why and step.plots for step in lesson.steps)
    earlier = COURSE[: COURSE.index(name)]
    assert all(word in earlier for word in re.findall(r'lesson "([^"]+)"', lesson.card.needs))


@pytest.mark.parametrize("name", COURSE)
def test_equations_can_be_rendered(name: str) -> None:
    """Dollar signs come in pairs, and the text between them is LaTeX."""
    for text in texts(load_lesson(name)):
        assert text.count("$") % 2 == 0, text
        for display, inline in re.findall(r"\$\$(.+?)\$\$|\$(.+?)\$", text, re.DOTALL):
            assert "<math" in convert(display or inline)
        # If a backslash is missing in a Python string, \t and \b become control characters.
        assert not re.search(r"[\x00-\x09\x0b-\x1f]", text), text


@pytest.mark.parametrize("name", COURSE)
def test_no_text_is_shown_as_code(name: str) -> None:
    """Markdown interprets an indented paragraph as code, and would not render an equation in it."""
    for step in load_lesson(name).steps:
        for text in (step.text, step.do, step.why):
            assert not any(line.startswith(" ") or "  " in line for line in text.splitlines())


@pytest.mark.parametrize("name", COURSE)
def test_controls_and_plots_exist_in_the_scene(name: str) -> None:
    """The path of each control is a setting, and the control can show its value; each signal is recorded."""
    lesson = load_lesson(name)
    for step in lesson.steps:
        scene = lesson.run_of(step).prepared()
        fields = fields_of(scene)
        assert all(signal.name in fields or signal.name in DERIVED for signal in step.plots)
        for control in step.controls:
            assert_takes(scene, control)
    if lesson.challenge is not None:
        for knob in lesson.challenge.knobs:
            assert_takes(lesson.run_of(lesson.challenge).prepared(), knob)
        assert len(set(lesson.challenge.solutions)) >= 2


def assert_takes(scene: Scene, control: Control) -> None:
    assert scene.settings.setting(control.path).read(scene.settings) is not None
    for value in control.choices or (control.low, control.high):
        assert control.takes(value)
        scene.settings.changed(control.path, value)


def test_lessons_can_be_sent_to_another_process() -> None:
    """Runs and measures are plain data: they are equal after pickling, and can be used as keys."""
    for name in COURSE:
        lesson = load_lesson(name)
        runs = {lesson.run_of(step): step.claims[0].measure for step in lesson.steps}
        assert pickle.loads(pickle.dumps(runs)) == runs


def test_an_unknown_lesson_is_answered_with_the_nearest() -> None:
    with pytest.raises(InputError, match="did you mean 'stretched-out'"):
        load_lesson("streched-out")


def test_cards_are_read_from_the_docstring() -> None:
    card = card_of("Title\n\nWhat is it?\n\nMinutes: 7\nYou need: one thing,\nand another\n")
    assert card == Card("Title", "What is it?", 7, "one thing, and another")
    for broken in (
        "Title\n\nWhat is it?\n\nMinutes: 7\n",
        "Title\n\nNo question.\n\nMinutes: 7\nYou need: x",
        None,
    ):
        with pytest.raises(ValueError, match="docstring"):
            card_of(broken)


def lesson_with(step: Step, challenge: Challenge | None = None) -> Lesson:
    return Lesson("probe", Card("t", "q?", 5, "n"), "planar3-hold", (step,), challenge=challenge)


MOVE = ((0.0, MoveTarget("position", (0.6, 0.2))),)


def aside(claim: Claim, **changes: object) -> Step:
    """Returns a step of 0.2 s in which the planar arm's hand moves towards a target 10 cm away."""
    return Step("s", "t", "d", "w", (claim,), **{"events": MOVE, "duration": 0.2, **changes})  # pyright: ignore[reportArgumentType]


OFF = ("levels.position.enabled=false",)
SMALL = Claim("The hand follows.", Measure(HAND), "at most", 2.0, OFF, "nobody asks")


FAR = Note("a", "The hand follows", Measure(HAND), (0.5, 1.0), without=OFF, outside=(30.0, 31.0))


def faults(lesson: Lesson) -> list[str]:
    return [verdict.fault for verdict in check([lesson], one_by_one) if verdict.fault]


def test_a_sound_lesson_has_no_faults() -> None:
    over = replace(FAR, measure=Measure(HAND, over_ghost=True), inside=(0.02, 0.03), without=())
    told = Note("b", statement="given: a setting")
    assert not faults(lesson_with(aside(SMALL, notes=(FAR, over, told), ghost=Ghost("g", OFF))))


def test_notes_are_measured_until_the_end_and_claims_until_control_is_lost() -> None:
    time = Measure(Signal("t", "s"))
    wild = (
        "M_bar_scale=20",
        "R=0.01",
        "limits.velocity=false",
        "limits.torque=false",
        "plant.saturate=false",
    )
    push = (0.01, Push("link_4", (0.0, 20.0, 0.0)))
    outcome = measured((RunSpec("iiwa14-hold", set=wild, events=(push,), duration=1.0), (time,), (time,)))
    assert outcome.values[time] < 0.9 < outcome.noted[time]


@pytest.mark.parametrize(
    ("step", "fault"),
    [
        (aside(replace(SMALL, bound=1e-3)), "it is false"),
        (aside(replace(SMALL, bound=1e3)), "it holds with levels.position.enabled=false too"),
        (aside(replace(SMALL, fails_with=("levels.nothing.Q=1",))), "its wrong setting cannot be run"),
        (aside(replace(SMALL, measure=Measure(HAND, after=5.0))), "it is false"),
        (aside(SMALL, events=(*MOVE, (0.0, Set("horizon", 0)))), "1 of its events are not accepted"),
        (
            aside(
                SMALL, prediction=Choice("?", (Option("a", high=9.0), Option("b", low=9.0)), Measure(HAND), 0)
            ),
            "the tempting option is the right one",
        ),
        (
            aside(
                SMALL, prediction=Choice("?", (Option("a", low=9.0), Option("b", low=99.0)), Measure(HAND), 0)
            ),
            "0 of its options fit",
        ),
        (aside(SMALL, prediction=Value("?", Measure(HAND), 50.0, 60.0)), "is off its scale"),
        (aside(SMALL, prediction=Sketch("?", HAND, 0.0, 0.1, 0.2)), "is off its scale"),
        (aside(SMALL, notes=(Note("a", "so far", Measure(HAND), (50.0, 60.0)),)), "mm, not from 50 to 60 mm"),
        (aside(SMALL, notes=(replace(FAR, outside=(5.0, 6.0)),)), "30.65 mm, not from 5 to 6 mm"),
        (aside(SMALL, notes=(replace(FAR, set=("levels.nothing.Q=1",)),)), "it cannot be run"),
        (aside(SMALL, notes=(replace(FAR, measure=Measure(HAND, after=5.0)),)), "nothing to measure"),
    ],
    ids=[
        "false",
        "cannot fail",
        "wrong path",
        "no data",
        "refused event",
        "not tempting",
        "no option",
        "off scale",
        "off the drawing",
        "number of a note",
        "cause of a note",
        "run of a note",
        "no data for a note",
    ],
)
def test_the_check_finds(step: Step, fault: str) -> None:
    """Each fault of a lesson is reported with a sentence of its own."""
    (found,) = faults(lesson_with(step))
    assert fault in found


def test_the_check_judges_challenges() -> None:
    """The check finds a challenge that passes at its start, a solution that does not pass, and a solution
    that changes a setting which is not among the knobs."""
    goal = Claim("Close.", Measure(HAND), "at most", 1e-3)
    knob = Control("horizon", "N", 1, 10)
    challenge = Challenge("?", (goal,), (knob,), Score(Measure(HAND), 1.0, 0.0), (("horizon=1",), OFF))
    challenge = replace(challenge, duration=0.2, events=MOVE)
    assert faults(lesson_with(aside(SMALL), challenge)) == [
        "it does not pass: Close.",
        "levels.position.enabled=false is not one of its knobs, or is outside the knob's range",
    ]
    easy = replace(challenge, goals=(replace(goal, bound=1e3),), solutions=(("horizon=1",), ("horizon=2",)))
    assert faults(lesson_with(aside(SMALL), easy)) == ["it passes with its first settings"]


def test_claims_are_judged_on_a_run_half_done() -> None:
    """Before the window begins there is no value; later the claim is true or false; NaN is never true."""
    rows = {"t": np.arange(10.0)[:, None] / 10, "error/position": np.arange(10.0)[:, None] * 1e-3}
    late = Claim("…", Measure(HAND, after=0.5), "at most", 7.0)
    assert math.isnan(late.measure.value({name: field[:4] for name, field in rows.items()}))
    assert late.holds(late.measure.value({name: field[:8] for name, field in rows.items()}))
    assert not late.holds(late.measure.value(rows))
    assert not late.holds(math.nan)


@pytest.mark.parametrize(
    ("statistic", "value"),
    [
        ("largest", 4.0),
        ("rms", math.sqrt(10.0)),
        ("mean", -2.0),
        ("range", 4.0),
        ("last", 0.0),
        ("sum", -6.0),
    ],
)
def test_statistics(statistic: str, value: float) -> None:
    """The values are 1, −2, −4, 0, NaN; the first is before the window, and NaN is ignored."""
    rows = {"t": np.arange(5.0)[:, None], "v": np.array([[1.0], [-2.0], [-4.0], [0.0], [np.nan]])}
    measure = Measure(Signal("v"), statistic, after=1.0)  # pyright: ignore[reportArgumentType]
    assert measure.value(rows) == pytest.approx({"rms": math.sqrt(20 / 3)}.get(statistic, value))


@pytest.mark.parametrize(("T_s", "ticks"), [(0.001, 50), (0.002, 25), (0.1, 1)])
def test_the_end_of_a_run_lasts_50_ms_at_every_rate(T_s: float, ticks: int) -> None:
    v = np.arange(400.0)
    rows = {"t": np.cumsum(np.full(400, T_s))[:, None], "v": v[:, None]}
    assert Measure(Signal("v"), "last").value(rows) == v[-ticks:].mean()


def test_a_measure_over_the_ghost_is_a_ratio() -> None:
    t = np.arange(3.0)[:, None]
    own, ghost = {"t": t, "v": np.full((3, 2), 3.0)}, {"t": t, "v": np.full((3, 2), 6.0)}
    ratio = Measure(Signal("v"), over_ghost=True)
    assert ratio.value(own, ghost) == pytest.approx(0.5)
    assert math.isnan(ratio.value(own))
    assert ratio.unit == "×"


def test_signals_of_missions() -> None:
    """The path length of the base is the sum along its path; the time at work is constant after the last
    task."""
    x = np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 4.0], [3.0, 3.0]])
    rows = {"t": np.arange(4.0)[:, None], "x/base": x, "left": np.array([[2.0], [1.0], [0.0], [0.0]])}
    way = Signal("way of the base", "m")
    assert way.over(rows).tolist() == [0.0, 5.0, 5.0, 6.0]
    assert Measure(way, "range", after=1.0, until=3.0).value(rows) == 0.0
    assert Measure(Signal("time at work", "s")).value(rows) == 1.0
    nothing = {name: field[:0] for name, field in rows.items()}
    assert math.isnan(Measure(way).value(nothing))


def test_predictions_are_graded_against_the_run() -> None:
    t = np.linspace(0.0, 1.0, 101)[:, None]
    rows = {"t": t, "error/position": 1e-3 * t}
    options = (Option("small", high=0.5), Option("large", low=0.5))
    choice = Choice("?", options, Measure(HAND), tempting=0)
    assert (choice.grade(0, rows).score, choice.grade(1, rows).score) == (0.0, 1.0)
    assert "1 mm" in choice.grade(0, rows).words
    value = Value("?", Measure(HAND), 0.1, 10.0, factor=2.0)
    assert [value.grade(guess, rows).score for guess in (1.0, 1.9, 4.1, 0.1)] == pytest.approx([1, 1, 0, 0])
    assert 0.0 < value.grade(3.0, rows).score < 1.0
    sketch = Sketch("?", HAND, 0.0, 1.0, 1.0, band=0.1)
    assert sketch.grade([(0.0, 0.0), (1.0, 1.0)], rows).score == 1.0
    assert sketch.grade([(0.0, 0.5), (1.0, 0.5)], rows).score == pytest.approx(0.2, abs=0.02)


def test_a_step_must_say_where_its_claims_fail() -> None:
    with pytest.raises(ValueError, match="fails"):
        aside(replace(SMALL, fails_with=()))
    with pytest.raises(ValueError, match="ghost"):
        aside(replace(SMALL, measure=Measure(HAND, over_ghost=True)))
    assert (
        aside(replace(SMALL, measure=Measure(HAND, over_ghost=True)), ghost=Ghost("g", OFF)).ghost is not None
    )


def test_solutions_use_knobs_only() -> None:
    for name in COURSE:
        challenge = load_lesson(name).challenge
        if challenge is not None:
            for assignments in challenge.solutions:
                turned = {parse_assignment(each)[0] for each in assignments}
                assert turned <= {knob.path for knob in challenge.knobs}
