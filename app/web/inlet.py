"""Everything that a browser may send: the fields, types and bounds of messages, and the values that a control
can have. All other messages are refused before viser sees them."""

from __future__ import annotations

import math
import time
import traceback
from collections.abc import Awaitable, Callable, Iterable
from typing import Annotated, Any, Literal

import msgspec
import viser
from msgspec import Meta

from app.adapter import private
from app.adapter.private import is_removed_handle_error
from app.tab.in_view import tells_what_is_seen

LONGEST = 2_000_000
"""Largest size, B, of a message without a part of a file. A text in a message of the page has at most 200,000
characters."""
_FILE = b"FileTransfer"  # in every message that begins or carries a file
_CAMERA = b"ViewerCamera"  # in messages that pages send by themselves
_LEAST = 1e-9  # m, or norm of a quaternion; a shorter vector has no direction

Name = Annotated[str, Meta(max_length=1000)]
Metres = Annotated[float, Meta(ge=-1e6, le=1e6)]
"""A coordinate of a dragged object. A point beyond these bounds is outside every scene. NaN does not satisfy
the bounds."""
Share = Annotated[float, Meta(ge=-1e6, le=1e6)]
Place = tuple[Metres, Metres, Metres]
Turn = tuple[Share, Share, Share, Share]
Whole = Annotated[int, Meta(ge=0, le=2**53)]
Pixels = Annotated[int, Meta(ge=0, le=100_000)]
Modifier = (
    Literal["cmd/ctrl", "alt", "shift", "cmd/ctrl+alt", "cmd/ctrl+shift", "alt+shift", "cmd/ctrl+alt+shift"]
    | None
)


class ViewerCameraMessage(msgspec.Struct, forbid_unknown_fields=True, tag=True, tag_field="type"):
    """The camera of the page. The size is 0 for a canvas without a layout."""

    wxyz: Turn
    position: Place
    fov: Annotated[float, Meta(gt=0.0, lt=math.pi)]
    near: Annotated[float, Meta(gt=0.0, le=1e9)]
    far: Annotated[float, Meta(gt=0.0, le=1e9)]
    image_height: Pixels
    image_width: Pixels
    look_at: Place
    up_direction: Place

    def __post_init__(self) -> None:
        if math.dist(self.position, self.look_at) < _LEAST:
            raise ValueError("the camera is at the point that it looks at")
        _has_direction(self.up_direction)


class TransformControlsUpdateMessage(msgspec.Struct, forbid_unknown_fields=True, tag=True, tag_field="type"):
    """The gizmo (arrows or rings) was moved."""

    name: Name
    wxyz: Turn
    position: Place
    owner: Name

    def __post_init__(self) -> None:
        _has_direction(self.wxyz)


class TransformControlsDragStartMessage(
    msgspec.Struct, forbid_unknown_fields=True, tag=True, tag_field="type"
):
    """A drag of the gizmo begins."""

    name: Name
    owner: Name


class TransformControlsDragEndMessage(msgspec.Struct, forbid_unknown_fields=True, tag=True, tag_field="type"):
    """A drag of the gizmo ends."""

    name: Name
    owner: Name


class SceneNodeClickMessage(msgspec.Struct, forbid_unknown_fields=True, tag=True, tag_field="type"):
    """A click on an object in the 3D view."""

    name: Name
    instance_index: Whole | None
    ray_origin: Place
    ray_direction: Place
    screen_pos: tuple[float, float]
    modifier: Modifier
    owner: Name


class SceneNodeDragMessage(msgspec.Struct, forbid_unknown_fields=True, tag=True, tag_field="type"):
    """An object in the 3D view is dragged."""

    phase: Literal["start", "update", "end"]
    name: Name
    instance_index: Whole | None
    start_position: Place
    start_screen_pos: tuple[float, float]
    end_position: Place
    end_screen_pos: tuple[float, float]
    button: Literal["left", "middle", "right"]
    modifier: Modifier
    owner: Name


class GuiUpdateMessage(msgspec.Struct, forbid_unknown_fields=True, tag=True, tag_field="type"):
    """A control was changed or pressed. The allowed values depend on the control, see `allowed`."""

    uuid: Name
    updates: Annotated[dict[str, Any], Meta(max_length=16)]


class CommandTriggerMessage(msgspec.Struct, forbid_unknown_fields=True, tag=True, tag_field="type"):
    """A key of a command was pressed, or the command was chosen in the palette."""

    uuid: Name


class LocalStorageGetItemResponseMessage(
    msgspec.Struct, forbid_unknown_fields=True, tag=True, tag_field="type"
):
    """A value from the browser's storage."""

    value: str | None
    error: str | None
    request_uuid: Name


class FileTransferStartUpload(msgspec.Struct, forbid_unknown_fields=True, tag=True, tag_field="type"):
    """An upload begins."""

    source_component_uuid: Name
    transfer_uuid: Name
    filename: Name
    mime_type: Name
    part_count: Annotated[int, Meta(ge=0, le=100_000)]
    size_bytes: Whole


class FileTransferPart(msgspec.Struct, forbid_unknown_fields=True, tag=True, tag_field="type"):
    """A part of an upload."""

    source_component_uuid: Name | None
    transfer_uuid: Name
    part_index: Whole
    content: bytes


Small = (
    ViewerCameraMessage
    | TransformControlsUpdateMessage
    | TransformControlsDragStartMessage
    | TransformControlsDragEndMessage
    | SceneNodeClickMessage
    | SceneNodeDragMessage
    | GuiUpdateMessage
    | CommandTriggerMessage
    | LocalStorageGetItemResponseMessage
)
File = FileTransferStartUpload | FileTransferPart

