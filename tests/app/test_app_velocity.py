"""A velocity-level scene of a page, called directly: without a process and without real time."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from dataclasses import replace
from unittest.mock import MagicMock

import numpy as np
import pytest
from served import visited

from app.client.recording import Recording
from app.html.text import free_name
from app.link.choice import SceneChoice
from app.link.messages import MissionView, Play, Post, Ready, ResetAll, Status, StepTick
from app.panels.run.plots import PlotsPanel, velocity_plots
from app.panels.velocity.mission import RolesPanel
from app.view.goals import open_row
from app.worker.main import BACKLOG, Pacer
from app.worker.simulation import SimulationRunner
from browsing.wire import eventually
from himpc import Level
from himpc.rotation import exp3, from_quaternion, log3, quaternion
from lessons.events import InsertTask, MoveLevel, MoveTarget, Push, Release, RemoveTask, Reset, Set
from lessons.scenes.run_spec import RunSpec
from lessons.settings.velocity import VelocitySettings

RINGS = "/targets/orientation/control"


def opened(scene: str) -> Iterator[SimulationRunner]:
    made = SimulationRunner(SceneChoice(RunSpec(scene)))
    yield made
    made.close()


@pytest.fixture
def body() -> Iterator[SimulationRunner]:
    yield from opened("ridgeback-ur10-drag")


@pytest.fixture
def handover() -> Iterator[SimulationRunner]:
    yield from opened("ridgeback-ur10-handover")


def mission(status: Status) -> MissionView:
    assert status.mission is not None
    return status.mission


def error(body: SimulationRunner, role: str) -> float:
    row = body.block.since(0)[1][-1]
    return float(np.linalg.norm(row[body.session.layout.fields[f"error/{role}"]]))


def test_reports_survive_the_pipe(body: SimulationRunner) -> None:
    ready: Ready = pickle.loads(pickle.dumps(body.ready()))
    assert [(task.name, task.kind, task.axes) for task in ready.tasks] == [
        ("ee", "position", "xyz"),
        ("base", "position", "xy"),
    ]
    assert ready.room.shape[1] == 3 and np.ptp(ready.room[:, 0]) > 2.0
    body.tick(2)
    status: Status = pickle.loads(pickle.dumps(body.status()))
    assert status.path.shape == (11, 3) and status.gauge is None
    assert {role: path.shape for role, path in mission(status).paths.items()} == {
        "ee": (11, 3),
        "base": (11, 3),
    }
    assert np.allclose(mission(status).paths["base"][:, 2], 0.015)
    assert [row.state for row in mission(status).rows] == ["active", "active"]


def test_the_robot_moves_between_two_control_steps(body: SimulationRunner) -> None:
    """A control step consists of ten small motions and one row; the robot does not jump once per step."""
    body.handle(Post(MoveTarget("base", (0.5, 0.5))))
    body.tick(5)
    x, rows = [], body.block.count
    for _ in range(10):
        assert body.session.step_s == pytest.approx(0.01)
        ended = body.advance()
        body.write_poses()
        x.append(body.block.poses()[2, 0])
        assert body.block.count == rows + ended
    assert body.block.count == rows + 1
    steps = np.diff(x)
    assert (steps > 0).all() and steps.max() < 0.015


def test_a_pause_stands_between_two_control_steps(body: SimulationRunner) -> None:
    """A pause first completes the present control step. While paused, edits and a reset take effect without a
    step."""
    body.handle(Post(MoveTarget("base", (0.5, 0.5))))
    for _ in range(14):
        body.advance()
    body.handle(Play(False))
    assert not body.session.between and body.ticks == 2 and body.session.t == pytest.approx(0.2)
    for event in (
        Set("horizon", 4),
        MoveLevel("base", 0),
        MoveTarget("ee", (1.0, 0.5, 0.8)),
        Set("horizn", 1),
    ):
        body.handle(Post(event))
    body.settle()
    status = body.status()
    assert status.t == pytest.approx(0.2) and status.settings is not None and status.settings.horizon == 4
    assert [row.name for row in mission(status).rows] == ["base", "ee"]
    assert np.allclose(status.targets["ee"], (1.0, 0.5, 0.8))
    assert len(status.notices) == 1 and "horizon" in status.notices[0]
    body.handle(StepTick())
    assert body.take_steps() == 1
    body.tick()
    assert body.session.t == pytest.approx(0.3)
    body.handle(Post(Reset()))
    body.settle()
    assert body.session.t == 0.0 and body.take_steps() == 1
    body.handle(ResetAll())
    assert body.running and body.session.settings.horizon == 10


def test_a_step_while_running_pauses_first(body: SimulationRunner) -> None:
    for _ in range(3):
        body.advance()
    body.handle(StepTick())
    assert not body.running and body.ticks == 1 and body.take_steps() == 1


def test_the_base_stops_where_the_arm_is_stretched_until_it_comes_first(body: SimulationRunner) -> None:
    body.handle(Post(MoveTarget("base", (-1.5, 0.0))))
    worst = 0.0
    for _ in range(60):
        body.tick()
        worst = max(worst, error(body, "ee"))
    assert worst < 0.01 and error(body, "base") > 0.5
    body.handle(Post(MoveLevel("base", 0)))
    body.tick(40)
    assert error(body, "base") < 0.01
    assert body.status().notices == ()


def test_the_list_follows_the_mission(handover: SimulationRunner) -> None:
    """Events change the list of tasks; people move with their tasks and keep the balls that they received."""
    before = mission(handover.status())
    assert [row.name for row in before.rows] == ["base 1", "ee 1", "base 2", "ee 2"]
    assert [person.balls for person in before.people] == [0, 0]
    assert np.allclose(before.people[0].hand, (0.0, 2.0, 0.8)) and before.people[0].place[1] > 2.3
    handover.handle(Post(InsertTask("detour", "ee", (1.0, 1.0, 1.0), before="ee 2", hold=None)))
    handover.handle(Post(RemoveTask("base 2")))
    handover.handle(Post(MoveTarget("ee 2", (-2.0, -0.5, 0.9))))
    handover.handle(Post(Release("ee 1")))
    handover.tick(75)  # the scene's own script begins later
    after = mission(handover.status())
    assert [row.name for row in after.rows] == ["base 1", "ee 1", "detour", "ee 2"]
    assert [row.state for row in after.rows] == ["done", "done", "active", "active"]
    assert after.rows[1].done_at is not None and after.rows[2].hold is None
    assert after.rows[2].there_s is not None and after.rows[2].there_s > 0.0
    assert [person.balls for person in after.people] == [1, 0]
    assert np.allclose(after.people[1].hand, (-2.0, -0.5, 0.9))
    assert not after.done


def test_a_role_without_an_open_task_has_no_target(handover: SimulationRunner) -> None:
    for name in ("base 1", "base 2"):
        handover.handle(Post(RemoveTask(name)))
    handover.tick()
    status = handover.status()
    assert set(status.targets) == {"ee"}
    assert open_row(mission(status).rows, "base") is None
    first = open_row(mission(status).rows, "ee")
    assert first is not None and first.name == "ee 1"


def test_what_a_kind_does_not_know_is_a_sentence(body: SimulationRunner) -> None:
    """A push at velocity level and a mission event at torque level each give one notice."""
    body.handle(Post(Push("base", (10.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.1)))
    body.tick()
    assert len(body.status().notices) == 1
    for torque in opened("planar3-hold"):
        torque.handle(Post(Release("ee 1")))
        torque.tick()
        assert "no mission" in torque.status().notices[0]


def test_an_arm_turns_its_hand_as_it_is_told() -> None:
    """An orientation target turns the hand. After all tasks of this role are removed, the role has no
    target."""
    for arm in opened("iiwa14-htmpc"):
        arm.tick()
        wanted = exp3(np.array([0.0, 0.0, 0.5])) @ arm.status().targets["orientation"]
        arm.handle(Post(MoveTarget("orientation", tuple(quaternion(wanted)))))
        arm.tick(40)
        assert np.allclose(arm.status().targets["orientation"], wanted)
        assert max(error(arm, "orientation"), error(arm, "position")) < 1e-3
        (row,) = (row for row in mission(arm.status()).rows if row.role == "orientation")
        assert row.goal == pytest.approx(quaternion(wanted)) and arm.status().notices == ()
        arm.handle(Post(RemoveTask("orientation")))
        arm.tick()
        assert set(arm.status().targets) == {"position"}


def test_rings_on_the_page_turn_the_hand_of_an_arm() -> None:
    with visited("panda-htmpc") as (page, learner):
        assert eventually(lambda: page.shows("turn it by its rings"))
        assert learner.status is not None
        before = learner.status.targets["orientation"]
        assert eventually(lambda: RINGS in page.controls_3d)
        wanted = tuple(quaternion(exp3(np.array([0.0, 0.0, 0.5])) @ before))

        def turned() -> bool:
            row = learner.read(lambda recording: recording.latest[recording.layout.fields["x/orientation"]])
            return row is not None and bool(np.abs(log3(from_quaternion(row) @ before.T))[2] > 0.45)

        # The message is repeated, because the first one may arrive before the control has a callback.
        assert any(page.turn(RINGS, wanted) or eventually(turned, 10.0) for _ in range(6))
        assert eventually(lambda: page.shows("orientation of its rings"))


def test_new_names_are_free() -> None:
    assert free_name("ee added", ["ee"]) == "ee added"
    assert free_name("ee added", ["ee added", "ee added 2"]) == "ee added 3"


def test_a_fast_simulation_may_owe_as_much_real_time_as_a_slow_one() -> None:
    pacer = Pacer(0.0)
    pacer.speed = 10.0
    assert pacer.due(0.05, 0.01) == 50 and not pacer.capped(0.05)
    assert pacer.due(5.0, 0.01) == round(10.0 * BACKLOG / 0.01) and pacer.capped(5.0)


def test_a_row_counts_until_the_next_one_comes(body: SimulationRunner) -> None:
    """At 10 Hz every second bucket of the plots has no row. A row is used until the next one arrives, so the
    curve has no gaps, and looking back finds a row at every time."""
    body.tick(30)
    layout = body.session.layout
    recording = Recording(body.block, layout)
    recording.pull()
    t = layout.fields["t"]
    times = recording.window(3.0).columns(t)[:, 0]
    known = times[np.isfinite(times)]
    assert len(known) == 2 * round(3.0 / 0.05 + 1)
    assert np.array_equal(np.unique(known), history_times(body)) and (np.diff(known) >= 0).all()
    assert recording.row(1.37)[t][0] == pytest.approx(1.3)
    assert np.isnan(recording.window(8.0).columns(t)[-1]).all()


def test_a_chart_whose_first_curve_has_no_values_draws_the_others(body: SimulationRunner) -> None:
    """The hand has no task any more, and the error of the base is drawn. Bounds alone are no values."""
    gui = MagicMock()
    in_view = MagicMock(sees=lambda title: title.startswith("Error"))
    ready = body.ready()
    page = MagicMock(gui=gui, in_view=in_view, ready=ready, robot=ready.robot, settings=ready.settings)
    page.colours = dict.fromkeys(("ee", "base"), (0, 0, 0))
    plots = PlotsPanel(page, velocity_plots)
    note = gui.add_html.return_value
    note.visible = False
    layout, drawn = body.session.layout, gui.add_uplot.return_value

    def draw(after: int) -> None:
        body.tick(after)
        recording = Recording(body.block, layout)
        recording.pull()
        for _ in range(12):
            plots.draw(recording.window(), None)

    body.handle(Post(RemoveTask("ee")))
    draw(0)
    assert note.visible and not drawn.mock_calls
    draw(30)
    assert not note.visible


def test_a_level_has_its_name_on_the_page_as_it_is(
    body: SimulationRunner, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A label is shown as text, so that nothing in it is replaced."""
    page = MagicMock(colours=dict.fromkeys(("<ee>", "<base>"), (0, 0, 0)))
    settings = body.session.settings
    assert isinstance(settings, VelocitySettings)
    tasks = [replace(level.tasks[0], name=f"<{level.name}>") for level in settings.levels]
    page.settings = MagicMock(levels=[Level((task,)) for task in tasks])
    monkeypatch.setattr("app.panels.velocity.mission.Controls", MagicMock())
    RolesPanel(page, None)
    labels = [call.args[0] for call in page.gui.add_folder.call_args_list if call.args[0]]
    assert labels == ["Settings of <ee>", "Settings of <base>"]


def history_times(body: SimulationRunner) -> np.ndarray:
    return body.block.since(0)[1][:, body.session.layout.fields["t"]][:, 0]
