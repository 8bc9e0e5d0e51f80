"""viser's private names that `app.adapter` uses, and the classes that it puts in place of viser's. viser
documents no private name, and a new version may lack some. `pyproject.toml` admits only versions that passed
these tests."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
import viser
from viser import _messages, infra

from app.adapter import names, private
from app.adapter.private import ThreadSafeEvent, fast
from app.web.door import Door
from app.web.guard import ConnectionGuard
from robots import InputError

OF_VISER = {
    "_messages": (
        *("RunJavascriptMessage", "SetPositionMessage", "SetOrientationMessage", "Message"),
        *("GuiUpdateMessage", "ShareUrlRequest", "ShareUrlDisconnect", "FileTransferStartUpload"),
        *("LocalStorageGetItemRequestMessage", "LocalStorageGetItemResponseMessage", "FileTransferPart"),
        *("TransformControlsUpdateMessage", "SceneNodeDragMessage", "SceneNodeClickMessage"),
        "ScenePointerMessage",
    ),
    "infra.WebsockClientConnection": ("_handle_incoming_message", "get_message_buffer", "queue_message"),
    "_gui_handles._GuiHandleState": ("uuid", "value", "removed", "gui_api"),
    "_scene_handles._SceneNodeHandleState": ("name", "api", "position", "wxyz"),
    "SceneApi": ("_queue_scene_message",),
    "GuiUplotHandle": ("_queue_update",),
}
OF_A_SERVER = (
    "_websock_server._live_connections",
    "_websock_server._incoming_handlers",
    "_websock_server._client_state_from_id",
    "_websock_server._broadcast_buffer.message_event",
    "_websock_server._broadcast_buffer.message_from_id",
    "_websock_server._broadcast_buffer.window_duration_sec",
    "gui._current_file_upload_states",
    "gui._gui_input_handle_from_uuid",
    "gui._thread_executor",
    "gui._websock_interface",
    "scene._thread_executor",
    "scene._dispatch_callback",
)
OF_THE_PAGE = (
    ("MessageHandler.tsx", f'LOCAL_STORAGE_PREFIX = "{names.STORED}"'),
    ("components/common.tsx", '<Flex align="center">'),
    ("components/common.tsx", "<label htmlFor={props.uuid}>"),
    ("App.tsx", "w.__viserMutable = mutable.current"),
    ("WebsocketInterface.tsx", "viewerMutable.sendMessage = (message)"),
    ("components/UplotComponent.css", f"{names.CHART} {names.CHART_TITLE} {{"),
    ("components/UplotComponent.tsx", f" {names.CHART_BOX[1:]}`}}"),
    ("dock/FloatingWindowView.tsx", "<Paper"),
    ("dock/FloatingWindowView.tsx", 'position: "absolute"'),
    ("components/Slider.tsx", 'import { Slider, Flex, NumberInput } from "@mantine/core"'),
    ("components/Slider.tsx", "id={uuid}"),
    ("components/Button.tsx", 'import { Button } from "@mantine/core"'),
    ("components/Button.tsx", "id={uuid}"),
    ("ControlPanel/BottomPanel.tsx", 'width: "20em"'),
    ("dock/MinimizedBar.tsx", names.FOLDED_PANEL.strip("[]")),
)
"""Pairs: a file below viser's `client/src`, and a text that this file must contain."""


def reaches(start: object, path: str) -> bool:
    """Returns whether an object has the attribute, or a dataclass has the field, at a dotted path."""
    for name in path.split("."):
        if name in getattr(start, "__dataclass_fields__", ()):
            return True
        start = getattr(start, name, None)
    return start is not None


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    running = private.open_server("127.0.0.1", 0, ConnectionGuard(Door()))
    yield running
    private.stop(running)


@pytest.mark.parametrize("path", [f"{place}.{name}" for place, found in OF_VISER.items() for name in found])
def test_viser_has_the_name(path: str) -> None:
    assert reaches(viser, path)


def test_a_server_has_the_names(server: viser.ViserServer) -> None:
    assert [path for path in OF_A_SERVER if not reaches(server, path)] == []


