"""The simulation of a page, called directly: without a process and without real time."""

from __future__ import annotations

import pickle
import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from app.client.recording import BUCKETS, Recording
from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from app.link.messages import Load, LoadRefused, Play, Post, Ready, ResetAll, Speed, StepTick
from app.panels.run.playback import headline
from app.worker.main import BACKLOG, Pacer
from app.worker.simulation import SimulationRunner
from lessons.events import MoveLevel, MoveTarget, Reset, Set
from lessons.scenes.run_spec import RunSpec
from lessons.session.torque import TRUTH_TICKS
from lessons.settings.torque import TorqueSettings
from robots import InputError


@pytest.fixture
def body() -> Iterator[SimulationRunner]:
    made = SimulationRunner(SceneChoice(RunSpec("iiwa14-hold")))
    yield made
    made.close()


def test_ticks_reach_the_block_in_order(body: SimulationRunner) -> None:
    body.tick(50)
    first, rows = body.block.since(0)
    t = rows[:, body.session.layout.fields["t"]][:, 0]
    assert first == 0 and len(rows) == 50
    assert np.allclose(np.diff(t), 1e-3)


def test_reports_survive_the_pipe(body: SimulationRunner) -> None:
    ready = pickle.loads(pickle.dumps(body.ready()))
    assert ready.robot.joint_names == body.session.robot.joint_names
    assert [task.kind for task in ready.tasks] == ["position", "orientation", "posture"]
    body.tick(3)
    status = pickle.loads(pickle.dumps(body.status()))
    assert status.settings is not None and status.path.shape == (6, 3)
    assert body.status().settings is None  # settings are sent once, then only after a change


def test_settings_and_wrong_settings(body: SimulationRunner) -> None:
    body.handle(Post(Set("horizon", 10)))
    body.handle(Post(Set("M_bar_scale", -1.0)))
    body.handle(Post(Set("horzion", 3)))
    body.tick()
    status = body.status()
    assert status.settings is not None and status.settings.horizon == 10
    assert len(status.notices) == 2 and "horizon" in status.notices[1]
    assert body.status().notices == ()


def test_pause_step_speed(body: SimulationRunner) -> None:
    body.handle(Play(False))
    assert not body.running
    body.handle(Play(True))
    body.handle(StepTick())
    assert not body.running and body.take_steps() == 1 and body.take_steps() == 0
    body.handle(Post(Reset()))
    assert body.take_steps() == 1  # the page shows a reset while paused
    body.handle(Play(True))
    body.handle(Post(Reset()))
    body.handle(StepTick())
    assert body.take_steps() == 1  # one press gives one tick
    body.handle(Speed(0.5))
    assert body.status().speed == 0.5


def test_paused_edits_take_effect_though_no_time_passes(body: SimulationRunner) -> None:
    """While the simulation is paused, the status reports the settings, the order, the gauge and the refusals
    that the edits cause. Time and robot do not change."""
    body.tick(3)
    assert body.status().gauge is None  # while the simulation runs, the rows contain the gauge
    body.handle(Play(False))
    before = body.status()
    for event in (Set("M_bar_scale", 3.0), MoveLevel("posture", 0), Set("horizon", 0)):
        body.handle(Post(event))
    body.settle()
    after = body.status()
    assert after.t == before.t and after.ticks == before.ticks
    assert isinstance(after.settings, TorqueSettings) and after.settings.M_bar_scale == 3.0
    assert [level.name for level in after.settings.levels] == ["posture", "position", "orientation"]
    assert len(after.notices) == 1 and "horizon" in after.notices[0]
    assert before.gauge is not None and after.gauge is not None and after.gauge != before.gauge
    body.handle(Play(True))
    body.tick(TRUTH_TICKS)
    row = body.block.since(0)[1][-1]
    assert row[body.session.layout.fields["gauge_radius"]][0] == pytest.approx(after.gauge[1], rel=1e-6)


