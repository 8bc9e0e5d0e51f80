"""A page without a browser: it uses viser's protocol and stores the page's content, but draws nothing."""

from __future__ import annotations

import http.client
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from socket import SO_RCVBUF, SOL_SOCKET, socket
from typing import Any, Self
from urllib.parse import urlsplit

import msgspec
import zstandard
from viser import __version__, _messages
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

_HEAD = 16  # bytes of the header: the sizes of the messages, raw and compressed


def messages_of(raw: bytes) -> list[dict[str, Any]]:
    """Returns the messages in a packet, with placeholders instead of arrays."""
    size, packed = (int.from_bytes(raw[at : at + 8], "little") for at in (0, 8))
    inner = zstandard.ZstdDecompressor().decompress(raw[_HEAD : _HEAD + packed], max_output_size=size)
    return msgspec.msgpack.decode(inner)["messages"]


def pack(message: _messages.Message) -> bytes:
    """Serialises a message for the server."""
    return msgspec.msgpack.encode(message.as_serializable_dict())


def let_in(link: str) -> str:
    """Opens a link of `PageServer` and returns the cookie that the server sets, as a browser sends it; "" if
    the server sets no cookie."""
    parts = urlsplit(link)
    connection = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=30)
    connection.request("GET", f"/?{parts.query}")
    answer = connection.getresponse()
    connection.close()
    return (answer.headers["Set-Cookie"] or "").partition(";")[0]


def nothing_kept(request: str) -> _messages.LocalStorageGetItemResponseMessage:
    """Returns the answer of a new browser, which has stored nothing."""
    return _messages.LocalStorageGetItemResponseMessage(None, None, request)


