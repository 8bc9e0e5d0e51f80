"""A user's controller file on the page: a saved file runs at once, and a wrong file gives one sentence while
the previous controller continues."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from served import LONG, visited

from app.link.choice import SceneChoice
from app.link.messages import Lead, Load, LoadRefused, Post, Ready
from app.link.process import wait_until
from app.worker import torque
from app.worker.ghost import GhostBody
from app.worker.simulation import SimulationRunner
from browsing.wire import eventually
from lessons.authoring.new import text_of
from lessons.events import Set
from lessons.own.load import judged
from lessons.replay.script import script
from lessons.replay.state import decode, encode, state_of
from lessons.scenes.run_spec import RunSpec
from lessons.settings.torque import TorqueSettings
from robots import InputError

HOLDS = "def torque(now):\n    return now.bias - 10 * now.M_bar * now.q_dot\n"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "mine.py"
    path.write_text(HOLDS)
    return path


@pytest.fixture
def body(file: Path) -> Iterator[SimulationRunner]:
    made = SimulationRunner(SceneChoice.starting("planar3-hold", controller=str(file)))
    yield made
    made.close()


def test_what_a_test_of_another_file_finds_says_nothing_about_this_file(
    body: SimulationRunner, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A saved file is still tested when the learner chooses another file. Its fault, or that it can be used,
    is not shown as that of the other file."""
    other, go_on = file.with_name("other.py"), threading.Event()
    other.write_text(HOLDS)
    choice, threads = body.choice, threading.active_count()
    body.handle(Load(replace(choice, run=replace(choice.run, files=(str(file), str(other))))))

    def waiting(code: str) -> str:
        assert go_on.wait(LONG)
        return judged(code)

    monkeypatch.setattr(torque, "judged", waiting)
    for saved in ("def broken(:\n", HOLDS + "# saved\n"):
        go_on.clear()
        body.handle(Post(Set("controller", str(file))))
        body.tick(5)
        body.status()
        file.write_text(saved)
        body.status()  # the test of the file begins
        body.handle(Post(Set("controller", str(other))))
        body.tick(5)
        body.status()
        go_on.set()
        assert wait_until(lambda: threading.active_count() <= threads, LONG)
        own = body.status().own
        assert own is not None
        assert (own.file, own.fault, own.saves) == (str(other), None, 0)
        file.write_text(HOLDS)


def test_own_code_has_a_ghost_beside_it(body: SimulationRunner, file: Path) -> None:
    """The ghost of a user's controller may be a built-in controller, and the ghost of a built-in controller
    may be a user's."""
    body.handle(Lead(True))
    begin = body.leader.script(body.session)
    assert begin is not None and begin.begin is not None
    for own in ("controller=himpc", f"controller={file}"):
        ghost = GhostBody(begin.begin, (own,))
        ghost.driver.hear((), 0.1)
        ghost.catch_up(np.inf)
        assert ghost.body.session.settings.controller == own.partition("=")[2]
        assert ghost.body.session.t == pytest.approx(0.1)
        ghost.body.close()


def test_own_code_is_switched_to_by_name_only_if_it_was_named_at_the_start(
    body: SimulationRunner, file: Path
) -> None:
    body.handle(Post(Set("controller", "himpc")))
    body.handle(Post(Set("controller", str(file))))
    body.tick(20)
    assert not body.session.notices
    other = file.with_name("other.py")
    other.write_text(HOLDS)
    body.handle(Post(Set("controller", str(other))))
    body.tick(1)
    assert "--controller FILE.py" in body.session.notices[0]
    with pytest.raises(InputError):
        SimulationRunner(SceneChoice(RunSpec("planar3-hold", set=(f"controller={file}",))))
    with pytest.raises(InputError, match="scene"):
        SimulationRunner(SceneChoice(RunSpec(str(file))))


def test_own_code_is_known_by_its_content(body: SimulationRunner, file: Path) -> None:
    """A code names the file and the digest of its content; it opens for a user who started with the same
    file."""
    state = state_of(RunSpec("planar3-hold"), body.session.settings_now)
    code = encode(state)
    with pytest.raises(InputError, match=r"add --controller mine\.py"):
        decode(code).run.prepared()
    found = replace(decode(code).run, files=(str(file),))
    assert found.prepared().settings.controller == str(file)
    text = script(state.run, (), 0.1)
    assert f"CONTROLLER = {str(file)!r}" in text
    file.write_text(HOLDS + "# changed\n")
    with pytest.raises(InputError, match="its fingerprint is"):
        found.prepared()


