"""The controls of a page, used by its protocol as a browser uses them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import viser
from served import LONG, served, vacated, visited
from viser import _messages

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from app.link.messages import MissionView, Post
from app.panels.widgets.command import CAMERA_KEYS
from app.tab.comfort import MOTION, REDUCED
from app.web.server import PageServer
from browsing.wire import Wire, eventually
from himpc.catalog import CONTROLLERS
from lessons.events import MoveTarget, Reset
from lessons.scenes.run_spec import RunSpec
from lessons.settings.velocity import VelocitySettings


@pytest.fixture(scope="module")
def running() -> Iterator[PageServer]:
    with served("iiwa14-hold", grace=0.0) as server:
        yield server


@pytest.fixture
def server(running: PageServer) -> PageServer:
    return vacated(running)


def learner_of(server: PageServer) -> SimulationClient:
    assert eventually(lambda: bool(server.sessions.learners), LONG)
    return server.sessions.learners[0]


def shown(wire: Wire, label: str) -> str:
    """Returns the id of the control with this label, as soon as it exists."""
    assert eventually(lambda: wire.find(label) is not None, LONG), label
    return str(wire.find(label))


def test_where_a_posture_wants_the_joints_is_set_by_sliders(server: PageServer) -> None:
    """Each joint has a slider in degrees within its limits. Sliders that are moved at the same time do not
    overwrite each other, and a reset restores them."""
    with Wire(server.link) as wire:
        learner = learner_of(server)

        def target() -> np.ndarray:
            status = learner.status
            return np.zeros(7) if status is None else np.degrees(status.targets["posture"])

        first, second = (shown(wire, f"joint {number}, °") for number in (1, 2))
        assert [wire.controls[first]["props"][end] for end in ("min", "max")] == [-170.0, 170.0]
        assert eventually(lambda: learner.status is not None, LONG)
        before = target()
        assert wire.controls[second]["value"] == pytest.approx(before[1], abs=0.051)
        wire.write(first, value=20.0)
        wire.write(second, value=15.5)
        assert eventually(lambda: np.allclose(target()[:2], [20.0, 15.5]), LONG)
        assert np.allclose(target()[2:], before[2:])
        told = learner.ask()
        assert told is not None
        assert [event.task for _, event in told.log if isinstance(event, MoveTarget)] == ["posture"] * 2
        learner.send(Post(Reset()))
        assert eventually(lambda: np.allclose(target(), before), LONG)
        assert eventually(lambda: wire.controls[first]["value"] == pytest.approx(before[0], abs=0.051), LONG)
        assert wire.find("x, °") is None and wire.notices == []


def test_where_a_posture_wants_what_slides_is_set_in_metres() -> None:
    """The slider of a base joint without limits has a range of 2 m to each side."""
    run = RunSpec("ridgeback-ur10-hold", set=('stack.add={"task": "posture"}',))
    with visited(SceneChoice(run)) as (wire, learner):
        slider = shown(wire, "base_x, m")
        assert [wire.controls[slider]["props"][end] for end in ("min", "max")] == [-2.0, 2.0]
        wire.write(slider, value=0.3)

        def wanted() -> float:
            return 0.0 if learner.status is None else float(learner.status.targets["posture"][0])

        assert eventually(lambda: wanted() == pytest.approx(0.3), LONG)
        assert wire.notices == []


def test_the_menu_switches_the_controller(server: PageServer) -> None:
    """The menu offers every registered name, and the page describes the chosen one."""
    with Wire(server.link) as wire:
        menu = shown(wire, "Controller")
        assert list(wire.controls[menu]["props"]["options"]) == list(CONTROLLERS)
        learner = learner_of(server)
        for name in ("hqp", "himpc"):
            wire.write(menu, value=name)
            assert eventually(lambda name=name: getattr(learner.settings, "controller", "") == name, LONG)
            assert eventually(lambda name=name: wire.shows(CONTROLLERS[name]), LONG)


class Reader(Wire):
    """A browser whose user asked for less motion."""

    def __enter__(self) -> Reader:
        return self

    def _take(self, message: dict[str, Any]) -> None:
        if message["type"] == "LocalStorageGetItemRequestMessage" and message["key"] == MOTION:
            self.say(_messages.LocalStorageGetItemResponseMessage(REDUCED, None, message["request_uuid"]))
        else:
            super()._take(message)


def says(page: Wire, word: str) -> bool:
    """Returns whether the line has contained a word."""
    return any("textContent =" in each and word in each.lower() for each in page.scripts)


def test_a_page_without_a_mouse(server: PageServer) -> None:
    """The page begins paused, because its browser asks for less motion. A field moves the target by a
    centimetre, and a button turns it by 5°. A sentence says that the simulation runs: to
    screen readers, and on the screen if these sentences are switched on."""
    with Reader(server.link) as page:
        learner = learner_of(server)

        def targets() -> dict[str, np.ndarray]:
            return {} if learner.status is None else learner.status.targets

        assert eventually(lambda: learner.status is not None and not learner.status.running)
        assert any("prefers-reduced-motion" in each for each in page.scripts)
        x, y, start = shown(page, "Target x [m]"), shown(page, "Target y [m]"), dict(targets())
        assert eventually(lambda: page.controls[x]["value"] == pytest.approx(start["position"][0], abs=1e-3))
        assert page.controls[y]["props"]["step"] == 0.01
        assert eventually(lambda: says(page, "paused"))
        page.press_key("space")
        assert eventually(lambda: says(page, "running"))
        page.write(y, value=round(float(start["position"][1]) + 0.01, 3))
        assert eventually(lambda: targets()["position"][1] - start["position"][1] > 0.008)
        assert np.abs(targets()["position"] - start["position"]).max() < 0.012
        page.write(shown(page, "Turn"), value="+z")
        assert eventually(lambda: not np.allclose(targets()["orientation"], start["orientation"], atol=0.05))
        looks = [each for each in page.scripts if "cssText" in each and "aria-live" in each]
        assert all("width:1px" in each for each in looks), "only for screen readers"
        page.write(shown(page, "Say what happens"), value=True)
        assert eventually(lambda: "left:50%" in page.scripts[-1])


def test_tasks_are_added_released_and_settings_changed() -> None:
    """The robot moves slowly, because after 14 s the scene's own script releases the task, too."""
    with visited("ridgeback-ur10-handover") as (page, learner):
        page.use("Speed", 0.2)
        for label, value in (("δ [mm]", 25.0), ("N", 6), ("R inputs, arm", 0.05)):
            page.use(label, value)

        def adopted() -> bool:
            settings = learner.settings
            return (
                isinstance(settings, VelocitySettings)
                and (settings.htmpc.delta_m, settings.htmpc.horizon) == (0.025, 6)
                and settings.htmpc.input_effort == (0.1, 0.1, 0.1, *(0.05,) * 6)
            )

        assert eventually(adopted, LONG)

        def mission() -> MissionView:
            assert learner.status is not None and learner.status.mission is not None
            return learner.status.mission

        page.use("Release ee 1")
        assert eventually(lambda: mission().rows[1].state == "done", LONG)
        done_at = mission().rows[1].done_at
        assert done_at is not None and done_at < 13.0
        assert eventually(lambda: mission().people[0].balls == 1, LONG)
        page.use("Add")
        assert eventually(lambda: mission().rows[-1].name == "ee added", LONG)
        assert learner.failure is None and page.notices == []


