"""A ghost in its own process, without a browser."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import numpy as np
import psutil
import pytest
from served import LONG, Start, begun, rings, visited

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from app.link.messages import Lead, Load, Play, Post, ResetAll, Script, WaitAt
from app.link.process import wait_until
from app.worker.ghost import GhostBody
from app.worker.simulation import SimulationRunner
from browsing.wire import eventually
from lessons.events import Push, Reset, Set
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import Ghost


@pytest.fixture
def body() -> Iterator[SimulationRunner]:
    made = SimulationRunner(SceneChoice(RunSpec("planar3-hold")))
    yield made
    made.close()


def script_of(body: SimulationRunner) -> Script:
    found = body.leader.script(body.session)
    assert found is not None
    return found


def untimed(body: SimulationRunner) -> np.ndarray:
    """Returns all rows, with the measured times set to zero."""
    layout = body.session.layout
    _, rows = body.block.since(0)
    for name, where in layout.fields.items():
        if name == "step_us" or name.startswith("time_us/"):
            rows[:, where] = 0.0
    return rows


def test_a_ghost_has_the_rows_of_its_leader(body: SimulationRunner) -> None:
    """From the moment at which the leader begins to lead, the ghost's rows equal the leader's rows, although
    settings were changed before."""
    body.tick(20)
    for event in (Set("horizon", 3), Set("controller", "hqp"), Set("controller", "himpc")):
        body.handle(Post(event))
    body.tick(7)
    body.handle(Lead(True))
    before = body.block.count
    first = script_of(body)
    assert first.begin is not None and first.t == 0.0 and first.begin.settings.horizon == 3
    ghost = GhostBody(first.begin, ())
    try:
        body.handle(Post(Push(body.session.robot.joint_names[-1], (0.0, 3.0, 0.0), seconds=0.02)))
        body.tick(30)
        body.handle(Post(Set("M_bar_scale", 2.0)))
        body.tick(13)
        script = script_of(body)
        ghost.driver.hear(script.events, script.t)
        while ghost.catch_up(0.0):
            pass
        assert ghost.body.session.t == body.session.t
        assert np.array_equal(untimed(body)[before:], untimed(ghost.body), equal_nan=True)
        assert body.leader.script(body.session) is None  # the beginning is sent once
    finally:
        ghost.body.close()


def test_leading_begins_anew_with_every_fresh_start(body: SimulationRunner) -> None:
    body.handle(Lead(True))
    assert script_of(body).begin is not None
    assert body.leader.waits(0.001)
    body.handle(WaitAt(0.5))
    assert not body.leader.waits(0.4) and body.leader.waits(0.6)
    body.tick(3)
    body.handle(Post(Reset()))
    body.tick()
    script = script_of(body)
    assert script.begin is None and isinstance(script.events[0][1], Reset)
    body.handle(Post(Set("horizon", 9)))
    body.tick()
    body.handle(ResetAll())
    begin = script_of(body).begin
    assert begin is not None and begin.settings.horizon == 5
    body.handle(Load(SceneChoice(RunSpec("panda-hold"))))
    begin = script_of(body).begin
    assert begin is not None and begin.choice.run.scene == "panda-hold"
    body.handle(Lead(False))
    body.tick()
    assert body.leader.script(body.session) is None and not body.leader.waits(1e9)


def together(learner: SimulationClient) -> bool:
    """Returns whether both are paused at the same time t > 0.1 s."""
    status, ghost = learner.status, learner.ghost
    if status is None or ghost is None or ghost.status is None or status.running:
        return False
    t = learner.look()
    return t is not None and t > 0.1 and ghost.look() == t


def test_a_ghost_begins_follows_and_ends(start: Start) -> None:
    learner = begun(start)
    learner.start_ghost(Ghost("no preview", ("horizon=1",)))
    ghost = learner.ghost
    assert ghost is not None
    assert wait_until(lambda: ghost.status is not None and ghost.status.t > 0.3, LONG)
    assert ghost.ready is not None
    learner.send(Post(Push(ghost.ready.robot.joint_names[-1], (0.0, 5.0, 0.0))))
    learner.send(Post(Set("M_bar_scale", 2.0)))
    assert wait_until(lambda: getattr(ghost.settings, "M_bar_scale", 1.0) == 2.0, LONG)
    assert ghost.settings is not None and ghost.settings.horizon == 1
    learner.send(Play(False))
    assert wait_until(lambda: together(learner), LONG)
    mine = learner.figures
    its = ghost.figures
    assert mine is not None and its is not None and mine.seconds == pytest.approx(its.seconds, abs=1e-9)
    pid, before = ghost.pid, rings()
    learner.stop_ghost()
    assert learner.ghost is None and pid is not None
    assert wait_until(lambda: not psutil.pid_exists(pid), LONG)
    assert wait_until(lambda: rings() == before - 1, LONG)
    learner.send(Play(True))
    t = learner.look() or 0.0
    # a closed ghost no longer limits its leader
    assert wait_until(lambda: (learner.look() or 0.0) > t + 0.5, LONG)


def test_a_ghost_that_does_not_fit_is_a_notice_and_stops_nothing(start: Start) -> None:
    learner = begun(start)
    learner.start_ghost(Ghost("nonsense", ("horizn=3",)))
    notices: list[str] = []
    assert wait_until(lambda: bool(notices.extend(learner.take_messages()[1]) or notices), LONG)
    assert "horizon" in notices[0] and learner.ghost is None
    t = learner.look() or 0.0
    assert wait_until(lambda: (learner.look() or 0.0) > t + 0.5, LONG)


def test_a_ghost_goes_along_to_another_scene(start: Start) -> None:
    learner = begun(start)
    learner.start_ghost(Ghost("N = 1", ("horizon=1",)))
    ghost = learner.ghost
    learner.send(Load(SceneChoice(RunSpec("iiwa14-hold"))))
    assert wait_until(
        lambda: (
            ghost is not None
            and ghost.ready is not None
            and ghost.ready.choice.run.scene == "iiwa14-hold"
            and ghost.status is not None
            and ghost.status.t > 0.3
        ),
        LONG,
    )
    assert learner.ghost is ghost and learner.choice.run.scene == "iiwa14-hold"


def test_a_button_that_starts_a_process_does_not_hold_up_other_pages(monkeypatch: pytest.MonkeyPatch) -> None:
    """It starts the process on a thread: on viser's loop, all pages would wait for it."""
    waits: list[bool] = []

    def start_ghost(*_: object) -> None:
        try:
            asyncio.get_running_loop()
        except RuntimeError:
            waits.append(False)
        else:
            waits.append(True)

    monkeypatch.setattr(SimulationClient, "start_ghost", start_ghost)
    with visited() as (page, _):
        page.use("Ghost's controller", "osf")
        page.use("Start the ghost")
        assert eventually(lambda: bool(waits))
    assert waits == [False]


@pytest.mark.parametrize("in_class", [False, True])
def test_a_step_shows_its_ghost_until_it_is_hidden(in_class: bool) -> None:
    """In a class, whose robots share one computer, a learner starts the ghost with the same checkbox."""
    place = LessonPlace("a-redundant-arm", 2)
    names = False if in_class else None
    with visited(SceneChoice.of_lesson(place), class_names=names) as (page, learner):
        assert eventually(lambda: page.find("Ghost") is not None, LONG)
        switch = str(page.find("Ghost"))
        assert eventually(lambda: learner.lecture is not None, LONG)
        assert page.controls[switch]["value"] is not in_class
        if in_class:
            assert learner.ghost is None
            page.write(switch, value=True)
        assert eventually(lambda: "/ghost/label" in page.nodes, LONG)
        ghost = learner.ghost
        assert ghost is not None and ghost.words == "orientation kept"
        page.write(switch, value=False)
        assert eventually(lambda: learner.ghost is None and "/ghost" not in page.nodes, LONG)