def test_reset_keeps_settings_and_reset_all_does_not(body: SimulationRunner) -> None:
    start = body.block.poses()[-1].copy()
    target = tuple(start[:3] + np.array([0.0, 0.15, 0.0]))
    body.handle(Post(MoveTarget("position", target)))
    body.handle(Post(Set("horizon", 3)))
    body.tick(400)
    body.write_poses()
    assert abs(body.block.poses()[-1][1] - start[1]) > 0.01
    before = body.resets
    body.handle(Post(Reset()))
    body.tick()
    body.write_poses()
    assert np.allclose(body.block.poses()[-1], start, atol=1e-4)
    assert body.session.settings.horizon == 3 and body.resets == before + 1
    body.handle(ResetAll())
    assert body.session.settings.horizon == 5


def test_another_scene_or_a_sentence(body: SimulationRunner) -> None:
    kept = body.session
    for choice in (
        SceneChoice(RunSpec("hold", urdf="/nowhere/robot.urdf")),
        SceneChoice(RunSpec("hold"), urdf_text="<robot><broken"),
        SceneChoice(RunSpec("hold", urdf="panda", tip="no_such_link")),
        SceneChoice(RunSpec("no-such-scene")),
    ):
        answer = body.handle(Load(choice))
        assert isinstance(answer, LoadRefused) and answer.sentence and "Traceback" not in answer.sentence
        assert body.session is kept
    old = body.block
    answer = body.handle(Load(SceneChoice(RunSpec("planar3-hold"))))
    assert isinstance(answer, Ready) and answer.robot.n == 3 and body.block is not old
    body.tick(10)


def test_a_scene_that_cannot_be_loaded_at_all() -> None:
    with pytest.raises(InputError):
        SimulationRunner(SceneChoice(RunSpec("hold", urdf="/nowhere/robot.urdf")))


def test_history_keeps_spikes_and_counts_bounds(body: SimulationRunner) -> None:
    layout = body.session.layout
    recording = Recording(body.block, layout)
    row = np.zeros(layout.size)
    for k in range(95):
        row[:] = 0.0
        row[layout.fields["t"]] = 1e-3 * k
        if k == 42:
            row[layout.fields["step_us"]] = 7.0
            row[layout.fields["at_bound"]][2] = 13.0
            # the controller determines which limit binds, so the speed does not matter
            row[layout.fields["at_bound"]][3] = 2.0
            row[layout.fields["v_limit"]] = 1.0
        body.block.write(row)
        if k % 7 == 0:
            recording.pull()
    recording.pull()
    window = recording.window()
    assert np.nanmax(window.columns(layout.fields["step_us"])) == 7.0
    assert recording.bound_ticks[2].tolist() == [1, 0, 1, 1, 0] and recording.bound_ticks.sum() == 4
    assert recording.bound_ticks[3].tolist() == [0, 1, 0, 0, 0]
    assert window.at_bound(0)[:, 2].sum() == 2  # one bucket is drawn as two points
    assert len(window.ages()) == 2 * BUCKETS
    recording.take(np.zeros((1, layout.size)))
    assert (
        np.isfinite(recording.window().columns(layout.fields["t"])).sum() == 2
        and not recording.bound_ticks.any()
    )


def test_the_ring_wraps(body: SimulationRunner) -> None:
    width = body.session.layout.size
    rows = body.block.rows
    for k in range(rows + 100):
        body.block.write(np.full(width, float(k)))
    first, kept = body.block.since(0)
    assert first > 100 and kept[-1, 0] == rows + 99
    assert np.array_equal(kept[:, 0], np.arange(first, rows + 100))


def test_pacer_owes_simulated_time_but_never_piles_it_up() -> None:
    pacer = Pacer(0.0)
    assert pacer.due(0.010, 1e-3) == 10
    pacer.ran(10, 1e-3)
    assert pacer.due(0.0105, 1e-3) == 0
    assert pacer.due(0.011, 1e-3) == 1
    pacer.ran(1, 1e-3)
    assert not pacer.capped(0.011)
    assert pacer.due(5.0, 1e-3) == round(BACKLOG / 1e-3)
    assert pacer.capped(5.0) and pacer.capped(5.5) and not pacer.capped(6.5)
    pacer.rest(7.0)
    pacer.speed = 0.1
    assert pacer.due(7.1, 1e-3) == 10


