"""The simulation in its own process: pause, speed, crash, recovery, several simulations, the end."""

from __future__ import annotations

import errno
import os
from typing import Any

import psutil
import pytest
from children import LONG, Start, begun, rings

from app.client.simulation_client import SimulationClient
from app.link import fork_server
from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from app.link.fork_server import SERVER
from app.link.messages import Load, Post, SimulationFailed
from app.link.process import Process, Spares, wait_until
from app.web.sessions import WORKER, Sessions
from lessons.events import Set
from lessons.scenes.run_spec import RunSpec


def ticks(learner: SimulationClient) -> int:
    return 0 if learner.status is None else learner.status.ticks


def test_a_page_that_shows_the_scene_before_keeps_its_settings(start: Start) -> None:
    """Until a page has built the next scene, it has the settings of the scene that it shows. The settings of
    the next scene may be of another type."""
    learner = begun(start)
    learner.send(Post(Set("horizon", 8)))
    before = learner.ready
    assert before is not None
    assert wait_until(lambda: learner.settings_of(before).horizon == 8, LONG)  # pyright: ignore
    learner.send(Load(SceneChoice.of_lesson(LessonPlace("first-hold-then-reach"))))
    assert wait_until(lambda: learner.ready is not before, LONG)
    now = learner.ready
    assert now is not None
    assert learner.settings_of(before) is before.settings
    assert learner.settings_of(now) is learner.settings is not before.settings
    assert learner.choice_of(before).exercise is None
    later = LessonPlace("first-hold-then-reach", 1)
    learner.send(Load(SceneChoice.of_lesson(later)))
    assert wait_until(lambda: learner.choice_of(now).exercise == later, LONG)
    assert learner.ready is now


@pytest.mark.skipif(not hasattr(os, "SCHED_BATCH"), reason="Linux only")
def test_a_simulation_lets_the_ticks_of_another_end(start: Start) -> None:
    pid = begun(start).pid
    assert pid is not None
    assert os.sched_getscheduler(pid) == os.SCHED_BATCH
    assert os.sched_getscheduler(0) != os.SCHED_BATCH


def test_a_bad_scene_is_a_sentence_and_the_process_waits(start: Start) -> None:
    learner, refusals = start(RunSpec("hold", urdf="/nowhere/robot.urdf")), list[str]()
    assert wait_until(lambda: bool(refusals.extend(learner.take_messages()[0]) or refusals), LONG)
    assert "/nowhere/robot.urdf" in refusals[0] and learner.failure is None


def test_no_child_and_no_memory_is_left(start: Start) -> None:
    learner = begun(start)
    pid, before = learner.pid, rings()
    assert pid is not None and before > 0
    learner.close()
    assert wait_until(lambda: not psutil.pid_exists(pid), LONG)
    assert rings() == before - 1


def test_a_fork_server_outlives_who_used_it_first(one_fork_server: None) -> None:
    parents = set[int]()
    for _ in range(2):
        spares = Spares(WORKER)
        learner = SimulationClient("token", SceneChoice(RunSpec("planar3-hold")), spares)
        assert wait_until(lambda one=learner: ticks(one) > 20, LONG)
        pid = learner.pid
        assert pid is not None
        parents.add(psutil.Process(pid).ppid())
        learner.close()
        spares.close()
        assert wait_until(lambda pid=pid: not psutil.pid_exists(pid), LONG)
    assert len(parents) == 1


def test_sessions_resume_end_and_are_limited(one_fork_server: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Free memory is given back when the last page has gone, not while one is open, as this takes some
    milliseconds."""
    given: list[int] = []
    monkeypatch.setattr("app.web.sessions.give_back", lambda: given.append(len(sessions.learners)))
    monkeypatch.setattr("app.web.sessions._TIDY", LONG)
    sessions = Sessions(SceneChoice(RunSpec("planar3-hold")), max_sessions=2, grace=1.0)
    try:
        one, two = sessions.enter([]), sessions.enter([])
        assert one is not None and two is not None and one is not two
        assert sessions.enter([]) is None  # full
        assert sessions.enter([one.token]) is None  # attached elsewhere: two tabs never share a robot
        sessions.leave(one)
        assert sessions.enter([]) is None  # the place is reserved for the page that reloads
        assert sessions.enter(["stranger", one.token]) is one  # a reload
        sessions.leave(two)
        assert wait_until(lambda: two not in sessions.learners, LONG)
        assert one in sessions.learners
        sessions.leave(one)
        three = sessions.enter([])
        assert three is not None and three is not one
        assert given == []
        sessions.leave(three)
        assert wait_until(lambda: given == [0], LONG)
    finally:
        sessions.close()
    assert not sessions.learners


def refused(*_: object) -> Any:
    raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")


def test_a_child_that_cannot_be_started_ends_with_a_sentence_that_names_the_limit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("app.link.fork_server._started", refused)
    process = Process(WORKER)
    heard: list[Any] = []
    process.listen(heard.append)
    assert wait_until(lambda: not process.alive and bool(heard), LONG)
    (failure,) = heard
    assert (
        isinstance(failure, SimulationFailed)
        and "limit of processes is reached (ulimit -u" in failure.sentence
    )
    process.close()


def test_after_a_limit_of_processes_a_page_gets_its_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    """If no process can be started, the page says why; when there is room again, it gets its robot."""
    SERVER.end()
    spares = Spares("childless")
    started = fork_server._started
    monkeypatch.setattr(
        fork_server, "_started", lambda how, *run: refused() if how._name == "spawn" else started(how, *run)
    )
    learner = SimulationClient("token", SceneChoice(RunSpec("planar3-hold")), spares)
    try:
        assert wait_until(lambda: learner.failure is not None, LONG)
        assert "No simulation can be started: the limit of processes" in str(learner.failure)
        trouble = learner.trouble()
        assert trouble is not None and trouble.offer is not None
        monkeypatch.undo()
        learner.restart()
        assert wait_until(lambda: learner.status is not None, LONG) and learner.failure is None
    finally:
        learner.close()
        spares.close()
        SERVER.end()
