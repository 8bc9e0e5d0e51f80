"""The guard around viser's web server: access control, connection limits and rate limits."""

from __future__ import annotations

import asyncio
import ipaddress
import logging
from collections.abc import Awaitable, Callable, Mapping
from http import HTTPStatus
from typing import TYPE_CHECKING, Any, NoReturn

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosedError
from websockets.frames import CloseCode, Frame, Opcode
from websockets.http11 import Request, Response

from app.classes.words import LONGEST, is_of_a_class
from app.server import budget
from app.server.answers import CROWDED, FULL, NO_CLASS, NOT_OPEN, as_response, plain
from app.server.budget import Budget
from app.server.connection_limits import ConnectionLimits
from app.server.door import Answer, Door, is_upgrade
from app.server.load import Load, Places, load_of, report
from app.server.peers import ends_of
from app.server.prefix import under_its_name
from app.server.uploads import TRANSFER, Uploads
from app.server.words import refusal

if TYPE_CHECKING:  # loaded only for a class: the server listens before these modules are loaded
    from app.server.class_door import ClassDoor

HANDSHAKE = 5.0
"""Time, s, within which a request must be complete."""
FIRST_WORD = 45.0
"""Time, s, within which a page must send its first message. The first picture may take long without a
graphics card."""
_SLICE = 4096  # B that are parsed between two checks of the limits


