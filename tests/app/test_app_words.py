"""The messages that a browser may send. All others are refused; pages keep working, and nothing is
printed."""

from __future__ import annotations

import asyncio
import math
import warnings
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import msgspec
import numpy as np
import pytest
from served import served
from viser import _messages
from viser.infra._messages import wire_field_names

from app.client.recording import History
from app.link.choice import SceneChoice
from app.tab.context import PageContext
from app.tab.mirror import Bindings
from app.view.camera import look, turn
from app.view.robot import aim
from app.web import inlet
from app.worker.simulation import SimulationRunner
from benchmarks.hostile import attack
from browsing.wire import Wire, camera, eventually
from lessons.scenes.run_spec import RunSpec
from robots import load_robot

NONE = np.zeros((0, 3))
CAMERA = vars(camera())
GIZMO = {"name": "/target", "wxyz": (1.0, 0, 0, 0), "position": (0.5, 0, 0.5), "owner": ""}
WRITE = {"uuid": "a", "updates": {"value": 1}}
DRAG = {
    "phase": "start",
    "name": "/robot/1/shape0",
    "instance_index": None,
    "start_position": (0, 0, 0),
    "start_screen_pos": (0.5, 0.5),
    "end_position": (0, 0, 1),
    "end_screen_pos": (0.5, 0.5),
    "button": "left",
    "modifier": None,
    "owner": "",
}


def said(kind: object, *parts: dict[str, Any]) -> bytes:
    return msgspec.msgpack.encode(
        {"type": kind, **{name: each for part in parts for name, each in part.items()}}
    )


@pytest.mark.parametrize(
    "kind", [*inlet.Small.__args__, *inlet.File.__args__], ids=lambda kind: kind.__name__
)
def test_every_word_is_one_of_visers(kind: Any) -> None:
    """Every message class has exactly the fields of viser's class."""
    of_viser = wire_field_names(getattr(_messages, kind.__name__))
    assert set(kind.__struct_fields__) == set(of_viser)


@pytest.mark.parametrize(
    ("kind", "parts"),
    [
        ("ViewerCameraMessage", {}),
        ("ViewerCameraMessage", {"image_height": 0, "image_width": 0}),
        ("TransformControlsUpdateMessage", GIZMO),
        ("TransformControlsDragEndMessage", {"name": "/target", "owner": ""}),
        ("SceneNodeDragMessage", DRAG),
        ("GuiUpdateMessage", WRITE),
        ("CommandTriggerMessage", {"uuid": "a"}),
    ],
)
def test_what_a_page_says_is_taken(kind: str, parts: dict[str, Any]) -> None:
    assert inlet.refusal(said(kind, CAMERA if kind.startswith("Viewer") else {}, parts)) is None


@pytest.mark.parametrize(
    ("kind", "parts"),
    [
        *(("ViewerCameraMessage", {name: (bad, 0.0, 0.0)}) for name in ("position", "look_at", "up_direction")
          for bad in (math.nan, math.inf, 1e7, "word", None)),
        ("ViewerCameraMessage", {"look_at": CAMERA["position"]}),
        ("ViewerCameraMessage", {"up_direction": (0.0, 0.0, 0.0)}),
        ("ViewerCameraMessage", {"position": (1.0, 2.0)}),
        *(("ViewerCameraMessage", {"fov": bad}) for bad in (0.0, -1.0, math.nan, 4.0)),
        *(("ViewerCameraMessage", {"image_height": bad}) for bad in (-1, 0.5, math.nan, 10**12)),
        ("TransformControlsUpdateMessage", {**GIZMO, "wxyz": (0.0, 0.0, 0.0, 0.0)}),
        ("TransformControlsUpdateMessage", {**GIZMO, "wxyz": (math.nan, 0.0, 0.0, 0.0)}),
        ("TransformControlsUpdateMessage", {**GIZMO, "position": (1e308, 0.0, 0.0)}),
        ("TransformControlsUpdateMessage", {**GIZMO, "name": "x" * 2000}),
        ("SceneNodeDragMessage", {**DRAG, "phase": "hold"}),
        ("SceneNodeDragMessage", {**DRAG, "end_position": (math.inf, 0.0, 0.0)}),
        ("GuiUpdateMessage", {"uuid": 5, "updates": 7}),
        ("GuiUpdateMessage", {**WRITE, "excluded_self_client": 1}),
        ("GuiUpdateMessage", {"uuid": "a", "updates": {"value": "x" * 3_000_000}}),
        ("GuiFormDirtyMessage", {"uuid": "a"}),
        ("RunJavascriptMessage", {"source": "alert(1)"}),
        ("ShareUrlRequest", {}),
        ("no such message", {}),
        (None, {}),
    ],
)  # fmt: skip
def test_everything_else_is_refused(kind: str | None, parts: dict[str, Any]) -> None:
    assert inlet.refusal(said(kind, CAMERA if str(kind).startswith("Viewer") else {}, parts)) is not None