@pytest.mark.parametrize(("file", "words"), OF_THE_PAGE)
def test_visers_page_has_what_scripts_and_styles_use(file: str, words: str) -> None:
    sources = Path(viser.__file__).parent / "client" / "src"
    assert words in (sources / file).read_text("utf-8")


def answer(port: int) -> bytes:
    with socket.create_connection(("127.0.0.1", port), timeout=10.0) as stranger:
        stranger.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        return stranger.recv(100)


def test_a_guard_that_is_not_open_refuses(server: viser.ViserServer) -> None:
    assert answer(server.get_port()).startswith(b"HTTP/1.1 503")


def test_a_viser_that_serves_in_another_way_is_not_served(monkeypatch: pytest.MonkeyPatch) -> None:
    """Requests without permission could not be refused then: the server refuses all, and ends with one
    sentence."""
    seen: list[tuple[int, bytes]] = []
    stop = private.stop

    def look_first(running: viser.ViserServer) -> None:
        seen.append((running.get_port(), answer(running.get_port())))
        stop(running)

    monkeypatch.setattr(private, "_NEEDED", ("no_such_argument",))
    monkeypatch.setattr(private, "stop", look_first)
    with pytest.raises(InputError, match="does not fit this page"):
        private.open_server("127.0.0.1", 0, ConnectionGuard(Door()))
    ((port, found),) = seen
    assert found.startswith(b"HTTP/1.1 503")
    with pytest.raises(OSError):
        answer(port)


def test_a_server_opens_no_public_tunnel(server: viser.ViserServer) -> None:
    handlers = server._websock_server._incoming_handlers
    assert not {_messages.ShareUrlRequest, _messages.ShareUrlDisconnect} & {
        kind for kind, found in handlers.items() if found
    }
    assert isinstance(server._websock_server, infra.WebsockServer)


SENT = (
    (_messages.SetPositionMessage, ("/robot/1", (0.1, -0.2, 0.3))),
    (_messages.SetOrientationMessage, ("/robot/1", (1.0, 0.0, 0.0, 0.0))),
)


@pytest.mark.parametrize(("kind", "fields"), SENT)
def test_a_plain_message_is_visers_own(kind: type[Any], fields: tuple[object, ...]) -> None:
    ours, own = fast(kind)(*fields), kind(*fields)
    assert isinstance(ours, kind) and type(ours).as_serializable_dict is not kind.as_serializable_dict
    assert ours.as_serializable_dict([]) == own.as_serializable_dict([])
    assert ours.redundancy_key() == own.redundancy_key()
    assert ours.entity_state_key() == own.entity_state_key()


class Meeting(deque[Any]):
    """Replaces an event's list of waiters. Another thread sets the event just before the first waiter starts
    to wait."""

    def __init__(self, event: asyncio.Event) -> None:
        super().__init__()
        self._event = event
        self._met = False

    def append(self, waiter: Any) -> None:
        if not self._met:
            self._met = True
            thread = threading.Thread(target=self._event.set)
            thread.start()
            thread.join()
        super().append(waiter)


async def wakes(event: asyncio.Event) -> bool:
    """Returns whether a waiter wakes up if another thread sets the event at that moment, by this call or by a
    later one."""
    event._waiters = Meeting(event)  # pyright: ignore[reportAttributeAccessIssue]
    waiter = asyncio.ensure_future(event.wait())
    await asyncio.sleep(0.1)
    asyncio.get_running_loop().call_soon_threadsafe(event.set)
    done, _ = await asyncio.wait([waiter], timeout=0.5)
    waiter.cancel()
    return bool(done)


def test_a_sender_wakes_though_it_is_called_while_it_goes_to_sleep() -> None:
    async def both() -> tuple[bool, bool]:
        return await wakes(ThreadSafeEvent(asyncio.get_running_loop())), await wakes(asyncio.Event())

    with ThreadPoolExecutor(1) as elsewhere:  # the browser of other tests has an event loop on this thread
        ours, plain = elsewhere.submit(lambda: asyncio.run(both())).result()
    assert ours
    assert not plain  # otherwise `ThreadSafeEvent` is no longer needed


def test_a_call_after_the_end_is_no_error() -> None:
    loop = asyncio.new_event_loop()
    event = ThreadSafeEvent(loop)
    loop.close()
    event.set()
    assert not event.is_set()