class ConnectionGuard:
    """The guard that `open_server` installs. Before `open` is called, it refuses every request."""

    def __init__(self, door: Door) -> None:
        self.crowd = ConnectionLimits()
        self.refused = 0
        self.taken = 0
        """Number of messages that were passed on to viser."""
        self._door = door
        self._open = self._refers = False
        self._places: Places | None = None
        self._class: ClassDoor | None = None

    def open(
        self,
        door: Door,
        places: Places | None = None,
        refers: bool = False,
        class_door: ClassDoor | None = None,
    ) -> None:
        """Admits requests according to `door` from now on.

        places: the sessions, for /health and /metrics.
        refers: while every place is used, new visitors are refused with status 503, and a proxy tries the
            next server; otherwise the page says that all places are used.
        class_door: the pages of a class, if there is one.
        """
        self._door, self._places, self._refers, self._open = door, places, refers, True
        self._class = class_door

    @property
    def load(self) -> Load:
        """The present load of the server."""
        return load_of(self._places, len(self.crowd), self.refused, self.taken, not self._open)

    def close(self) -> None:
        self._open = False

    def __call__(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the changed keywords for websockets' `serve`."""
        files: Callable[[ServerConnection, Request], Response | None] = given["process_request"] or _nothing

        def request(connection: ServerConnection, request: Request) -> Response | None:
            told = None if is_upgrade(request) else report(request.path, self.load)
            if told is not None and self._door.refuses(request) is None:
                return plain(*told)
            of_a_class = is_of_a_class(request.path)
            if self._class is not None and of_a_class:
                return self._to_class(self._class, connection, request)
            answer = self._judge(connection, request)
            if answer is None and of_a_class and is_upgrade(request):
                answer = NO_CLASS  # some proxies ask for no password at this address
            if answer is not None:
                self.refused += answer.status >= HTTPStatus.BAD_REQUEST
                return as_response(answer)
            if is_upgrade(request):
                if isinstance(connection, GuardedConnection):
                    connection.is_owners = self._is_owners(connection, request)
                    connection.teaches = self._door.role(request, _user(connection)) == "owner"
                    connection.account = self._door.account(request)
                    connection.expect_word(FIRST_WORD)
                return None
            moved = under_its_name(request)
            return files(connection, request) if moved is None else as_response(moved)

        async def serve(connection: ServerConnection) -> None:
            own = connection.serves if isinstance(connection, GuardedConnection) else None
            await (own or given["handler"])(connection)

        def secure(_: ServerConnection, __: Request, response: Response) -> None:
            self._door.secure(response.headers)

        return {
            **given,
            "handler": serve,
            "process_request": request,
            "process_response": secure,
            "create_connection": lambda *of, **more: GuardedConnection(*of, guard=self, **more),
            "max_size": budget.MESSAGE,
            "open_timeout": HANDSHAKE,
            "server_header": None,
            "logger": _log(),
        }

    def _judge(self, connection: ServerConnection, request: Request) -> Answer | None:
        answer = self._not_open(connection, request) or self._door.judge(request, _user(connection))
        return FULL if answer is None and self._refers and self.load.full else answer

    def _to_class(self, of: ClassDoor, connection: ServerConnection, request: Request) -> Response | None:
        """Returns the response to a request for a page of the class; None for an upgrade that is admitted."""
        answer = self._not_open(connection, request) or self._door.refuses(request)
        found = answer or of.answer(self._door, request, _user(connection))
        if isinstance(found, Answer):
            self.refused += found.status >= HTTPStatus.BAD_REQUEST
            return as_response(found)
        if not is_upgrade(request):
            return plain(found.status, found.kind, found.text, found.headers)
        if isinstance(connection, GuardedConnection):
            connection.serves = found.serve
            connection.address = self.address(connection, request)
            connection.accept_short()
            connection.expect_word(FIRST_WORD)
        return None

    def _not_open(self, connection: ServerConnection, request: Request) -> Answer | None:
        """Returns a refusal while the server is not open, or if it has no room for this connection; else
        None."""
        if not self._open:
            return NOT_OPEN
        if not self.crowd.comes_from(connection, self.address(connection, request)):
            return CROWDED
        return None

    def _is_owners(self, connection: ServerConnection, request: Request) -> bool:
        """Returns whether this page was opened by the person who started the server, on the server's
        machine."""
        ends = ends_of(connection.transport)
        return ends is not None and ends.near and self._door.is_owner(request, ends.user)

    def address(self, connection: ServerConnection, request: Request | None) -> str | None:
        """Returns the address of the client; None if a proxy on this machine does not name the client."""
        peer = connection.remote_address
        address = str(peer[0]) if isinstance(peer, tuple) and peer else None
        if address is None or not self._door.trusted or not ipaddress.ip_address(address).is_loopback:
            return address
        named = [] if request is None else request.headers.get_all("X-Forwarded-For")
        return named[-1].rpartition(",")[2].strip()[:64] if named else None


class GuardedConnection(ServerConnection):
    """A connection that counts messages before it decodes them. It passes on only messages that a page may
    send.

    Attributes:
        uploads: the uploads of the page.
        refuse: shows a refusal to the user.
        is_owners: whether the person who started the server opened the page.
        teaches: whether the page was opened with the owner's secret, on any machine.
        account: the name with which the user signed in at the proxy.
        serves: the function that serves a page of a class, in place of viser.
        address: the address of the client, for a page of a class; None if it is unknown.
    """

    def __init__(self, *of: Any, guard: ConnectionGuard, **more: Any) -> None:
        super().__init__(*of, **more)
        self.uploads: Uploads | None = None
        self.refuse: Callable[[str], object] = _nothing_said
        self.is_owners = False
        self.teaches = False
        self.serves: Callable[[Any], Awaitable[None]] | None = None
        self.account = ""
        self.address: str | None = None
        self._guard = guard
        self._budget = Budget(self.loop.time)
        self._waiting = 0
        self._expecting: asyncio.TimerHandle | None = None

    def expect_word(self, patience: float) -> None:
        """Closes the connection if it has sent no valid message after `patience` seconds."""
        self._expecting = self.loop.call_later(patience, self._end_if_silent)

    def _end_if_silent(self) -> None:
        if not self._guard.crowd.has_spoken(self):
            self.transport.abort()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        if not self._guard.crowd.enter(self, self._guard.address(self, None), self.transport.abort):
            self.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        if self._expecting is not None:
            self._expecting.cancel()  # the timer would keep the closed page in memory
        self._guard.crowd.leave(self)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        for at in range(0, len(data), _SLICE):
            if self.transport.is_closing():
                return
            super().data_received(data[at : at + _SLICE])

    def process_event(self, event: Any) -> None:
        if isinstance(event, Frame):
            if event.opcode in (Opcode.PING, Opcode.PONG):
                if not self._budget.controls():
                    self.transport.abort()
                    return
            elif event.opcode is not Opcode.CLOSE:
                self._waiting += 1
                if self._waiting > budget.WAITING:
                    self.transport.abort()
                    return
        super().process_event(event)

    async def recv(self, decode: bool | None = None) -> Any:
        """As websockets' `recv`, but a client that sends too much is read more slowly, and finally
        disconnected."""
        while True:
            raw = await super().recv(decode)
            self._waiting = len(self.recv_messages.frames)
            if isinstance(raw, str):
                await self._end(CloseCode.UNSUPPORTED_DATA, "This page accepts binary messages only.")
            if waiting := self._budget.wait(len(raw)):
                await asyncio.sleep(waiting)
            if self._budget.spent:
                await self._end(CloseCode.POLICY_VIOLATION, "Too many messages.")
            if (why := refusal(raw)) is not None:
                if why:
                    self.refuse(why)
                continue
            if TRANSFER in raw and not await self._may_upload(raw):
                continue
            self._guard.crowd.spoke(self)
            self._guard.taken += 1
            return raw

    def accept_short(self) -> None:
        """Accepts only short messages from now on. A longer message ends the connection, with a reason."""
        self.protocol.max_message_size = LONGEST

    async def recv_short(self) -> str | bytes:
        """Returns the next message of a page of a class."""
        raw = await super().recv()
        self._waiting = len(self.recv_messages.frames)
        self._guard.crowd.spoke(self)
        return raw

    async def _may_upload(self, raw: bytes) -> bool:
        await asyncio.sleep(0)  # viser first processes the earlier messages
        return self.uploads is not None and self.uploads.takes(raw, self._budget)

    async def _end(self, code: CloseCode, reason: str) -> NoReturn:
        await self.close(code, reason)
        raise ConnectionClosedError(None, None)  # viser treats this exception as the end of the connection


def _user(connection: ServerConnection) -> str:
    ends = ends_of(connection.transport)
    return "" if ends is None else ends.user


def _nothing_said(_: str) -> None:
    """Does nothing; used while no page can show the sentence."""


def _nothing(_: ServerConnection, __: Request) -> Response | None:
    return None


def _log() -> logging.Logger:
    """Returns a silent logger, so that malformed requests from outside are not reported on the terminal."""
    log = logging.getLogger("himpc-lab.connections")
    log.propagate = False
    log.setLevel(logging.CRITICAL)
    return log