_SMALL, _FILES = msgspec.msgpack.Decoder(Small | File), msgspec.msgpack.Decoder(File)


def refusal(raw: bytes) -> str | None:
    """Returns the reason, as a sentence, why a message is refused; "" if it is refused without a notice, None
    if it is valid."""
    decoder = _SMALL if len(raw) <= LONGEST else _FILES if _FILE in raw else None
    if decoder is None:
        return f"The message is too long: a page may send at most {LONGEST // 1000} kB at once."
    try:
        decoder.decode(raw)
    except msgspec.ValidationError as error:
        return "" if _CAMERA in raw else f"A page cannot send this message: {error}."[:300]
    except (msgspec.DecodeError, RecursionError):
        return "A page cannot send this message."
    return None


def _has_direction(vector: tuple[float, ...]) -> None:
    if math.hypot(*vector) < _LEAST:
        raise ValueError("it has no direction")


LONGEST_TEXT = 200_000
"""Largest number of characters of a text."""
_OFTEN = 2.0  # s between two notices of one page
_GONE = "The page was rebuilt before your click or change arrived: if the control is still there, try again."


class NotAllowed(Exception):
    """A value is refused; the message says which value and why."""


def allowed(handle: viser.GuiInputHandle[Any], updates: Any) -> Any:
    """Returns the value of an update; a slider's value is limited to its range. Raises NotAllowed if the
    update changes more than the value, or if the control cannot have this value."""
    label = str(getattr(handle, "label", "") or "A control")
    if not isinstance(updates, dict) or list(updates) != ["value"]:
        raise NotAllowed(f"{label}: a page can only change the value of this control.")
    value = updates["value"]
    if isinstance(handle, viser.GuiUploadButtonHandle):
        raise NotAllowed(f"{label}: upload a file instead of writing a value.")
    options = getattr(handle, "options", None)
    if options is not None:
        if not isinstance(value, str) or value not in options:
            raise NotAllowed(f"{label}: choose one of {', '.join(map(str, options))[:300]}.")
        return value
    value = _like(handle.value, value, label)
    low, high = getattr(handle, "min", None), getattr(handle, "max", None)
    if isinstance(handle, viser.GuiSliderHandle):
        return min(max(value, low), high)
    return _within(value, low, high, label)


def _like(present: Any, value: Any, label: str) -> Any:
    """Returns the value if it has the type of the present value; raises NotAllowed otherwise."""
    match present:
        case bool():
            if isinstance(value, bool):
                return value
            raise NotAllowed(f"{label}: give True or False.")
        case int() | float():
            return _number(value, label)
        case str():
            if isinstance(value, str) and len(value) <= LONGEST_TEXT:
                return value
            raise NotAllowed(f"{label}: give a text of at most {LONGEST_TEXT} characters.")
        case tuple():
            if isinstance(value, (list, tuple)) and len(value) == len(present):
                return tuple(_like(old, new, label) for old, new in zip(present, value, strict=True))
            raise NotAllowed(f"{label}: give {len(present)} numbers.")
        case _:
            raise NotAllowed(f"{label}: the page cannot change this control.")


def _number(value: Any, label: str) -> int | float:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    # A whole number may be too large for a float.
    if number and abs(value) <= 1e300 and math.isfinite(value):
        return value
    raise NotAllowed(f"{label}: give a number.")


def _within(value: Any, low: Any, high: Any, label: str) -> Any:
    for one, least, most in zip(_each(value), _ends(low), _ends(high), strict=False):
        if (least is not None and one < least) or (most is not None and one > most):
            ends = [f"at least {low}"] * (low is not None) + [f"at most {high}"] * (high is not None)
            raise NotAllowed(f"{label}: give {' and '.join(ends)}.")
    return value


def _each(value: Any) -> Iterable[Any]:
    return value if isinstance(value, tuple) else (value,)


def _ends(end: Any) -> Iterable[Any]:
    return end if isinstance(end, tuple) else (end,) * 4


class Inlet:
    """Checks the messages of one page. If a control cannot have a value, the inlet refuses the value, shows a
    notice and resets the control. It also shows a notice for a press on a removed control and for an
    exception in a callback."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._next_notice = 0.0
        private.intercept(client, self._take)

    async def _take(self, message: Any, go_on: Callable[[Any], Awaitable[None]]) -> None:
        try:
            match private.kind_of(message):
                case "write":
                    await self._write(message, go_on)
                case "upload" if not private.control_of(self._client, message.source_component_uuid):
                    self.say("Not taken", _GONE)
                case _:
                    await go_on(message)
        except Exception as error:
            if is_removed_handle_error(error):
                self.say("Not taken", _GONE)
                return
            traceback.print_exc()
            self.say("That did not work", f"{type(error).__name__}: {error}"[:300])

    async def _write(self, message: Any, go_on: Callable[[Any], Awaitable[None]]) -> None:
        handle = private.control_of(self._client, message.uuid)
        if handle is None:
            if not tells_what_is_seen(message.updates):
                self.say("Not taken", _GONE)
            return
        try:
            value = allowed(handle, message.updates)
        except NotAllowed as refusal:
            self.say("Not changed", str(refusal))
            private.send_again(handle)
            return
        typed, message.updates = message.updates["value"], {"value": value}
        await go_on(message)
        if isinstance(handle, viser.GuiSliderHandle) and typed != value:
            private.send_again(handle)

    def say(self, title: str, sentence: str) -> None:
        """Shows a notice, but at most one every few seconds."""
        now = time.monotonic()
        if now >= self._next_notice:
            self._next_notice = now + _OFTEN
            self._client.add_notification(title, sentence, color="orange", auto_close_seconds=8.0)
