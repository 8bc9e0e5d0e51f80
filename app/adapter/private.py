"""viser's private names: no other file touches them. `self_test` looks at each before anything is served.

A seam that is gone is one clear sentence and no server, never a server without its door.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import socket
import threading
import uuid
import warnings
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Literal

import numpy as np
import viser
import websockets.asyncio.server as web
from websockets.asyncio.server import ServerConnection

from app.adapter.fast_messages import fast
from app.adapter.probe import answer, reaches, refuse, require
from app.adapter.removed_handle_errors import call
from app.adapter.thread_safe_event import ThreadSafeEvent
from robots import InputError

try:
    from viser import _messages, infra
except ImportError as error:
    raise InputError(
        f"viser {viser.__version__} is not the one this page was made for ({error}): install 1.1"
    ) from None

Guard = Callable[[Mapping[str, Any]], dict[str, Any]]
"""From the keywords viser gives to websockets' `serve` to those we give."""

_SERVING = threading.Lock()
_NEEDED = ("process_request", "max_size")

_UNSENT = 32_000
"""Bytes that may wait in the machine's own buffer; its usual megabytes are seconds of old pictures."""

_OF_MODULES = (
    (_messages, ("RunJavascriptMessage", "SetPositionMessage", "SetOrientationMessage")),
    (_messages, ("GuiUpdateMessage", "ShareUrlRequest", "ShareUrlDisconnect", "Message")),
    (_messages, ("LocalStorageGetItemRequestMessage", "LocalStorageGetItemResponseMessage")),
    (_messages, ("FileTransferStartUpload", "FileTransferPart", "ScenePointerMessage")),
    (_messages, ("TransformControlsUpdateMessage", "SceneNodeDragMessage", "SceneNodeClickMessage")),
    (infra.WebsockClientConnection, ("_handle_incoming_message",)),
)
_OF_A_SERVER = (
    "_websock_server._live_connections",
    "_websock_server._incoming_handlers",
    "_websock_server._client_state_from_id",
    "_websock_server._broadcast_buffer.message_event",
    "_websock_server._broadcast_buffer.window_duration_sec",
    "gui._current_file_upload_states",
    "gui._gui_input_handle_from_uuid",
    "gui._thread_executor",
    "scene._thread_executor",
    "scene._dispatch_callback",
)


def open_server(host: str, port: int, guard: Guard) -> viser.ViserServer:
    """A viser server that listens behind `guard`, opens no tunnel to strangers and never falls asleep. Raises
    InputError if it cannot be guarded; then nothing listens."""
    self_test(guard)
    # What strangers send wrong is no news for the terminal.
    warnings.filterwarnings("ignore", r"\[viser\]", UserWarning)
    # viser greets with a panel of its own; we promise exactly one line.
    with contextlib.redirect_stdout(io.StringIO()), _guarded(guard) as served:
        server = viser.ViserServer(host=host, port=port, label="himpc-lab", verbose=False)
    try:
        require(served == [True], "how it serves")
        for path in _OF_A_SERVER:
            require(reaches(server, path), path)
        handlers = server._websock_server
        # Any client could ask for a public tunnel to this machine, button or not.
        for tunnel in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
            handlers.unregister_handler(tunnel)
        _keep_awake(server)
    except BaseException:
        stop(server)
        raise
    return server


