"""All uses of viser's private names. A test (tests/app/test_app_viser.py) checks that viser has them, and
`pyproject.toml` admits only versions that have them. docs/house.md says what viser could offer instead."""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import io
import socket
import sys
import threading
import traceback
import uuid
import warnings
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import fields
from functools import cache
from http import HTTPStatus
from typing import Any, Literal

import numpy as np
import rich
import viser
import websockets.asyncio.server as web
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from robots import InputError

_LATE = " on a removed "


def is_removed_handle_error(error: BaseException) -> bool:
    """Returns whether an exception is viser's refusal to write to a removed control or node. Such an
    exception can be ignored, as the page does not show that control or node any more."""
    return isinstance(error, RuntimeError) and _LATE in str(error)


def unless_removed(fn: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
    """Calls a function and returns its result; None if the function wrote to a removed control or node."""
    try:
        return fn(*args, **kwargs)
    except RuntimeError as error:
        if not is_removed_handle_error(error):
            raise
        return None


def print_exception(future: Future[Any]) -> None:
    """Callback for a finished future: prints the exception of a thread, which would otherwise be lost."""
    if not future.cancelled() and (error := future.exception()) is not None:
        traceback.print_exception(error, file=sys.stderr)


async def call(back: Callable[[Any], Any], event: Any, threads: Executor) -> None:
    """Calls a callback, on the event loop if it is a coroutine function. Exceptions are passed on."""
    if inspect.iscoroutinefunction(back):
        await back(event)
    else:
        threads.submit(back, event).add_done_callback(print_exception)


class ThreadSafeEvent(asyncio.Event):
    """An asyncio event that is always set on its event loop.

    asyncio's own event must only be set on its loop. viser 1.1 sets the event of its sender directly from any
    thread, and then asks the loop to set the event as well. Every few hours, the direct call occurs between
    the sender's last check and its wait. The event is then set although the sender waits, and the loop's call
    has no effect, so the page is never updated again. An event of this class ignores calls from other
    threads, so that only the loop sets the event. A picture of many messages then wakes the sender once.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__()
        self._home = loop

    def set(self) -> None:
        with contextlib.suppress(RuntimeError):  # the thread has no event loop
            if asyncio.get_running_loop() is self._home:
                super().set()


@cache
def fast(kind: type[Any]) -> type[Any]:
    """Returns a subclass of a message class, for messages that contain only Python numbers, strings and
    tuples of these. A moving robot sends about a hundred such messages per second. The subclass keeps the
    class name, by which viser identifies a message."""
    names = tuple(field.name for field in fields(kind))

    def as_serializable_dict(self: Any, _: object = None) -> dict[str, Any]:
        return {**{name: getattr(self, name) for name in names}, "type": kind.__name__}

    return type(kind.__name__, (kind,), {"as_serializable_dict": as_serializable_dict})


try:
    from viser import _messages, infra
except ImportError as error:
    raise InputError(
        f"viser {viser.__version__} does not fit this page ({error}): install viser 1.1"
    ) from None

Guard = Callable[[Mapping[str, Any]], dict[str, Any]]
"""Takes the arguments that viser passes to `serve` of websockets, and returns the arguments that replace
them."""

_SERVING = threading.Lock()
_NEEDED = ("process_request", "max_size")

_UNSENT = 32_000
"""Size of the socket's send buffer, bytes. A buffer of the usual size, some megabytes, can contain pictures
that are seconds old."""


def open_server(host: str, port: int, guard: Guard) -> viser.ViserServer:
    """Starts a viser server that checks every connection with `guard` and opens no public tunnel. Its senders
    always wake up. If `guard` cannot be installed, the server refuses every request and ends, and InputError
    is raised."""
    # Malformed requests of unknown clients are not logged on the terminal.
    warnings.filterwarnings("ignore", r"\[viser\]", UserWarning)
    # viser would print its own greeting, but the command prints exactly one line.
    with _silent(), _guarded(guard) as served:
        server = viser.ViserServer(host=host, port=port, label="himpc-lab", verbose=False)
    try:
        if not served or not all(served):  # several entries if viser tried more ports
            raise InputError(
                f"viser {viser.__version__} does not fit this page (how it serves has changed). The page is "
                "not served, as requests without permission could not be refused. Install viser 1.1."
            )
        handlers = server._websock_server
        # These handlers would let any client request a public tunnel to this machine, even if viser does not
        # show the button for it.
        for tunnel in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
            handlers.unregister_handler(tunnel)
        _keep_awake(server)
    except BaseException:
        stop(server)
        raise
    return server


def stop(server: viser.ViserServer) -> None:
    with _silent():
        server.stop()


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """Within this context viser prints nothing, neither on the terminal nor into the cell of a notebook."""
    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            yield
    finally:
        console.quiet = before


@contextlib.contextmanager
def _guarded(guard: Guard) -> Iterator[list[bool]]:
    """Within this context viser starts servers that check every connection with `guard`. Yields a list with
    one entry for each server and port that viser tries. An entry is False if `guard` could not be installed;
    that server refuses every request."""
    served: list[bool] = []
    plain = web.serve

    def serve(*given: Any, **keywords: Any) -> Any:
        # An exception here would make viser wait for its server forever.
        try:
            if missing := [name for name in _NEEDED if name not in keywords]:
                raise KeyError(*missing)
            handler, *place = given
            changed = guard({**keywords, "handler": handler})
        except Exception:
            served.append(False)
            return plain(*given, **{**keywords, "process_request": _refuse})
        served.append(True)
        return plain(changed.pop("handler"), *place, **changed)

    with _SERVING:
        web.serve = serve  # pyright: ignore[reportAttributeAccessIssue]
        try:
            yield served
        finally:
            web.serve = plain


def _refuse(connection: ServerConnection, _: Request) -> Response:
    """Refuses every request with status 503."""
    return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, "")


def _keep_awake(server: viser.ViserServer) -> None:
    """Replaces the wake-up events of viser's senders before the senders first wait. One sender serves all
    clients, and each client also has its own sender, which then sends a whole picture at once."""
    websockets, loop = server._websock_server, server.get_event_loop()
    websockets._broadcast_buffer.message_event = ThreadSafeEvent(loop)

    async def keep(connection: infra.WebsockClientConnection) -> None:
        buffer = connection.get_message_buffer()
        buffer.message_event, buffer.window_duration_sec = ThreadSafeEvent(loop), 0.0

    websockets.on_client_connect(keep)


def senders(server: viser.ViserServer) -> list[asyncio.Event]:
    """Returns the wake-up events of the sender for all clients, and then of each client's sender."""
    websockets = server._websock_server
    each = [one.message_buffer for one in list(websockets._client_state_from_id.values())]
    return [buffer.message_event for buffer in (websockets._broadcast_buffer, *each)]


# ---------------------------------------------------------------- one client


def connection_of(server: viser.ViserServer, client: viser.ClientHandle) -> ServerConnection | None:
    """Returns the web socket of a client; None if the client has left."""
    return server._websock_server._live_connections.get(client.client_id)


def give_workers(client: viser.ClientHandle, workers: ThreadPoolExecutor) -> None:
    """Runs this client's callbacks on `workers` from now on, without blocking other clients."""
    client.gui._thread_executor = workers
    client.scene._thread_executor = workers


def unfinished_uploads(client: viser.ClientHandle) -> int:
    """Returns the number of bytes received so far of files whose upload is not complete."""
    return sum(one["transferred_bytes"] for one in list(client.gui._current_file_upload_states.values()))


def forget_upload(client: viser.ClientHandle, transfer: str) -> None:
    """Discards the received parts of a file; viser then also ignores the parts that arrive later."""
    client.gui._current_file_upload_states.pop(transfer, None)


async def read_storage(
    client: viser.ClientHandle, keys: Sequence[str], timeout: float
) -> tuple[str | None, ...]:
    """Returns the value that the browser stores under each key. It is None if there is no value, if the
    browser blocks access to its storage, or if the browser does not answer within `timeout` seconds. The
    event loop is not blocked."""
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
    client._websock_connection.queue_message(_messages.RunJavascriptMessage(source))


def waiting(client: viser.ClientHandle) -> int:
    """Returns the number of messages that are queued for this client."""
    return len(client._websock_connection.get_message_buffer().message_from_id)


def keep_short(server: viser.ViserServer, client: viser.ClientHandle) -> None:
    """Limits the socket's send buffer, so that newer messages can replace messages that still wait."""
    live = connection_of(server, client)
    if live is None or not hasattr(socket, "TCP_NOTSENT_LOWAT"):
        return
    line = live.transport.get_extra_info("socket")
    with contextlib.suppress(OSError):  # the client has already left
        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, _UNSENT)


