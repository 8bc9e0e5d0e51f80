"""A lesson without a page: the run, the checks of its claims, the prediction, the ghost, the challenge."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from app.link.choice import SceneChoice
from app.link.exercise import Lecture, LessonPlace, SignalCurve
from app.link.messages import Command, Load, LoadRefused, Play, Post, Predict, Ready, ResetAll, RunStep
from app.worker.lecturer import BUCKETS, LessonRows, thinned
from app.worker.simulation import SimulationRunner
from himpc.telemetry import Layout
from lessons.course import COURSE, load_lesson
from lessons.events import MoveTarget, Set
from lessons.replay.state import State, decode, encode, state_of
from lessons.scenes.catalog import load_scene, prepared
from lessons.scenes.run_spec import RunSpec
from lessons.settings.assignments import parse_assignment
from lessons.teaching.check import measured
from lessons.teaching.lesson import Step, chosen
from robots import InputError


class Learner:
    """A simulation that the test advances; `lecture` is the last state of the lesson that it reported."""

    def __init__(self, exercise: LessonPlace) -> None:
        self.body = SimulationRunner(SceneChoice.of_lesson(exercise))
        self.lecture = self.look()

    def look(self) -> Lecture:
        self.lecture = self.body.status().lecture or self.lecture
        return self.lecture

    def does(self, *commands: Command) -> Lecture:
        for command in commands:
            self.body.handle(command)
        return self.look()

    def runs(self, *commands: Command) -> Lecture:
        """Executes commands, then runs until the run of the lesson has ended."""
        self.does(*commands)
        while not self.body.running:
            self.body.settle()
        while self.look().phase != "done":
            self.body.tick()
        return self.lecture


@pytest.fixture
def learn() -> Iterator[Callable[[str, int], Learner]]:
    made: list[Learner] = []

    def start(lesson: str, place: int = 0) -> Learner:
        made.append(Learner(LessonPlace(lesson, place)))
        return made[-1]

    yield start
    for learner in made:
        learner.body.close()


Start = Callable[..., Learner]


def test_a_run_in_the_page_measures_what_the_headless_one_does(learn: Start) -> None:
    """The values are bitwise equal to those of a headless run, including those of the ghost, and the report
    can be pickled."""
    learner = learn("stretched-out", 1)
    lesson = load_lesson("stretched-out")
    step = lesson.steps[1]
    lecture = pickle.loads(pickle.dumps(learner.runs(RunStep(fast=True))))
    run = lesson.run_of(step)
    measures = [claim.measure for claim in step.claims]
    assert step.ghost is not None and {each.over_ghost for each in measures} == {True, False}
    alone = tuple(each.alone for each in measures)
    own = measured((run, alone, ())).values
    ghost = measured((run.but(*step.ghost.set), alone, ())).values
    assert lecture.values == tuple(
        own[each.alone] / ghost[each.alone] if each.over_ghost else own[each.alone] for each in measures
    )
    assert all(lecture.holds) and lecture.changed == "" and lecture.attempt == 1
    assert lecture.t == pytest.approx(step.duration) and len(lecture.curves) == len(step.plots)
    assert len(lecture.ghosts) == len(step.plots)


def test_nothing_moves_before_the_prediction_and_marks_come_while_it_runs(learn: Start) -> None:
    learner = learn("deadlines", 2)
    step = load_lesson("deadlines").steps[2]
    assert learner.lecture.phase == "waiting" and not learner.body.running
    assert learner.lecture.holds == (None,) * len(step.claims)
    learner.does(RunStep())
    learner.does(Play(True))
    learner.body.settle()
    assert not learner.body.running and learner.body.ticks == 0
    learner.does(Predict(1), RunStep())
    while not learner.body.running:
        learner.body.settle()
    assert learner.body.pace == 1.0
    learner.body.tick(600)
    for _ in range(5):  # the claims are checked at every fifth report
        learner.look()
    assert learner.lecture.phase == "running" and 0.5 < learner.lecture.t < 0.7
    assert None not in learner.lecture.holds and learner.lecture.grade is None
    while learner.look().phase == "running":
        learner.body.tick(20)
    lecture = learner.lecture
    assert lecture.grade is not None and lecture.grade.score in (0.0, 1.0) and math.isfinite(lecture.truth)
    assert learner.body.running  # the robot keeps running after the lesson's run
    learner.body.tick(50)
    assert learner.look() is lecture  # the measured values do not change


def test_a_run_of_ones_own_is_called_that_and_leaves_the_prediction_alone(learn: Start) -> None:
    learner = learn("one-task", 3)
    first = learner.runs(Predict(0), RunStep(fast=True))
    assert first.changed == "" and learner.body.pace == 1.0
    own = learner.runs(Post(Set("damping", True)), RunStep(own=False, fast=True))
    assert "settings" in own.changed and own.attempt == 2 and own.values != first.values
    assert own.truth == first.truth and own.grade == first.grade
    again = learner.runs(RunStep(own=True, fast=True))
    assert again.changed == "" and again.values == first.values
    learner.does(RunStep())
    learner.body.tick(100)
    learner.does(Post(MoveTarget("position", (0.4, 0.2))))
    assert "moved" in learner.runs().changed
    fresh = learner.does(ResetAll())
    assert fresh.phase == "waiting" and fresh.answer is None and fresh.attempt == 0


def test_a_robot_that_is_lost_ends_the_run_as_headless(learn: Start) -> None:
    learner, lesson = learn("when-tasks-fight", 0), load_lesson("when-tasks-fight")
    step = lesson.steps[0]
    lecture = learner.runs(Predict(0), RunStep(fast=True))
    measures = tuple(claim.measure for claim in step.claims)
    values = measured((lesson.run_of(step), measures, ())).values
    assert lecture.values == tuple(values[each] for each in measures)
    assert lecture.lost_at is not None and 1.0 < lecture.lost_at < step.duration
    assert lecture.phase == "done" and lecture.t < step.duration
    assert not learner.body.running  # the simulation of a robot that lost control is stopped


def test_what_is_refused_leaves_everything_as_it_was(learn: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    """If a new scene or step is refused, at any point of its loading, the present scene, run and lesson
    continue unchanged."""
    learner = learn("deadlines", 1)
    body = learner.body
    learner.does(Predict(2.0))
    before = (body.choice, body.scene, body.run, body.lecturer, body.block, body.running, body.speed)
    for name, place in (("deadlines", 2), ("one-task", 0)):
        choice = SceneChoice.of_lesson(LessonPlace(name, place))
        with monkeypatch.context() as patch:
            patch.setattr("app.worker.simulation.Lecturer", refuse)
            answer = body.handle(Load(choice))
        assert isinstance(answer, LoadRefused) and answer.sentence == "no lecturer here"
        mine = body.handle(Load(replace(choice, mine=("horizon",))))
        assert isinstance(mine, LoadRefused) and "horizon" in mine.sentence
        after = (body.choice, body.scene, body.run, body.lecturer, body.block, body.running, body.speed)
        assert all(a is b for a, b in zip(after, before, strict=True))
    assert learner.look().answer == 2.0
    assert learner.runs(RunStep(fast=True)).phase == "done"


def refuse(*_: object) -> None:
    raise InputError("no lecturer here")


def test_steps_of_a_lesson_follow_without_building_anything_anew(learn: Start) -> None:
    learner = learn("a-redundant-arm", 0)
    block = learner.body.block
    assert learner.body.handle(Load(SceneChoice.of_lesson(LessonPlace("a-redundant-arm", 2)))) is None
    assert learner.body.block is block
    lecture = learner.look()
    assert lecture.exercise.place == 2 and lecture.phase == "waiting"
    assert not learner.body.session.settings.levels[1].enabled  # the settings of this step
    other = learner.body.handle(Load(SceneChoice.of_lesson(LessonPlace("one-task"))))
    assert isinstance(other, Ready)


def test_a_code_opens_the_step_with_the_settings_somebody_made() -> None:
    """The settings in a code count as the learner's changes: they are in effect until the step's own run, and
    a challenge counts them."""
    lesson = load_lesson("deadlines")
    challenge, last = lesson.challenge, len(lesson.steps) + 1
    assert challenge is not None
    run = lesson.run_of(challenge)
    solved = prepared(load_scene(run.scene, run.urdf), None, (*run.set, *challenge.solutions[0]))
    code = encode(state_of(replace(run, seed=3), solved.settings, lesson="deadlines", step=last))
    choice = SceneChoice.of_state(decode(code))
    assert choice.exercise == LessonPlace("deadlines", last - 1) and choice.run.seed == 3
    body = SimulationRunner(choice)
    assert body.session.settings == solved.settings and not body.running
    body.handle(RunStep(fast=True))
    while not body.running:
        body.settle()
    while body.running and body.session.t < challenge.duration + 0.01:
        body.tick()
    lecture = body.status().lecture
    assert lecture is not None and lecture.result is not None and lecture.result.passed
    body.handle(ResetAll())
    assert body.session.settings == run.prepared().settings
    body.close()


@pytest.mark.parametrize(
    ("state", "says"),
    [
        (State(RunSpec("planar3-circle"), lesson="deadlines", step=99), "no step 99: choose one from 1 to"),
        (State(RunSpec("iiwa14-hold"), lesson="first-hold-then-reach", step=1), "another scene"),
    ],
)
def test_a_code_of_a_step_that_is_not_there_is_refused(state: State, says: str) -> None:
    with pytest.raises(InputError, match=says):
        SceneChoice.of_state(state)


def test_a_challenge_is_graded_and_cannot_be_cheated(learn: Start) -> None:
    name = "deadlines"
    lesson = load_lesson(name)
    challenge = lesson.challenge
    assert challenge is not None
    learner = learn(name, len(lesson.steps))
    start = learner.runs(RunStep(fast=True))
    assert start.result is not None and not start.result.passed
    knobs = [Post(Set(*parse_assignment(each))) for each in challenge.solutions[0]]
    good = learner.runs(*knobs, RunStep(fast=True))
    assert good.result is not None and good.result.passed and good.result.score > 0 and not good.changed
    run = lesson.run_of(challenge).but(*challenge.solutions[0])
    assert good.points_for == measured((run, (challenge.score.measure,), ())).values[challenge.score.measure]
    cheat = learner.runs(Post(Set("plant.payload_kg", 0.1)), RunStep(fast=True))
    assert cheat.result is not None and "does not belong to this challenge" in cheat.changed


@pytest.mark.parametrize("name", COURSE)
def test_every_control_reads_what_it_sets(name: str) -> None:
    lesson = load_lesson(name)
    for part in (*lesson.steps, *([lesson.challenge] if lesson.challenge else [])):
        settings = lesson.run_of(part).prepared().settings
        for control in part.controls if isinstance(part, Step) else part.knobs:
            for choice in control.choices:
                assert chosen(settings.changed(control.path, choice), control) == choice
            for end in () if control.choices else (control.low, control.high):
                value = int(end) if type(settings.value_at(control.path)) is int else end
                assert settings.changed(control.path, value).value_at(control.path) == value


def test_what_a_script_changes_is_undone_before_the_next_run(learn: Start) -> None:
    """Otherwise a challenge whose script adds a load would start its second run with this load."""
    challenge = load_lesson("no-model-needed").challenge
    assert challenge is not None and any(isinstance(event, Set) for _, event in challenge.events)
    learner = learn("no-model-needed", len(load_lesson("no-model-needed").steps))
    first = learner.runs(RunStep(fast=True))
    assert learner.body.session.settings != learner.body.scene.settings
    second = learner.runs(RunStep(fast=True))
    assert second.values == first.values and second.changed == first.changed == ""


def test_an_unknown_lesson_is_one_sentence() -> None:
    with pytest.raises(InputError, match="deadlines"):
        SceneChoice.of_lesson(LessonPlace("deadline"))


def test_thinning_keeps_every_spike() -> None:
    t = np.linspace(0.0, 1.0, 5000)
    values = np.sin(9 * t)
    values[777], values[3210], values[:40] = 50.0, -50.0, np.nan
    curve = SignalCurve(*thinned(t, values))
    assert len(curve.t) <= 2 * BUCKETS + 2 and 50.0 in curve.values and -50.0 in curve.values
    assert (np.diff(curve.t) >= 0).all()


def test_a_record_grows_and_can_be_cut() -> None:
    layout = Layout(2, {"t": slice(0, 1), "x": slice(1, 2)}, (), (), ())
    record = LessonRows(layout, 3)
    for k in range(10):
        record.add(np.array([0.1 * k, k]))
    assert record["x"][:, 0].tolist() == list(range(10))
    assert record.until(0.35)["x"][:, 0].tolist() == [0, 1, 2, 3]
