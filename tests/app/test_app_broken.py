"""Pages that are rebuilt or fail: every press has an effect or a message, and a failed page can be
restarted."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import pytest
from served import served, visited

from app.client.moment import Moment
from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from app.link.messages import Load
from app.page.page import Page
from app.page.scene_view import SceneView
from app.panels.run.help import HelpPanel
from app.tab.in_view import AWAKE, LABEL
from browsing.wire import Wire, eventually
from lessons.course import load_lesson
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.prediction import Choice
from tests.robots.arms import joint, link, two_joint_arm

NEXT = LessonPlace("deadlines")


def test_the_next_lesson_is_built_once_so_that_no_answer_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a slow computer the next lesson is loaded while the page still writes the texts of this one. The
    page is built once for the next lesson: if it were shown at once and then built again, presses in between
    would be lost."""
    leaving, writing, write = threading.Event(), threading.Event(), SceneView._write
    pages: list[Wire] = []

    def slow(stage: SceneView, moment: Moment) -> None:
        learner = stage._learner
        late = leaving.is_set() and stage.page.ready.choice.exercise == LessonPlace("one-task")
        if late:
            writing.set()
            eventually(lambda: learner.lecture is not None and learner.lecture.exercise == NEXT)
        write(stage, moment)
        if late:
            # the browser already shows the next lesson
            eventually(lambda: any(answers(page) for page in pages), 3.0)

    monkeypatch.setattr(SceneView, "_write", slow)
    with served(SceneChoice.of_lesson(LessonPlace("one-task"))) as server, Wire(server.link) as page:
        pages.append(page)
        assert eventually(lambda: page.shows(load_lesson("one-task").steps[0].title))
        learner = server.sessions.learners[0]
        leaving.set()
        assert writing.wait(40.0)
        learner.send(Load(SceneChoice.of_lesson(NEXT)))
        assert eventually(lambda: page.shows(load_lesson("deadlines").steps[0].title))
        assert eventually(lambda: answers(page) != [] and page.shows("t = "))
        asked = answers(page)[0]
        page.write(asked, value=True)
        assert eventually(lambda: learner.lecture is not None and learner.lecture.answer == 1)
        assert eventually(lambda: "your answer" in page.controls[asked]["props"]["label"])
        assert answers(page) == [asked]


def answers(page: Wire) -> list[str]:
    """Returns all controls, existing or removed, that answer the first step of the lesson on deadlines."""
    prediction = load_lesson("deadlines").steps[0].prediction
    assert isinstance(prediction, Choice)
    words = f"B   {prediction.options[1].text}"
    return [each["uuid"] for each in page.made if str(each["props"].get("label", "")).startswith(words)]


def test_what_is_pressed_on_a_page_that_is_gone_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    with visited() as (page, learner):
        assert eventually(lambda: page.find("Playback") is not None)
        before = page.find("Playback")
        assert before is not None
        learner.send(Load(SceneChoice(RunSpec("ridgeback-ur10-drag"))))
        assert eventually(lambda: page.find("Playback") not in (None, before))
        said = len(page.notices)
        told = next(each["uuid"] for each in page.made if each["props"].get("label") == LABEL)
        # the page itself sends this message, without a press
        page.write(told, value=f"{AWAKE}\nErrors")
        page.write(before, value="Pause")
        assert eventually(lambda: any("was rebuilt" in body for _, body in page.notices))
        assert len(page.notices) == said + 1


@pytest.mark.parametrize("place", [(HelpPanel, "_fill"), (SceneView, "_write"), (Page, "_pass_on")])
def test_a_page_that_fails_says_so_and_can_be_started_again(
    place: tuple[type, str], monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    owner, name = place
    works, broken = getattr(owner, name), threading.Event()

    def fails(self: Any, *given: Any) -> Any:
        if not broken.is_set():
            raise ValueError("no <place> for it")
        return works(self, *given)

    monkeypatch.setattr(owner, name, fails)
    with served() as server, Wire(server.link) as page:
        assert eventually(lambda: page.shows("no &lt;place&gt; for it"))
        again = page.find("Start again")
        assert again is not None and page.find("Playback") is None
        broken.set()
        page.write(again, value=True)
        assert eventually(lambda: page.shows("Running"))
        learner = server.sessions.learners[0]
        assert isinstance(learner, SimulationClient) and learner.failure is None
    assert "no <place> for it" in capfd.readouterr().err  # the log shows the place of the error


def test_a_robot_whose_tip_has_the_name_of_a_joint_is_shown(tmp_path: Path) -> None:
    """The joint that ends a small arm, and the link behind it, are often both named after the gripper."""
    file = tmp_path / "arm.urdf"
    file.write_text(two_joint_arm(link("gripper") + joint("gripper", "l2", "gripper", "fixed", "")))
    choice = SceneChoice(RunSpec("hold", urdf=str(file), tip="gripper"))
    with visited(choice) as (page, _):
        assert eventually(lambda: page.shows("Running"))