def test_the_cameras_keys_are_those_of_viser() -> None:
    source = Path(viser.__file__).parent / "client" / "src" / "CameraControls.tsx"
    listed = re.search(r"CAMERA_MOVEMENT_KEYS = new Set\(\[(.*?)\]\)", source.read_text(), re.DOTALL)
    assert listed is not None
    assert {name.removeprefix("Key") for name in re.findall(r'"(\w+)"', listed[1])} == CAMERA_KEYS


@pytest.mark.parametrize(
    "choice",
    [
        SceneChoice(RunSpec("planar3-hold")),
        SceneChoice(RunSpec("ridgeback-ur10-drag")),
        SceneChoice.of_lesson(LessonPlace("deadlines")),
    ],
    ids=["torque", "velocity", "lesson"],
)
def test_every_command_has_a_key_of_its_own(choice: SceneChoice) -> None:
    with served(choice) as server, Wire(server.link) as page:
        assert eventually(lambda: page.shows("every command, searchable") and len(page.commands) >= 10)
        commands = [each for each in page.commands.values() if each["hotkey"] is not None]
        keys = [(each["hotkey"], each["modifier"]) for each in commands]
        assert len(set(keys)) == len(keys), sorted(keys)
        assert {key for key, _ in keys} & CAMERA_KEYS == set()
        shown = " ".join(str(each["props"].get("content")) for each in page.controls.values())
        table = shown[shown.index("run or pause") - 200 : shown.index("every command, searchable")]
        for key, _ in keys:
            names = {"space": "Space"} if not str(key).isdigit() else {str(key): "1 … 9"}
            assert re.search(rf"<b>[^<]*{re.escape(names.get(str(key), str(key)))}[^<]*</b>", table), key