# ---------------------------------------------------------------- messages of a browser

Inlet = Callable[[Any, Callable[[Any], Awaitable[None]]], Awaitable[None]]
"""Receives a message, and a function that passes a message on to viser."""


def intercept(client: viser.ClientHandle, take: Inlet) -> None:
    """Passes every message of this browser to `take` first. `take` also receives the exceptions of callbacks;
    viser itself would only print the exceptions of callbacks of the 3D view."""
    connection, scene = client._websock_connection, client.scene
    plain = connection._handle_incoming_message

    async def handle(client_id: Any, message: Any) -> None:
        await take(message, lambda passed: plain(client_id, passed))

    connection._handle_incoming_message = handle
    scene._dispatch_callback = lambda cb, event: call(cb, event, scene._thread_executor)


Kind = Literal["write", "upload", "other"]


def kind_of(message: Any) -> Kind:
    """Returns the kind of a message. A "write" changes a control (fields `uuid`, `updates`), an "upload"
    begins an upload for the control `source_component_uuid`, and all other messages are "other"."""
    match message:
        case _messages.GuiUpdateMessage():
            return "write"
        case _messages.FileTransferStartUpload():
            return "upload"
        case _:
            return "other"


# ---------------------------------------------------------------- one control, one node of the scene


def control_of(client: viser.ClientHandle, uuid: object) -> viser.GuiInputHandle[Any] | None:
    """Returns the control with this identifier; None if the page does not have it any more."""
    found = client.gui._gui_input_handle_from_uuid.get(uuid) if isinstance(uuid, str) else None
    return None if found is None or found._impl.removed else found  # pyright: ignore[reportReturnType]