@pytest.mark.parametrize("raw", [b"", b"\xc1", b"\x91" * 100_000, b"\x80", said("x")[:-1]])
def test_what_is_no_message_is_refused(raw: bytes) -> None:
    assert inlet.refusal(raw) is not None


# ---------------------------------------------------------------- a page


@pytest.mark.parametrize(
    ("scene", "seconds"),
    [
        ("planar3-hold", 3.0),
        pytest.param("ridgeback-ur10-drag", 60.0, marks=pytest.mark.nightly("app/", "benchmarks/hostile.py")),
    ],
)
def test_a_hostile_user_stops_nothing(scene: str, seconds: float) -> None:
    """The page survives `benchmarks.hostile` without a fault: invalid values for all kinds of controls, odd
    cameras while a scene is built, drags of what is replaced, broken uploads, and bytes that are no
    message."""
    found = attack(scene, seconds, seed=3)
    assert found.faults == []
    assert found.rows > 0 and sum(found.actions.values()) > 10


def test_what_is_written_before_there_is_a_session_is_checked(capfd: pytest.CaptureFixture[str]) -> None:
    """Invalid values are also refused on the page that says that all places are taken."""
    with served() as server, Wire(server.link) as first, Wire(server.link) as second:
        assert eventually(lambda: any(page.find("Try again") for page in (first, second)))
        page = first if first.find("Try again") else second
        page.write(str(page.find("Try again")), no_such_thing=1)
        assert eventually(lambda: "Not changed" in [title for title, _ in page.notices])
    assert "Traceback" not in capfd.readouterr().err


def test_what_strangers_send_reaches_no_other_page_and_no_terminal() -> None:
    """Invalid messages of a page are neither broadcast nor printed; viser would broadcast that a form was
    changed, even if the form does not exist."""
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        with served() as server, Wire(server.link) as page:
            assert eventually(lambda: page.find("Upload a URDF") is not None)
            kept = len(server._viser._websock_server._broadcast_buffer.message_from_id)
            for number in range(20):
                page.say(_messages.GuiFormDirtyMessage(f"form {number}"))
            button = str(page.find("Upload a URDF"))
            page.say(_messages.FileTransferStartUpload(button, "t", "r.urdf", "text/xml", 1, 1000))
            page.say(_messages.FileTransferPart(button, "t", 0, b"short"))
            assert eventually(lambda: "Not taken" in [title for title, _ in page.notices])
            assert len(server._viser._websock_server._broadcast_buffer.message_from_id) == kept
    assert not [each for each in heard if "[viser]" in str(each.message)]


def test_what_goes_while_it_is_used_is_told_of(capfd: pytest.CaptureFixture[str]) -> None:
    """The callback of a drag, or of a press, writes to what was removed meanwhile: the user gets a notice,
    and no traceback is printed."""
    with served() as server, Wire(server.link) as page:
        assert eventually(lambda: page.shows("every command, searchable"))
        (client,) = server._viser.get_clients().values()
        arrows = client.scene.add_transform_controls("/goes")
        ball = client.scene.add_icosphere("/ball")
        button, text = client.gui.add_button("Rebuild me"), client.gui.add_html("")
        text.remove()

        @arrows.on_update
        async def _(_: object) -> None:
            ball.remove()
            ball.position = (0.0, 0.0, 1.0)

        @button.on_click
        async def _(_: object) -> None:
            text.content = "too late"

        def told() -> int:
            return [title for title, _ in page.notices].count("Not taken")

        assert eventually(lambda: "/goes" in page.controls_3d)
        page.turn("/goes", (0.0, 0.0, 0.0, 1.0))
        assert eventually(lambda: told() == 1)

        def pressed() -> bool:  # there is at most one notice every few seconds
            page.use("Rebuild me")
            return told() == 2

        assert eventually(pressed)
    assert "Traceback" not in capfd.readouterr().err


# ---------------------------------------------------------------- single functions


