"""A dragged target: position and orientation are posted together, at once or after a short wait."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from queue import Queue
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest

from app.html.palette import JOINTS, LEVELS
from app.link.choice import SceneChoice
from app.link.exercise import Lecture, LessonPlace
from app.link.messages import Post, Ready
from app.panels.torque.start import StartPanel
from app.view import drag
from app.view.drag import Hand, Question, Reachability, ReachabilityWorker, paused_words
from app.view.goals import Goal
from app.view.obstacles import _Solid
from app.view.robot import gizmo_size, target_radius
from app.view.targets import Targets, draggable
from app.worker.simulation import SimulationRunner
from lessons.events import Event, MoveTarget
from lessons.scenes.run_spec import RunSpec
from robots.collision import Ball
from robots.loading.load import load_urdf_text
from robots.reach import ReachJudge

FAR = np.array([5.0, 0.0, 0.0])
TIP = np.array([0.4, 0.0, 0.6, 1.0, 0.0, 0.0, 0.0])


class Scene:
    """Stores nodes by name, each with its arguments, and the callbacks of controls."""

    def __init__(self) -> None:
        self.nodes: dict[str, Any] = {}
        self.moved: Callable[[], None] = lambda: None

    def __getattr__(self, _: str) -> Any:
        def add(name: str, *given: Any, **made: Any) -> Any:
            text = given[0] if given and isinstance(given[0], str) else ""
            points = given[0] if given and isinstance(given[0], np.ndarray) else None
            turn, here = np.array([1.0, 0, 0, 0]), np.zeros(3)
            made = {"wxyz": turn, "position": here, "visible": True, "text": text, "points": points, **made}
            node = SimpleNamespace(**made, remove=lambda: None, on_update=self._listen)
            self.nodes[name] = node
            return node

        return add

    def _listen(self, back: Any) -> Any:
        def moved() -> None:
            with pytest.raises(StopIteration):
                back(None).send(None)

        self.moved = moved
        return back


class Worker:
    """A reachability worker that stores questions; the tests call `place` to answer them."""

    made: list[Worker]

    def __init__(
        self,
        _: object,
        place: Callable[[Question, np.ndarray], None],
        answer: Callable[[Reachability], None] | None = None,
    ) -> None:
        self.asked: list[Question] = []
        self.place, self.close = place, lambda: None
        self.made.append(self)

    def ask(self, question: Question) -> None:
        self.asked.append(question)


def page_of(
    scene: Any, ready: Ready, post: Callable[..., object], later: Callable[..., object] = print
) -> Any:
    """Returns what the 3D view of a page needs."""
    return SimpleNamespace(
        client=SimpleNamespace(scene=scene),
        ready=ready,
        robot=ready.robot,
        colours={},
        settings=ready.settings,
        post=post,
        loop=SimpleNamespace(call_later=later),
        poses_or_still=lambda: np.tile(TIP, (len(ready.robot.joint_names) + 1, 1)),
    )


def hand_in(
    scene: Any, ready: Ready, post: Callable[..., object], clamp: bool, later: Callable[..., object]
) -> Hand:
    """Returns the dragged target of a scene."""
    targets = {task.name: task.raw for task in ready.tasks if task.raw is not None}
    target = draggable(ready.tasks)
    assert target is not None
    switch: Any = SimpleNamespace(value=clamp)
    return Hand(page_of(scene, ready, post, later), target, targets, switch)


class Held:
    """A dragged target with its scene and the events that it posted."""

    def __init__(self, ready: Ready, clamp: bool) -> None:
        self.posted: list[tuple[Event, ...]] = []
        self.waiting: list[tuple[float, Callable[[], None]]] = []
        self.scene: Any = Scene()
        self.targets = {task.name: task.raw for task in ready.tasks if task.raw is not None}
        self.start = self.targets["position"]
        post = lambda *events: self.posted.append(events)  # noqa: E731
        later = lambda *call: self.waiting.append((call[0], partial(*call[1:])))  # noqa: E731
        self.hand = hand_in(self.scene, ready, post, clamp, later)
        (self.judge,) = Worker.made

    def drag(self, place: np.ndarray) -> None:
        self.scene.nodes["/target"].position = place
        self.scene.nodes["/target/turn"].wxyz = np.array([0.0, 1.0, 0.0, 0.0])
        self.scene.moved()

    def take(self) -> dict[str, tuple[float, ...]]:
        """Returns the targets posted since the last call, by task. They are posted together."""
        assert len(self.posted) <= 1
        events = [each for together in self.posted for each in together]
        posted = {each.task: each.value for each in events if isinstance(each, MoveTarget)}
        assert len(posted) == len(events)
        self.posted.clear()
        return posted


@pytest.fixture(scope="module")
def ready() -> Iterator[Ready]:
    body = SimulationRunner(SceneChoice(RunSpec("iiwa14-hold")))
    yield body.ready()
    body.close()


@pytest.fixture
def held(ready: Ready, monkeypatch: pytest.MonkeyPatch) -> Callable[[bool], Held]:
    Worker.made = []
    monkeypatch.setattr(drag, "ReachabilityWorker", Worker)
    return lambda clamp: Held(ready, clamp)


def test_without_the_clamp_nothing_waits(held: Callable[[bool], Held]) -> None:
    one = held(False)
    one.drag(FAR)
    assert one.take() == {"position": (5.0, 0.0, 0.0), "orientation": pytest.approx((1.0, 0.0, 0.0, 0.0))}
    one.judge.place(one.judge.asked[-1], np.ones(3))
    assert one.take() == {} and one.waiting == []


def test_position_and_orientation_of_a_drag_act_at_one_tick(held: Callable[[bool], Held]) -> None:
    """One message contains both, so that no tick can come between them."""
    one = held(False)
    one.drag(np.array([0.5, 0.1, 0.5]))
    ((first, *also),) = one.posted
    body = SimulationRunner(SceneChoice(RunSpec("iiwa14-hold")))
    body.tick(3)
    body.handle(Post(first, tuple(each for each in also if isinstance(each, MoveTarget))))
    body.tick()
    assert [(t, event.task) for t, event in body.session.log if isinstance(event, MoveTarget)] == [
        (pytest.approx(0.003), "position"),
        (pytest.approx(0.003), "orientation"),
    ]
    body.close()


def test_a_check_that_fails_is_told_of_and_the_next_one_works(
    ready: Ready, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """The panel says that the target could not be checked. The controller gets no target that was not
    checked, and a later drag moves the robot again."""
    placed: list[np.ndarray] = []
    answers: Queue[Reachability] = Queue()
    worker = ReachabilityWorker(ready.robot, lambda _, place: placed.append(place), answers.put)
    here = Question(TIP[:3], None, ready.robot.tip)
    with monkeypatch.context() as patch:
        patch.setattr(ReachJudge, "solve", lambda *_: 1 / 0)
        worker.ask(here)
        verdict = answers.get(timeout=30.0)
    assert not verdict.reachable and not placed
    panel = MagicMock()
    for clamped, words in ((True, "switch off Keep within reach"), (False, "your point unchanged")):
        StartPanel.show_verdict(panel, verdict, clamped)
        assert "could not be checked (ZeroDivisionError" in panel._where.content
        assert words in panel._where.content
    worker.ask(here)
    assert answers.get(timeout=30.0).reachable and np.allclose(placed, TIP[:3])
    worker.close()
    assert "ZeroDivisionError" in capfd.readouterr().err


def test_within_reach_both_come_when_the_judge_answers(held: Callable[[bool], Held]) -> None:
    one = held(True)
    one.drag(FAR)
    assert one.take() == {}
    one.judge.place(one.judge.asked[-1], 0.1 * FAR)
    assert one.take() == {"position": (0.5, 0.0, 0.0), "orientation": pytest.approx((1.0, 0.0, 0.0, 0.0))}
    one.waiting[-1][1]()
    assert one.take() == {}


def test_a_slow_judge_is_not_waited_for_long_and_the_target_stays_within_reach(
    held: Callable[[bool], Held],
) -> None:
    """After a short wait the orientation is posted with the controller's present position; the reachable
    position is posted when the answer arrives."""
    one = held(True)
    one.drag(FAR)
    seconds, then = one.waiting[-1]
    assert seconds <= 0.05
    then()
    assert one.take() == {
        "position": pytest.approx(tuple(one.start)),
        "orientation": pytest.approx((1.0, 0.0, 0.0, 0.0)),
    }
    one.judge.place(one.judge.asked[-1], 0.1 * FAR)
    assert one.take() == {"position": (0.5, 0.0, 0.0)}


def test_what_the_judge_says_after_a_reset_moves_nothing(held: Callable[[bool], Held]) -> None:
    one = held(True)
    one.drag(FAR)
    one.hand.after_reset(one.targets)
    one.judge.place(one.judge.asked[-1], 0.1 * FAR)
    one.waiting[-1][1]()
    assert one.take() == {}


def test_a_drag_that_arrives_while_the_panel_is_rebuilt_is_dropped(held: Callable[[bool], Held]) -> None:
    one = held(True)
    one.hand.remove()
    one.drag(FAR)
    assert one.take() == {}


def test_targets_from_before_the_axes_were_changed_are_not_drawn(held: Callable[[bool], Held]) -> None:
    """Neither a status from before the change nor an earlier moment that the user looks back to moves the
    drawn target."""
    one = held(True)
    before = {"position": np.array([0.3]), "orientation": np.eye(3)}
    one.hand.after_reset(before)
    assert one.scene.nodes["/target"].position == pytest.approx(one.start)
    one.hand.look_back(before)
    assert one.scene.nodes["/target"].visible


class Hasty(Scene):
    """A scene whose controls are moved as soon as somebody listens: the browser draws them before the rest is
    there, and drags arrive on viser's loop while another thread still builds."""

    def _listen(self, back: Any) -> Any:
        super()._listen(back)
        self.moved()
        return back