def dom_id(
    handle: viser.GuiInputHandle[Any]
    | viser.GuiButtonHandle
    | viser.GuiButtonGroupHandle
    | viser.GuiUploadButtonHandle,
) -> str:
    """Returns a control's id in the browser's document."""
    return handle._impl.uuid


def send_again(handle: viser.GuiInputHandle[Any]) -> None:
    """Sends the control's present value again. An assignment would send nothing, since viser sends only
    changed values."""
    control = handle._impl
    update = _messages.GuiUpdateMessage(control.uuid, {"value": control.value})
    control.gui_api._websock_interface.queue_message(update)


def send_curves(chart: viser.GuiUplotHandle, arrays: Sequence[np.ndarray]) -> None:
    """Sends new curves to a chart, abscissas first. The arrays keep their type; an assignment would convert
    them to float64."""
    chart._queue_update("data", tuple(np.ascontiguousarray(each) for each in arrays))


def shift(node: viser.SceneNodeHandle, at: np.ndarray) -> None:
    """Moves a node to `at`, (3,) m, without viser's slow comparison with the old position."""
    node._impl.position[:] = at
    node._impl.api._queue_scene_message(fast(_messages.SetPositionMessage)(node.name, tuple(at.tolist())))


def turn(node: viser.FrameHandle, to: np.ndarray) -> None:
    """Sets the orientation of a node to `to`, a quaternion wxyz."""
    node._impl.wxyz[:] = to
    node._impl.api._queue_scene_message(fast(_messages.SetOrientationMessage)(node.name, tuple(to.tolist())))
