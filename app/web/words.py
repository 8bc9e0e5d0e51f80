"""The messages that a browser may send: their fields, types and bounds. No other message is passed on to
viser."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

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
    """A control was changed or pressed. The allowed values depend on the control, see `app.web.inlet`."""

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