def test_own_code_is_told_of_at_the_top_of_the_page(file: Path) -> None:
    choice = SceneChoice.starting("planar3-hold", controller=str(file))
    with visited(choice) as (page, learner):
        assert eventually(lambda: page.shows("a controller of your own"))
        assert eventually(lambda: learner.status is not None and learner.status.own is not None)
        file.write_text("def torque(now)\n    return 1\n")
        assert eventually(lambda: page.shows("The previous code continues to run."))
        file.write_text("def torque(now):\n    return oops\n")
        assert eventually(lambda: page.shows("line 2: NameError"))
        assert page.shows("YOUR CODE")

        def faults() -> list[str]:  # visible at every position of the panel
            return [body for title, body in list(page.standing.values()) if title == "Your file"]

        assert ["line 2: NameError" in each for each in faults()] == [True]
        file.write_text("def torque(now):\n    return now.q[7]\n")
        assert eventually(lambda: ["line 2: IndexError" in each for each in faults()] == [True])
        file.write_text(HOLDS + "\n")
        assert eventually(lambda: any("took over at t" in body for _, body in page.notices))
        assert eventually(lambda: faults() == [])
        learner.load(SceneChoice(RunSpec("planar3-circle")))
        assert eventually(lambda: learner.choice.run.scene == "planar3-circle")
        assert learner.settings is not None
        assert str(file) in learner.settings.controllers


def test_a_saved_lesson_is_shown_at_the_same_step(tmp_path: Path) -> None:
    """A save that cannot be used is one sentence with line and column; the page keeps the version before."""
    file = tmp_path / "lesson.md"
    text = text_of("lesson", None, "lesson.md")
    file.write_text(text)
    with visited(SceneChoice.opening(str(file))) as (page, _):
        assert eventually(lambda: page.shows("The hand carries 2 kg"), LONG)
        file.write_text(text.replace("- run:", "- runs:"))
        assert eventually(lambda: page.shows("line 15, column 3: There is no key"), LONG)
        assert page.shows("YOUR LESSON")
        assert page.shows("The hand carries 2 kg")
        file.write_text(text.replace("The hand carries 2 kg", "The hand carries two kilograms"))
        assert eventually(lambda: page.shows("The hand carries two kilograms"), LONG)
        assert eventually(lambda: not page.shows("YOUR LESSON"), LONG)


def test_a_task_that_a_robot_cannot_have_is_left_out_there(tmp_path: Path) -> None:
    """One sentence gives the reason, and the scene opens. On a robot that has the frame, the task is
    available again. A stack that names the task is refused for the same reason."""
    path = tmp_path / "reach.py"
    path.write_text(text_of("task", None, "reach.py").replace('name="reach"', 'name="reach", frame="link_4"'))
    choice = SceneChoice.starting("iiwa14-hold", tasks=(str(path),))
    body = SimulationRunner(choice)
    try:
        assert body.ready().left_out == ()
        elsewhere = replace(choice, run=replace(choice.run, scene="planar3-hold"))
        there = body.handle(Load(elsewhere))
        assert isinstance(there, Ready) and there.robot.name == "planar3"
        assert [words in there.left_out[0] for words in ("reach.py", "link_4", "planar3")] == [True] * 3
        assert (there.choice.run.tasks, own_tasks(body)) == ((), [])
        body.tick(2)

        stack = f'stack=[{{"task": "{path}"}}]'
        refused = body.handle(Load(replace(elsewhere, run=elsewhere.run.but(stack))))
        assert isinstance(refused, LoadRefused) and "link_4" in refused.sentence
        again = body.handle(Load(choice))
        assert isinstance(again, Ready) and again.left_out == ()
        assert own_tasks(body) == [str(path)]
    finally:
        body.close()


def own_tasks(body: SimulationRunner) -> list[str]:
    assert isinstance(body.session.settings, TorqueSettings)
    return list(dict(body.session.settings.own_tasks))
