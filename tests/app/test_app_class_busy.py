"""A class on a machine that is too slow for all its robots: pages are answered, and robots are built a few at
a time."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from served import LONG, served

from app.classes.hall import PATIENCE, BuildQueue, Hall
from app.client import simulation_client
from app.client.simulation_client import BEHIND, Rest, SimulationClient
from app.link.choice import SceneChoice
from app.link.exercise import Lecture, LessonPlace
from app.link.messages import Play, Post, Ready
from app.web.server import PageServer
from app.worker.simulation import SimulationRunner
from browsing.wire import Wire, eventually
from lessons.events import Reset
from lessons.replay.progress import read_handed_in
from lessons.scenes.run_spec import RunSpec


@pytest.fixture
def server() -> Iterator[PageServer]:
    with served(class_names=True) as running:
        yield running


def test_pages_do_not_wait_for_robots(server: PageServer, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a class, robots have a lower priority than pages. A page shows the text to hand in, and the server
    knows a learner's state, also while the robot gets no processor time."""
    hall = server.hall
    assert hall is not None
    given: list[tuple[int, int]] = []  # others may change the priorities themselves on this machine
    monkeypatch.setattr(os, "getpriority", lambda *_: 3)
    monkeypatch.setattr(os, "setpriority", lambda _, pid, priority: given.append((pid, priority)))
    with Wire(server.guest_link) as page:
        assert eventually(lambda: bool(server.sessions.learners), 60.0)
        learner = server.sessions.learners[0]
        assert eventually(lambda: learner.pid is not None, LONG)
        pid = learner.pid
        assert pid is not None and eventually(lambda: page.find("Write the text") is not None, LONG)
        assert eventually(lambda: bool(given), LONG) and given == [(pid, 3 + BEHIND)]
        os.kill(pid, signal.SIGSTOP)
        try:
            assert hall.code_of(learner.token).startswith("hl1-")
            page.use("Write the text")
            assert eventually(lambda: text_of(page).startswith("hp1"), LONG)
            assert read_handed_in(text_of(page), None)[0].code.startswith("hl1-")
        finally:
            os.kill(pid, signal.SIGCONT)


def test_a_page_shows_the_next_step_before_its_robot_is_there() -> None:
    """While the robot gets no processor time, the class continues: its page shows the next step and stores
    the prediction, which the robot gets when it loads the step."""
    here, there = (LessonPlace("a-redundant-arm", place) for place in (0, 1))
    first, second = (f"Next: {each.title}" for each in here.whole.steps[1:3])
    with served(SceneChoice.opening(here.lesson), class_names=False) as server:
        assert server.hall is not None
        with Wire(server.guest_link) as page:
            assert eventually(lambda: page.find(first) is not None, LONG)
            (learner,) = server.sessions.learners
            pid = learner.pid
            assert pid is not None
            os.kill(pid, signal.SIGSTOP)
            try:
                assert eventually(lambda: learner.trouble() is not None, LONG), (
                    "it is silent, as in a busy class"
                )
                server.hall.go(there)
                assert eventually(lambda: page.find(second) is not None, LONG)
                server.hall.open_vote()
                option = page.begins("B   ")
                assert option is not None
                page.write(option, value=True)
                ready = ready_of(learner)
                assert eventually(lambda: answer_of(learner.lecture_of(ready)) == 1, LONG)
                assert learner.lecture is not None and learner.lecture.exercise == here, "it cannot know yet"
                token, hall = learner.token, server.hall
                assert eventually(lambda: hall.mine(token) == 1, LONG), "the vote counts all the same"
            finally:
                os.kill(pid, signal.SIGCONT)
            assert eventually(lambda: learner.lecture is not None and learner.lecture.exercise == there, LONG)
            assert eventually(lambda: answer_of(learner.lecture) == 1, LONG)
            assert page.find(second) is not None and page.find(first) is None
            assert learner.pid == pid, "a new process would make a busy computer busier"


def test_a_robot_rests_after_its_run_until_its_learner_does_something(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [0.0]
    monkeypatch.setattr(simulation_client.time, "monotonic", lambda: now[0])
    lecture = Lecture(LessonPlace("a-redundant-arm"), "done", 1, 2.0, 2.0)
    body = SimulationRunner(SceneChoice(RunSpec("planar3-hold")))
    status = body.status()
    body.close()
    resting, move = Rest(), Post(Reset())
    assert status.running and not resting.begins(lecture, status), "its learner has just seen the result"
    now[0] += simulation_client.AFTER + 1.0
    assert not resting.begins(replace(lecture, phase="running"), status)
    assert resting.begins(lecture, status)
    assert resting.wakes(move) and not resting.wakes(move) and not resting.begins(lecture, status)
    now[0] += simulation_client.AFTER + 1.0
    assert resting.begins(lecture, status)
    assert not resting.wakes(Play(True)), "the learner has done it"
    now[0] += simulation_client.AFTER + 1.0
    assert not resting.begins(lecture, status), "and wants it to move"
    resting.stir()
    now[0] += simulation_client.AFTER + 1.0
    assert resting.begins(lecture, status), "until the next run is over"


def ready_of(learner: SimulationClient) -> Ready:
    assert learner.ready is not None
    return learner.ready


def answer_of(lecture: Lecture | None) -> object:
    return None if lecture is None else lecture.answer


def text_of(page: Wire) -> str:
    control = page.controls.get(page.find("To hand in") or "")
    return "" if control is None else str(control.get("value", ""))


def test_robots_are_built_a_few_at_a_time() -> None:
    queue = BuildQueue(2)
    for who in "abcd":
        queue.enter(who)
    assert queue.next("", 0.0) == ["a", "b"]
    assert queue.before() == {"a": 0, "b": 0, "c": 2, "d": 3}
    assert queue.next("", 1.0) == [] and queue.has("c") and queue.has("a")
    assert queue.next("b", 2.0) == ["c"] and not queue.has("b")
    queue.leave("d")
    assert queue.before() == {"a": 0, "c": 0}
    queue.enter("d")
    assert queue.next("", PATIENCE + 0.5) == ["d"], "one that never comes keeps nobody waiting"
    queue.enter("b")
    queue.clear()
    assert queue.before() == {"c": 0, "d": 1}, "their robots were on the way to another step"
    assert queue.next("", PATIENCE + 1.0) == ["c", "d"]


def test_a_second_step_does_not_wait_until_the_first_is_built() -> None:
    """The teacher opens other steps and returns at once. The robot loads each step, also the one that its
    page still shows, and loads the step again when the learner asks for it."""
    steps = [LessonPlace("a-redundant-arm", k) for k in range(3)]
    loaded: list[LessonPlace] = []

    def simulation(token: str) -> Any:
        return SimpleNamespace(
            token=token,
            attached=True,
            account="",
            choice=SimpleNamespace(exercise=steps[0], at=lambda place: place),
            lecture=None,
            ready=None,
            kept_at=None,
            give_way=lambda: None,
            announce=lambda place: None,
            coming=None,
            load=lambda choice: None,
            load_for_class=loaded.append,
            read=lambda reader: None,
        )

    class OneLearner:
        learners = (simulation("one"),)

    hall = Hall(OneLearner(), simulation("the teacher's"))
    hall.start(lambda: None)
    try:
        wanted = list[LessonPlace]()
        for place in (steps[1], steps[2], steps[0], steps[1]):
            hall.go(place)
            wanted.append(place)
            assert eventually(lambda wanted=wanted: loaded == wanted, PATIENCE / 3)
        hall.fetch("one")
        assert eventually(lambda: loaded == [*wanted, steps[1]], PATIENCE / 3)
    finally:
        hall.close()