def stop(server: viser.ViserServer) -> None:
    """Ends it, silently."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def self_test(guard: Guard) -> None:
    """Whether viser is still the one we know, and refuses what a guard that is not open yet refuses: on a
    server of its own that nothing stands behind, on this machine only. Raises InputError."""
    for module, names in _OF_MODULES:
        for name in names:
            require(hasattr(module, name), name)
    with contextlib.redirect_stdout(io.StringIO()), _guarded(guard) as served:
        bare = infra.WebsockServer("127.0.0.1", 0, message_class=_messages.Message, verbose=False)
        bare.start()
        try:
            refused = answer(bare._port).startswith(b"HTTP/1.1 503")
        finally:
            bare.stop()
    require(served == [True] and refused, "how it serves")


@contextlib.contextmanager
def _guarded(guard: Guard) -> Iterator[list[bool]]:
    """Whatever viser serves meanwhile is served through `guard`. Yields one entry for each time, False where
    `guard` did not fit: then every request is refused."""
    served: list[bool] = []
    plain = web.serve

    def serve(*given: Any, **keywords: Any) -> Any:
        # Nothing may be raised here: viser would wait for its server for ever.
        try:
            if missing := [name for name in _NEEDED if name not in keywords]:
                raise KeyError(*missing)
            changed = guard(keywords)
        except Exception:
            served.append(False)
            return plain(*given, **{**keywords, "process_request": refuse})
        served.append(True)
        return plain(*given, **changed)

    with _SERVING:
        web.serve = serve  # pyright: ignore[reportAttributeAccessIssue]
        try:
            yield served
        finally:
            web.serve = plain


def _keep_awake(server: viser.ViserServer) -> None:
    """Before a sender first sleeps; viser makes one for all clients and one for each, which then waits for
    nothing after what woke it: a picture comes in one piece."""
    websockets, loop = server._websock_server, server.get_event_loop()
    websockets._broadcast_buffer.message_event = ThreadSafeEvent(loop)

    async def keep(connection: infra.WebsockClientConnection) -> None:
        buffer = connection.get_message_buffer()
        buffer.message_event, buffer.window_duration_sec = ThreadSafeEvent(loop), 0.0

    websockets.on_client_connect(keep)


def senders(server: viser.ViserServer) -> list[asyncio.Event]:
    """What wakes each of them: of all clients together, then of each."""
    websockets = server._websock_server
    each = [one.message_buffer for one in list(websockets._client_state_from_id.values())]
    return [buffer.message_event for buffer in (websockets._broadcast_buffer, *each)]


# ---------------------------------------------------------------- one client


def connection_of(server: viser.ViserServer, client: viser.ClientHandle) -> ServerConnection | None:
    """What carries a client; None if it has left."""
    return server._websock_server._live_connections.get(client.client_id)


def give_workers(client: viser.ClientHandle, workers: ThreadPoolExecutor) -> None:
    """This client's callbacks run on `workers` from now on, where they keep no other client's waiting."""
    client.gui._thread_executor = workers
    client.scene._thread_executor = workers


def unfinished_uploads(client: viser.ClientHandle) -> int:
    """Bytes that have come of files that are not complete."""
    return sum(one["transferred_bytes"] for one in list(client.gui._current_file_upload_states.values()))


def forget_upload(client: viser.ClientHandle, transfer: str) -> None:
    """Drops what has come of a file; parts of it that still come are dropped, too."""
    client.gui._current_file_upload_states.pop(transfer, None)


async def read_storage(
    client: viser.ClientHandle, keys: Sequence[str], timeout: float
) -> tuple[str | None, ...]:
    """What the browser keeps under each key; None where it keeps nothing, may not say, or does not answer in
    so many seconds. Waits on the loop, where it keeps nobody else waiting."""
    connection = client._websock_connection
    loop = asyncio.get_running_loop()
    asked: dict[str, asyncio.Future[str | None]] = {uuid.uuid4().hex: loop.create_future() for _ in keys}

    def hear(_: int, answer: _messages.LocalStorageGetItemResponseMessage) -> None:
        future = asked.get(str(answer.request_uuid))
        if future is not None and not future.done():
            future.set_result(answer.value if isinstance(answer.value, str) else None)

    connection.register_handler(_messages.LocalStorageGetItemResponseMessage, hear)
    try:
        for key, request in zip(keys, asked, strict=True):
            connection.queue_message(_messages.LocalStorageGetItemRequestMessage(key, request))
        client.flush()
        await asyncio.wait(asked.values(), timeout=timeout)
    finally:
        connection.unregister_handler(_messages.LocalStorageGetItemResponseMessage, hear)
    return tuple(future.result() if future.done() else None for future in asked.values())


def run_script(client: viser.ClientHandle, source: str) -> None:
    """Runs JavaScript in the page."""
    client._websock_connection.queue_message(_messages.RunJavascriptMessage(source))


def waiting(client: viser.ClientHandle) -> int:
    """Messages that its line has not taken yet."""
    return len(client._websock_connection.get_message_buffer().message_from_id)


def keep_short(server: viser.ViserServer, client: viser.ClientHandle) -> None:
    """Lets the line take no more than it soon delivers, so that what waits can still be replaced by what is
    newer."""
    live = connection_of(server, client)
    if live is None or not hasattr(socket, "TCP_NOTSENT_LOWAT"):
        return
    line = live.transport.get_extra_info("socket")
    with contextlib.suppress(OSError):  # gone already
        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, _UNSENT)


# ---------------------------------------------------------------- what a browser says

Inlet = Callable[[Any, Callable[[Any], Awaitable[None]]], Awaitable[None]]
"""Takes a message, and what hands one on to viser."""


def intercept(client: viser.ClientHandle, take: Inlet) -> None:
    """Every message of this browser goes to `take` first, and what its callbacks raise comes back there: of
    those of the 3D view viser would print it."""
    connection, scene = client._websock_connection, client.scene
    plain = connection._handle_incoming_message

    async def handle(client_id: Any, message: Any) -> None:
        await take(message, lambda passed: plain(client_id, passed))

    connection._handle_incoming_message = handle
    scene._dispatch_callback = lambda cb, event: call(cb, event, scene._thread_executor)


Kind = Literal["write", "upload", "other"]


def kind_of(message: Any) -> Kind:
    """Whether it changes a control (`uuid`, `updates`), begins a file (for `source_component_uuid`), or is
    anything else."""
    match message:
        case _messages.GuiUpdateMessage():
            return "write"
        case _messages.FileTransferStartUpload():
            return "upload"
        case _:
            return "other"


# ---------------------------------------------------------------- one control, one node of the scene


def control_of(client: viser.ClientHandle, uuid: object) -> viser.GuiInputHandle[Any] | None:
    """A control of this page that is still there."""
    found = client.gui._gui_input_handle_from_uuid.get(uuid) if isinstance(uuid, str) else None
    return None if found is None or found._impl.removed else found  # pyright: ignore[reportReturnType]


def dom_id(handle: viser.GuiInputHandle[Any] | viser.GuiUploadButtonHandle) -> str:
    """A control's id in the browser's document."""
    return handle._impl.uuid


def send_again(handle: viser.GuiInputHandle[Any]) -> None:
    """The control's value once more; assigning it would send nothing, since viser knows it already."""
    control = handle._impl
    update = _messages.GuiUpdateMessage(control.uuid, {"value": control.value})
    control.gui_api._websock_interface.queue_message(update)


def send_curves(chart: viser.GuiUplotHandle, arrays: Sequence[np.ndarray]) -> None:
    """New curves for a chart, abscissas first, as they are; assigning them would send double precision."""
    chart._queue_update("data", tuple(np.ascontiguousarray(each) for each in arrays))


def shift(node: viser.SceneNodeHandle, at: np.ndarray) -> None:
    """Moves a node, (3,) m; assigning compares at length with what was."""
    node._impl.position[:] = at
    node._impl.api._queue_scene_message(fast(_messages.SetPositionMessage)(node.name, tuple(at.tolist())))


def turn(node: viser.FrameHandle, to: np.ndarray) -> None:
    """Turns a node, wxyz."""
    node._impl.wxyz[:] = to
    node._impl.api._queue_scene_message(fast(_messages.SetOrientationMessage)(node.name, tuple(to.tolist())))