def test_a_choice_may_bring_settings_and_a_seed() -> None:
    """The button "Reset all" restores the settings and the seed with which the scene was loaded."""
    made = SimulationRunner(
        SceneChoice(RunSpec("planar3-hold", set=("order=posture,position,orientation", "horizon=3"), seed=4))
    )
    made.handle(Post(Set("horizon", 9)))
    made.tick(2)
    assert made.session.settings.horizon == 9
    made.handle(ResetAll())
    assert made.session.settings.horizon == 3
    assert made.session.settings.levels[0].name == "posture"
    assert made.session.seed == 4
    refused = made.handle(Load(SceneChoice(RunSpec("planar3-hold", set=("horizn=3",)))))
    assert isinstance(refused, LoadRefused) and "horizon" in refused.sentence
    made.close()


def test_late_torques_are_counted() -> None:
    made = SimulationRunner(SceneChoice(RunSpec("planar3-hold", set=("deadline_ms=0.5", "horizon=5"))))
    made.tick(3)
    made.handle(Post(Set("horizon", 6)))
    made.tick(4)
    assert (made.status().ticks, made.status().late) == (7, 4)
    made.close()


def test_another_stack_has_memory_of_its_own(body: SimulationRunner) -> None:
    """A change of the stack creates a new block with rows of the new width, while running and while paused;
    the page is informed once."""
    body.tick(5)
    assert body.news() is None
    elbow = {"task": "position", "name": "elbow", "frame": "link_4", "level": 2}
    body.handle(Post(Set("stack.add", elbow)))
    body.tick(3)
    news = body.news()
    assert news is not None and news.again and body.news() is None
    assert [task.name for task in news.tasks][:2] == ["position", "elbow"]
    _, rows = body.block.since(0)
    assert rows.shape == (3, news.layout.size)
    assert np.isfinite(rows[:, news.layout.fields["error/elbow"]]).all()
    assert body.status().ranks["elbow"] == (2, 3)
    body.handle(Play(False))
    body.handle(Post(Set("stack.remove", "elbow")))
    body.settle()
    news = body.news()
    assert news is not None and "elbow" not in [task.name for task in news.tasks]
    body.handle(Post(Set("stack.add", elbow)))
    body.settle()
    body.handle(ResetAll())
    news = body.news()
    assert news is not None and "elbow" not in [task.name for task in news.tasks]


def test_in_a_lesson_the_stack_stays() -> None:
    lesson = SimulationRunner(SceneChoice.of_lesson(LessonPlace("a-redundant-arm")))
    before = lesson.session.settings.levels
    lesson.handle(Post(Set("stack.remove", "posture")))
    lesson.settle()
    assert lesson.session.settings.levels == before
    assert "The stack cannot be changed in a lesson" in lesson.status().notices[0]
    lesson.close()


def test_the_headline_is_one_quiet_line(body: SimulationRunner) -> None:
    body.tick(2100)
    status = replace(body.status(), over_budget=6, speed=1.0)

    def told(**changes: Any) -> str:
        return re.sub(r"<[^>]+>|&nbsp;", "", headline(replace(status, **changes), 1e-3)).replace("  ", " ")

    assert told(running=True, capped=False, real_time_factor=0.98) == "Running · 2.1 s · real time"
    assert told(running=True, capped=True, real_time_factor=0.97) == "Running · 2.1 s · real time"
    slow = told(running=True, capped=True, real_time_factor=0.48)
    assert slow == "Running · 2.1 s · slower than real time (0.5 ×)"
    assert told(running=True, capped=False, real_time_factor=3.0) == "Running · 2.1 s · 3.0 × real time"
    assert told(running=False) == "Paused · 2.100 s"
    assert "tick 2100 at t = 2.100 s; 6 ticks over the 1 ms budget (0.3 %)" in headline(status, 1e-3)