class Camera:
    """The camera of a page whose canvas has a size. It raises ValueError where viser does."""

    fov, up_direction = 0.9, (0.0, 0.0, 1.0)

    def __init__(self, width: int, height: int, position: Any, look_at: Any) -> None:
        self.image_width, self.image_height = width, height
        self._position, self._look_at = np.asarray(position, float), np.asarray(look_at, float)

    @property
    def aspect(self) -> float:
        return self.image_width / self.image_height

    @property
    def position(self) -> np.ndarray:
        return self._position

    @position.setter
    def position(self, value: np.ndarray) -> None:
        if not np.isfinite(value).all() or np.array_equal(value, self._look_at):
            raise ValueError
        self._position = np.asarray(value, float)

    @property
    def look_at(self) -> np.ndarray:
        return self._look_at

    @look_at.setter
    def look_at(self, value: np.ndarray) -> None:
        if not np.isfinite(value).all() or np.array_equal(value, self._position):
            raise ValueError
        self._look_at = np.asarray(value, float)


@pytest.mark.parametrize(("width", "height"), [(0, 0), (900, 0), (0, 900), (900, 600)])
@pytest.mark.parametrize("phone", [False, True])
def test_a_robot_is_looked_at_whatever_the_canvas(width: int, height: int, phone: bool) -> None:
    seen: Any = Camera(width, height, np.ones(3), np.zeros(3))
    aim(seen, load_robot("planar3"), phone, NONE)
    assert np.linalg.norm(seen.position - seen.look_at) < 100.0


def test_a_camera_that_looks_at_where_it_is_is_turned_all_the_same() -> None:
    seen: Any = Camera(900, 600, np.ones(3), np.ones(3))
    look(seen, np.eye(3), False, None)
    assert np.isfinite(seen.position).all()


@pytest.mark.parametrize("position", [(5.0, 5.0, 5.0), (0.0, 0.0, 0.0), (-1.0, 0.0, 0.0)])
def test_a_camera_that_looks_at_where_it_will_be_is_turned(position: tuple[float, ...]) -> None:
    eye, at = np.array([1.0, 0.0, 0.0]), np.zeros(3)
    seen: Any = Camera(900, 600, position, eye)
    turn(seen, eye, at)
    assert np.array_equal(seen.position, eye) and np.array_equal(seen.look_at, at)


def test_poses_of_another_scene_are_none_of_this_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """The next scene, whose robot has other joints, arrives while the page is still the one of the scene
    before. This page gets no poses of the new robot."""
    robot, now = load_robot("iiwa14"), object()
    block = SimpleNamespace(poses=lambda: np.ones((4, 7)))
    learner = SimpleNamespace(ready=now, read=lambda look: look(block, None))
    ready = SimpleNamespace(robot=robot)
    mock = MagicMock()
    monkeypatch.setattr("app.tab.context.InView", mock)  # it sends a script to the browser
    made: Any = (mock, learner, ready, {}, mock, False, mock, mock, None, mock)
    page = PageContext(*made)
    assert page.poses() is None
    assert page.poses_or_still().shape == (robot.n + 1, 7)
    learner.ready = ready
    assert page.poses() is not None


def test_a_control_that_goes_before_it_is_written_is_no_news() -> None:
    class Gone:
        """A control that was removed."""

        def __init__(self) -> None:
            object.__setattr__(self, "value", 1)

        def on_update(self, back: Any) -> Any:
            return back

        def __setattr__(self, name: str, value: object) -> None:
            raise RuntimeError(f"Cannot assign to {name!r} on a removed GuiSliderHandle.")

    loop, heard = asyncio.new_event_loop(), list[Any]()
    loop.set_exception_handler(lambda _, context: heard.append(context))
    bindings: Bindings[int] = Bindings(lambda _: None, loop)
    gone: Any = Gone()
    bindings.bind(gone, lambda settings: settings, lambda _: None)  # pyright: ignore[reportArgumentType]
    bindings.refresh(2)
    loop.call_soon(loop.stop)
    with ThreadPoolExecutor(1) as elsewhere:  # the browser of other tests has an event loop on this thread
        elsewhere.submit(loop.run_forever).result()
    loop.close()
    assert heard == []


def test_the_newest_row_does_not_keep_all_that_came_with_it() -> None:
    """As a view, the row would keep all rows in memory until the next call, up to 12 MB per robot."""
    body = SimulationRunner(SceneChoice(RunSpec("planar3-hold")))
    history = History(body.block, body.session.layout)
    body.tick(50)
    history.pull()
    body.close()
    assert history.latest.base is None and np.isfinite(history.latest[0])
