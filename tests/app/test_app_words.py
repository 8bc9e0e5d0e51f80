"""What a browser may send: messages, and values of controls. All else is refused in a sentence; pages keep
working, and nothing is printed."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import Any

import msgspec
import pytest
import viser
from served import served
from viser import _messages
from viser.infra._messages import wire_field_names

from app.web import inlet
from app.web.inlet import NotAllowed, allowed
from benchmarks.hostile import attack
from browsing.wire import Wire, camera, eventually

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


def message(kind: str | None, parts: dict[str, Any]) -> bytes:
    """Returns a message whose fields are right but for `parts`."""
    return said(kind, CAMERA if str(kind).startswith("Viewer") else {}, parts)


@pytest.mark.parametrize(
    "kind", [*inlet.Small.__args__, *inlet.File.__args__], ids=lambda kind: kind.__name__
)
def test_every_word_is_one_of_visers(kind: Any) -> None:
    """Every message class has exactly the fields of viser's class."""
    of_viser = wire_field_names(getattr(_messages, kind.__name__))
    assert set(kind.__struct_fields__) == set(of_viser)


TAKEN = (
    ("ViewerCameraMessage", {}),
    ("ViewerCameraMessage", {"image_height": 0, "image_width": 0}),
    ("TransformControlsUpdateMessage", GIZMO),
    ("TransformControlsDragEndMessage", {"name": "/target", "owner": ""}),
    ("SceneNodeDragMessage", DRAG),
    ("GuiUpdateMessage", WRITE),
    ("CommandTriggerMessage", {"uuid": "a"}),
)
REFUSED = (
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
)  # fmt: skip


def test_what_a_page_says_is_taken_and_nothing_else() -> None:
    for each in TAKEN:
        assert inlet.refusal(message(*each)) is None, each
    for each in REFUSED:
        assert inlet.refusal(message(*each)) is not None, each
    for raw in (b"", b"\xc1", b"\x91" * 100_000, b"\x80", said("x")[:-1]):
        assert inlet.refusal(raw) is not None, raw


# ---------------------------------------------------------------- values of controls

VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 3.7, math.nan, math.inf, -math.inf, 1e308, -1e308, 2**63 - 1, 10**400, "",
    "word", "nan", "12", "x" * 300_000, [], [1], [1, 2], [1, 2, 3], [1, 2, 3, 4], [math.nan] * 3, ["a"],
    [[1]], {}, {"a": 1}, b"bytes",
)  # fmt: skip
NAMES = (
    "label", "visible", "disabled", "order", "hint", "options", "min", "max", "step", "precision", "content",
    "uuid", "gui_api", "props", "removed", "update_cb", "sync_cb", "is_button", "parent_container_id",
    "update_timestamp", "hold_cbs_from_freq", "_impl", "__class__", "no_such_thing",
)  # fmt: skip


def test_every_control_takes_values_of_its_kind_only(viser_server: viser.ViserServer) -> None:
    """A value that is taken has the type of the present one, is finite, and lies within the control's
    range."""
    gui: Any = viser_server.gui
    slider, number = gui.add_slider("N", 1, 30, 1, 5), gui.add_number("Q", 2.0, min=0.0, max=1e6)
    menu, group = gui.add_dropdown("Solver", ("a", "b")), gui.add_button_group("Playback", ("Run", "Step"))
    upload = gui.add_upload_button("Upload a URDF")
    free = gui.add_number("Speed", 1.0)
    controls: tuple[tuple[Any, Callable[[Any], bool]], ...] = (
        (slider, lambda value: 1 <= value <= 30),
        (number, lambda value: 0.0 <= value <= 1e6),
        (free, math.isfinite),
        (gui.add_checkbox("Damping", True), lambda value: isinstance(value, bool)),
        (gui.add_text("Its name", "x"), lambda value: isinstance(value, str) and len(value) < 300_000),
        (gui.add_vector3("Gains", (1.0, 1.0, 1.0)), lambda value: all(map(math.isfinite, value))),
        (gui.add_button("Add"), lambda value: isinstance(value, bool)),
        (menu, lambda value: value in ("a", "b")),
        (group, lambda value: value in ("Run", "Step")),
        (upload, lambda _: False),
    )
    for control, right in controls:
        taken = 0
        for value in VALUES:
            try:
                found = allowed(control, {"value": value})
            except NotAllowed as refusal:
                assert str(refusal).endswith(".") and len(str(refusal)) < 500
            else:
                taken += 1
                assert right(found) and (isinstance(found, bool) is isinstance(control.value, bool)), value
        assert taken < len(VALUES) / 2
        for name in NAMES:
            for updates in ({name: 1}, {"value": control.value, name: 1}):
                with pytest.raises(NotAllowed, match="can only change the value"):
                    allowed(control, updates)
        for updates in ({}, 7, None, ["value"]):
            with pytest.raises(NotAllowed):
                allowed(control, updates)


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
