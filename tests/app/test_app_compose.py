"""Changes of the hierarchy by a page's controls, without a browser: the simulation applies them."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import numpy as np
import pytest

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.messages import Post
from app.link.process import wait_until
from app.panels.torque.task_editor import AddTask
from app.web.server import PageServer
from browsing.wire import Wire
from himpc.tasks.axes import OnAxes
from lessons.events import MoveTarget, Reset
from lessons.replay.state import decode, encode, state_of
from lessons.scenes.run_spec import RunSpec
from lessons.settings.torque import TorqueSettings

pytestmark = pytest.mark.usefixtures("one_fork_server")

LONG = 60.0


@pytest.fixture
def server() -> Iterator[PageServer]:
    running = PageServer(SceneChoice(RunSpec("iiwa14-hold")), port=0, max_sessions=1, grace=2.0)
    yield running
    running.close()


def settings(learner: SimulationClient) -> TorqueSettings:
    assert isinstance(learner.settings, TorqueSettings)
    return learner.settings


def levels(learner: SimulationClient) -> list[str]:
    return [level.name for level in settings(learner).levels]


def shown(wire: Wire, label: str, at: int = 0) -> str:
    """Returns the id of one of the controls with this label, counted from the top, as soon as it exists."""

    def found() -> list[str]:
        return [uuid for uuid, each in list(wire.controls.items()) if each["props"].get("label") == label]

    assert wait_until(lambda: len(found()) > at, LONG), label
    return found()[at]


def choose(wire: Wire, label: str, value: str, at: int = 0) -> None:
    wire.write(shown(wire, label, at), value=value)


def press(wire: Wire, label: str) -> None:
    wire.write(shown(wire, label), value=True)


def test_a_task_is_added_moved_reduced_merged_split_and_removed(server: PageServer) -> None:
    """The panel shows every change, the code of the stack gives the same stack elsewhere, and the robot keeps
    running."""
    with Wire(server.link) as wire:
        assert wait_until(lambda: bool(server.sessions.learners), LONG)
        learner = server.sessions.learners[0]

        def are(*names: str) -> bool:
            return wait_until(lambda: levels(learner) == list(names), LONG)

        choose(wire, "Of frame", "link_4")
        choose(wire, "Its name", "elbow")
        assert wait_until(lambda: learner.settings is not None, LONG)
        press(wire, "Add")
        assert are("position", "elbow", "orientation", "posture")
        shown(wire, "Remove elbow")
        assert wait_until(lambda: wire.shows("2/3 free"), LONG)

        wire.press_key("4")  # before, this key belonged to no level
        assert wait_until(lambda: not settings(learner).levels[3].enabled, LONG)
        wire.press_key("9")
        wire.press_key("4")
        assert wait_until(lambda: settings(learner).levels[3].enabled, LONG)

        choose(wire, "Axes", "y", at=1)
        assert wait_until(lambda: axes(learner, "elbow") == "y", LONG)
        assert wait_until(lambda: wire.shows("1/1 free"), LONG)
        choose(wire, "Level elbow", "▲")
        assert are("elbow", "position", "orientation", "posture")
        before = settings(learner)
        assert decode(encode(state_of(RunSpec("iiwa14-hold"), before))).run.prepared().settings == before

        press(wire, "Merge with the level above")
        assert wait_until(lambda: len(levels(learner)) == 3, LONG)
        press(wire, "Own level for elbow")
        assert wait_until(lambda: wire.find("Own level for elbow") is None, LONG)
        press(wire, "Remove elbow")
        assert are("position", "orientation", "posture")
        assert wait_until(lambda: wire.find("Remove elbow") is None, LONG)
        assert learner.failure is None and learner.status is not None
        t = learner.status.t
        assert wait_until(lambda: learner.status is not None and learner.status.t > t + 0.1, LONG)
        assert wire.notices == []


def test_where_a_posture_wants_the_joints_is_set_by_sliders(server: PageServer) -> None:
    """Each joint has a slider in degrees within its limits. Sliders that are moved at the same time do not
    overwrite each other, and a reset restores them."""
    with Wire(server.link) as wire:
        assert wait_until(lambda: bool(server.sessions.learners), LONG)
        learner = server.sessions.learners[0]

        def target() -> np.ndarray:
            status = learner.status
            return np.zeros(7) if status is None else np.degrees(status.targets["posture"])

        first, second = (shown(wire, f"joint {number}, °") for number in (1, 2))
        assert [wire.controls[first]["props"][end] for end in ("min", "max")] == [-170.0, 170.0]
        assert wait_until(lambda: learner.status is not None, LONG)
        before = target()
        assert wire.controls[second]["value"] == pytest.approx(before[1], abs=0.051)
        wire.write(first, value=20.0)
        wire.write(second, value=15.5)
        assert wait_until(lambda: np.allclose(target()[:2], [20.0, 15.5]), LONG)
        assert np.allclose(target()[2:], before[2:])
        told = learner.ask()
        assert told is not None
        assert [event.task for _, event in told.log if isinstance(event, MoveTarget)] == ["posture"] * 2
        learner.send(Post(Reset()))
        assert wait_until(lambda: np.allclose(target(), before), LONG)
        assert wait_until(lambda: wire.controls[first]["value"] == pytest.approx(before[0], abs=0.051), LONG)
        assert wire.find("x, °") is None and wire.notices == []


def test_where_a_posture_wants_what_slides_is_set_in_metres() -> None:
    """The slider of a base joint without limits has a range of 2 m to each side."""
    run = RunSpec("ridgeback-ur10-hold", set=('stack.add={"task": "posture"}',))
    server = PageServer(SceneChoice(run), port=0, max_sessions=1, grace=2.0)
    try:
        with Wire(server.link) as wire:
            slider = shown(wire, "base_x, m")
            assert [wire.controls[slider]["props"][end] for end in ("min", "max")] == [-2.0, 2.0]
            learner = server.sessions.learners[0]
            assert wait_until(lambda: learner.status is not None, LONG)
            wire.write(slider, value=0.3)

            def wanted() -> float:
                return 0.0 if learner.status is None else float(learner.status.targets["posture"][0])

            assert wait_until(lambda: wanted() == pytest.approx(0.3), LONG)
            assert wire.notices == []
    finally:
        server.close()


def test_a_control_may_be_written_after_its_panel_was_rebuilt(
    server: PageServer, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """A callback that runs after its controls were removed ends without an error message."""
    begun, rebuilt, ended = (threading.Event() for _ in range(3))
    show = AddTask._show

    def slowly(panel: AddTask) -> None:
        if threading.current_thread().name.startswith("page_"):
            begun.set()
            rebuilt.wait(LONG)
            try:
                show(panel)
            finally:
                ended.set()
        else:
            show(panel)

    monkeypatch.setattr(AddTask, "_show", slowly)
    with Wire(server.link) as wire:
        choose(wire, "Kind", "com")
        assert begun.wait(LONG)
        press(wire, "Add")
        shown(wire, "Remove com")
        rebuilt.set()
        assert ended.wait(LONG)
        choose(wire, "Kind", "damping")  # its callback runs after the other one has ended
        assert wait_until(lambda: wire.shows("all joints come to rest"), LONG)
    said = capfd.readouterr()
    assert "removed" not in said.err + said.out


def axes(learner: SimulationClient, name: str) -> str:
    tasks = (task for level in settings(learner).levels for task in level.tasks if task.name == name)
    found = next(tasks)
    assert isinstance(found, OnAxes)
    return found.axes