@pytest.mark.usefixtures("held")
def test_a_drag_that_arrives_while_its_handle_is_built_does_no_harm(ready: Ready) -> None:
    scene: Any = Hasty()
    moved = MagicMock()
    page = page_of(scene, ready, moved)
    page.colours = {task.level: JOINTS[0] for task in ready.tasks}
    Goal(page, next(task for task in ready.tasks if task.kind == "position"), moved)
    _Solid(scene, 0, Ball("ball", (0.0, 0.0, 0.0), 0.1), moved)
    arms = SimulationRunner(SceneChoice(RunSpec("baxter-hold"))).ready()
    Targets(page_of(scene, arms, moved), arms.tasks, moved)
    assert moved.call_count == 4  # of the goal, of the obstacle, and of the two targets
    hand_in(scene, ready, moved, True, moved)


def test_keys_move_and_turn_the_target_as_a_drag_does(held: Callable[[bool], Held]) -> None:
    """A key moves the target along an axis by a given distance, or turns it about an axis by a given
    angle."""
    one = held(False)
    (target,) = one.hand.movables()
    at = target.place()
    assert at is not None and target.move is not None and target.turn is not None
    assert np.allclose(at, one.start)
    target.move(at + np.array([0.0, 0.01, 0.0]))
    assert one.take()["position"] == pytest.approx((at[0], at[1] + 0.01, at[2]))
    assert np.allclose(one.scene.nodes["/target"].position, at + np.array([0.0, 0.01, 0.0]))
    before = one.scene.nodes["/target/turn"].wxyz
    target.turn(np.array([0.0, 0.0, np.radians(5.0)]))
    x, y, z, w = one.take()["orientation"]
    assert 2 * np.degrees(np.arccos(abs(np.dot((w, x, y, z), before)))) == pytest.approx(5.0)