class Wire:
    """A connection that answers the server's requests to a page (camera, empty local storage).

    Attributes:
        controls: controls on the page by id: the message that created the control, with later updates.
        commands: commands of the palette by id.
        made: all controls that were ever created, in order, including removed ones.
        controls_3d: owners of the arrows and rings in the 3D view by name.
        meshes: owners of the objects in the 3D view that can be clicked and dragged, by name.
        notices: (title, body) of every notification.
        standing: (title, body) of the notifications that are still shown, by id.
        nodes: kinds of the objects in the 3D view by name.
        scripts: the scripts that the server sent.
        eye: the last camera position that the server sent, m.
    """

    longest_wait = 60.0
    """The time, s, in which a control must appear that is used."""

    def __init__(self, url: str, headers: Mapping[str, str] | None = None, slow: bool = False) -> None:
        """headers: further headers of the handshake, from the browser or a proxy. slow: emulates a slow line,
        on which some kilobytes wait at most."""
        protocol: Any = [f"viser-v{__version__}"]
        self.controls: dict[str, dict[str, Any]] = {}
        self.commands: dict[str, dict[str, Any]] = {}
        self.made: list[dict[str, Any]] = []
        self.controls_3d: dict[str, str] = {}
        self.meshes: dict[str, str] = {}
        self.notices: list[tuple[str, str]] = []
        self.standing: dict[str, tuple[str, str]] = {}
        self.nodes: dict[str, str] = {}
        self.scripts: list[str] = []
        self.eye: tuple[float, ...] = ()
        # Browsers send no pings, and a busy machine would answer them too late.
        self._socket = connect(
            url.replace("http", "ws", 1),
            sock=_slow_line(url) if slow else None,
            subprotocols=protocol,
            max_size=None,
            max_queue=1 if slow else 16,
            ping_interval=None,
            additional_headers=dict(headers or {}),
        )
        self.say(camera())
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()
        self._reader.join(5.0)

    def say(self, message: _messages.Message) -> None:
        """Sends a message as a browser does."""
        self._socket.send(pack(message))

    def send(self, raw: bytes) -> None:
        """Sends arbitrary data."""
        self._socket.send(raw)

    def write(self, uuid: str, /, **updates: Any) -> None:
        """Changes attributes of a control, as its input changes `value`."""
        self.say(_messages.GuiUpdateMessage(uuid, updates))

    def use(self, label: str, value: object = True) -> None:
        """Writes the value of the control with a label, as a user does, as soon as there is such a control.
        True presses a button."""
        if not eventually(lambda: self.find(label) is not None, self.longest_wait):
            raise LookupError(f"the page has no control {label!r}")
        self.write(str(self.find(label)), value=value)

    def turn(self, node: str, xyzw: Sequence[float]) -> None:
        """Turns the rings of a node in the 3D view to an orientation."""
        x, y, z, w = (float(part) for part in xyzw)
        owner = self.controls_3d[node]
        self.say(_messages.TransformControlsUpdateMessage(node, (w, x, y, z), (0.0, 0.0, 0.0), owner))

    def press_key(self, hotkey: str) -> None:
        """Triggers the command with a hotkey."""
        found = next(uuid for uuid, each in self.commands.items() if each["hotkey"] == hotkey)
        self.say(_messages.CommandTriggerMessage(found))

    def find(self, label: str) -> str | None:
        """Returns the id of the control with a label, or None."""
        shown = list(self.controls.items())
        return next((uuid for uuid, each in shown if each["props"].get("label") == label), None)

    def begins(self, words: str) -> str | None:
        """Returns the id of the first control whose label begins with these words, or None."""
        shown = list(self.controls.items())
        labels = ((uuid, str(each["props"].get("label", ""))) for uuid, each in shown)
        return next((uuid for uuid, label in labels if label.startswith(words)), None)

    def folders(self, words: str) -> int:
        """Returns how many controls were created whose label begins with these words."""
        return sum(str(each["props"].get("label", "")).startswith(words) for each in list(self.made))

    def shows(self, text: str) -> bool:
        """Returns whether the page shows a text."""
        shown = [each for each in list(self.controls.values()) if each["props"].get("visible", True)]
        return any(text in str(each["props"].get("content", "")) for each in shown)

    def _read(self) -> None:
        with suppress(ConnectionClosed):
            while True:
                raw = self._socket.recv()
                if isinstance(raw, bytes):
                    self._hear(raw)

    def _hear(self, raw: bytes) -> None:
        """Takes the messages in a packet."""
        for message in messages_of(raw):
            self._take(message)

    def _take(self, message: dict[str, Any]) -> None:
        kind: str = message["type"]
        if "name" in message and "props" in message:
            self.nodes[message["name"]] = kind
        match kind:
            case "LocalStorageGetItemRequestMessage":
                self.say(nothing_kept(message["request_uuid"]))
            case "RegisterCommandMessage":
                self.commands[message["uuid"]] = message["props"]
            case "RemoveCommandMessage":
                self.commands.pop(message["uuid"], None)
            case "NotificationShowMessage" | "NotificationUpdateMessage":
                props = message.get("props", message)
                self.notices.append((str(props.get("title")), str(props.get("body"))))
                self.standing[message["uuid"]] = self.notices[-1]
            case "RemoveNotificationMessage":
                self.standing.pop(message["uuid"], None)
            case "RunJavascriptMessage":
                self.scripts.append(message["source"])
            case "SetCameraPositionMessage":
                self.eye = tuple(message["position"])
            case "TransformControlsMessage":
                self.controls_3d[message["name"]] = message["owner"]
            case "MeshMessage":
                self.meshes[message["name"]] = message["owner"]
            case "RemoveSceneNodeMessage":
                self.nodes.pop(message["name"], None)
            case "ResetGuiMessage":
                self.controls.clear()
            case "GuiRemoveMessage":
                self.controls.pop(message["uuid"], None)
            case "GuiUpdateMessage" if message["uuid"] in self.controls:
                self._update(self.controls[message["uuid"]], message["updates"])
            case _ if kind.startswith("Gui") and "props" in message and "uuid" in message:
                self.controls[message["uuid"]] = message
                self.made.append(message)
            case _:
                pass

    @staticmethod
    def _update(control: dict[str, Any], updates: dict[str, Any]) -> None:
        for name, value in updates.items():
            (control if name == "value" else control["props"])[name] = value


def _slow_line(url: str) -> socket:
    line, address = socket(), urlsplit(url)
    line.setsockopt(SOL_SOCKET, SO_RCVBUF, 8192)
    line.connect((address.hostname, address.port))
    return line


def eventually(condition: Callable[[], bool], timeout: float = 40.0) -> bool:
    """Waits for a condition; returns whether it became true."""
    end = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


def camera() -> _messages.ViewerCameraMessage:
    """Returns the first message of every page, by which the server recognises the client as a page."""
    return _messages.ViewerCameraMessage(
        wxyz=(1.0, 0.0, 0.0, 0.0),
        position=(2.0, -2.0, 1.5),
        fov=0.9,
        near=0.01,
        far=100.0,
        image_height=900,
        image_width=1440,
        look_at=(0.0, 0.0, 0.5),
        up_direction=(0.0, 0.0, 1.0),
    )
