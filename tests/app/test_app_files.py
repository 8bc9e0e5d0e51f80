"""A page opens its learner's own files by path, and signs the work that a learner hands in."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from served import served

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.web.server import PageServer
from browsing.wire import Wire, eventually
from lessons.authoring.new import text_of
from lessons.own.files import Folder
from lessons.replay.progress import read_handed_in
from lessons.replay.state import State, decode, encode
from lessons.scenes.run_spec import RunSpec
from lessons.settings.torque import TorqueSettings
from robots import InputError

KEY = b"an instructor's key"
LONG = 120.0


@pytest.fixture
def server(tmp_path: Path) -> Iterator[PageServer]:
    with served(own_files=Folder.at(str(tmp_path)), key=KEY) as running:
        yield running


def settings(learner: SimulationClient) -> TorqueSettings:
    assert isinstance(learner.settings, TorqueSettings)
    return learner.settings


def open_file(wire: Wire, path: Path) -> None:
    wire.use("Your file", str(path))
    wire.use("Open file")


def test_files_of_ones_own_are_opened_by_path(server: PageServer, tmp_path: Path) -> None:
    """A file may contain a controller for the present scene, or a task to add. For a file with an error, the
    page shows a message of one sentence."""
    law, task, wrong = (tmp_path / f"{name}.py" for name in ("law", "task", "wrong"))
    law.write_text("def torque(now):\n    return now.bias - 10 * now.M_bar * now.q_dot\n")
    task.write_text(text_of("task", None, "task.py"))
    wrong.write_text("def torque(now)\n    return 0\n")
    with Wire(server.link) as wire:
        assert eventually(lambda: wire.shows("never uploaded"), LONG)
        learner = server.sessions.learners[0]
        open_file(wire, wrong)
        assert eventually(lambda: wire.shows("wrong.py, line 1: expected"), LONG)
        open_file(wire, tmp_path / "nothing.py")
        assert eventually(lambda: wire.shows("cannot be read"), LONG)
        open_file(wire, law)
        assert eventually(
            lambda: learner.settings is not None and learner.settings.controller == str(law), LONG
        )
        assert eventually(lambda: wire.shows("a controller of your own"), LONG)
        open_file(wire, task)
        assert eventually(lambda: bool(settings(learner).own_tasks), LONG)

        def offered() -> bool:
            uuid = wire.find("Kind")
            return uuid is not None and str(task) in wire.controls[uuid]["props"]["options"]

        assert eventually(offered, LONG)
        wire.use("Kind", str(task))
        wire.use("Add")
        assert eventually(lambda: "reach" in [level.name for level in settings(learner).levels], LONG), (
            wire.notices
        )
        assert settings(learner).controller == str(law)
        assert learner.failure is None

        task.write_text(task.read_text().replace('name="reach"', 'name="reach", frame="ee"'))
        wire.use("Robot", "panda")
        wire.use("Load robot")
        assert eventually(lambda: wire.shows("LEFT OUT"), LONG)
        assert learner.ready is not None and learner.ready.robot.name == "panda"
        assert eventually(lambda: "Opened without one of your tasks" in dict(wire.notices), LONG)


def test_a_scene_and_a_lesson_are_opened_instead(tmp_path: Path) -> None:
    here = SceneChoice(RunSpec("planar3-hold"))
    for kind in ("scene", "lesson"):
        path = tmp_path / (f"{kind}.py" if kind == "scene" else f"{kind}.md")
        path.write_text(text_of(kind, None, path.name))
        found = here.with_file(str(path)).admitting(here).resolved()
        assert found.scene().name == (str(path) if kind == "scene" else "iiwa14-hold")
    with pytest.raises(InputError, match=r"no\.py: cannot be read"):
        here.with_file(str(tmp_path / "no.py"))


def test_what_was_done_is_handed_in_with_the_labs_signature(server: PageServer) -> None:
    with Wire(server.link) as wire:
        wire.use("Your name", "Zoë")
        wire.use("Write the text")

        def text() -> str:
            return str(wire.controls[str(wire.find("To hand in"))].get("value", ""))

        assert eventually(lambda: text().startswith("hp1s-"), LONG)
        handed, proof = read_handed_in(text(), KEY)
        assert (handed.name, proof) == ("Zoë", "signed")
        assert decode(handed.code).run.scene == "planar3-hold"


def test_a_code_that_does_not_fit_is_answered_though_nobody_looks_at_the_robot_tab(
    server: PageServer,
) -> None:
    code = encode(State(RunSpec("planar3-hold", set=("horizn=3",))))
    with Wire(server.link) as wire:
        wire.use("Somebody's code", code)
        wire.use("Open it")
        assert eventually(
            lambda: any(title == "Not loaded" and "horizon" in body for title, body in wire.notices), LONG
        )