def test_keys_too_keep_the_target_within_reach(held: Callable[[bool], Held]) -> None:
    one = held(True)
    (target,) = one.hand.movables()
    assert target.move is not None
    target.move(FAR)
    assert one.take() == {}
    one.judge.place(one.judge.asked[-1], 0.1 * FAR)
    assert one.take()["position"] == (0.5, 0.0, 0.0)


def test_a_line_with_its_length_leads_from_the_hand_to_a_small_target(
    held: Callable[[bool], Held], ready: Ready
) -> None:
    one = held(False)
    ball, line, label = (one.scene.nodes[name] for name in ("/target/ball", "/way", "/target/label"))
    assert 0.025 <= ball.radius <= 0.03 and ball.opacity <= 0.5 and ball.color not in (*LEVELS, *JOINTS)
    row = np.full(ready.layout.size, np.nan)
    for hand, words in (
        (one.start - [0.0, 0.123, 0.0], "123 mm to go"),
        (one.start, "target: pull an arrow"),
    ):
        row[ready.layout.fields["x/position"]] = hand
        one.hand.show(MagicMock(), row, "")
        assert label.text == words
        assert line.visible == ("to go" in words)
    one.hand.show(MagicMock(), row, "paused: press Run")
    assert label.text == "paused: press Run"


def test_a_paused_robot_says_which_button_goes_on() -> None:
    """The label at the target names the button that the page offers at that moment."""
    asked = Lecture(LessonPlace("a-redundant-arm"), "waiting", 0, 0.0, 1.0)
    guessed = Lecture(LessonPlace("a-redundant-arm", 2), "waiting", 0, 0.0, 1.0)
    graded = Lecture(LessonPlace("one-task", 4), "waiting", 0, 0.0, 1.0)
    for lecture, words in (
        (None, "paused: press Run"),
        (asked, "paused: answer first"),
        (replace(asked, answer=0), "paused: press Run this step"),
        (replace(asked, phase="done", attempt=1), "paused: press Run"),
        (guessed, "paused: press Run this step"),
        (graded, "paused: press Start the run"),
    ):
        assert paused_words(lecture) == words


def test_target_and_arrows_have_the_size_of_the_robot() -> None:
    text = Path("lessons/course/lamp.urdf").read_text()
    lamp = load_urdf_text(text)
    small = load_urdf_text(re.sub(r'(?<=origin xyz=")[^"]+', lambda found: halved(found[0]), text))
    assert gizmo_size(small) == pytest.approx(0.5 * gizmo_size(lamp), rel=1e-6)
    assert 0.006 < target_radius(small) < target_radius(lamp) <= 0.03


def halved(numbers: str) -> str:
    return " ".join(str(0.5 * float(number)) for number in numbers.split())
