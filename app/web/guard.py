"""The guard around viser's web server: access control, and connections that limit and check the messages of a
page."""

from __future__ import annotations

import asyncio
import ipaddress
import logging
import re
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from typing import TYPE_CHECKING, Any, NoReturn
from urllib.parse import urlsplit

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosedError
from websockets.frames import CloseCode, Frame, Opcode
from websockets.http11 import Request, Response

from app.classes.words import LONGEST, PHONES, is_of_a_class
from app.web import limits
from app.web.door import (
    CROWDED,
    FULL,
    GUESSED,
    NO_CLASS,
    NOT_OPEN,
    Answer,
    Door,
    as_response,
    is_upgrade,
    plain,
    under_its_name,
)
from app.web.inlet import refusal
from app.web.limits import DELAY, TRANSFER, Budget, ConnectionLimits, Uploads, WrongCodes
from app.web.load import PATHS, Load, load_of, report
from app.web.passes import ends_of

if TYPE_CHECKING:
    from app.web.class_door import ClassDoor, Served
    from app.web.sessions import Classroom, Sessions

_FIRST_LINE = re.compile(rb"([A-Z]{1,20}) ([^\s]+) HTTP/1\.([01])(?=\r\n)")
_READ = ("GET", "HEAD")
NOT_ALLOWED = Answer(
    HTTPStatus.METHOD_NOT_ALLOWED,
    "This request is not supported",
    "<p>This server answers GET and HEAD only.</p>",
    (("Allow", ", ".join(_READ)),),
)
_TOO_OLD = Answer(
    HTTPStatus.HTTP_VERSION_NOT_SUPPORTED,
    "HTTP/1.1 is needed",
    "<p>In HTTP/1.0 this server answers only /health and /metrics. In a proxy, switch on HTTP/1.1; in nginx "
    "with <code>proxy_http_version 1.1;</code>.</p>",
)


@dataclass(frozen=True)
class RequestLine:
    """Method and path of a request: websockets reads only GET in HTTP/1.1, but monitors also use HEAD and
    HTTP/1.0. is_old: whether it is in HTTP/1.0. A line that cannot be read has the method ""."""

    method: str = ""
    path: str = ""
    is_old: bool = False

    @property
    def refusal(self) -> Answer | None:
        """The response to a request that is not supported; None for every other request."""
        if self.method not in (*_READ, ""):
            return NOT_ALLOWED
        return _TOO_OLD if self.is_old and urlsplit(self.path).path not in PATHS else None


def request_line(data: bytes) -> tuple[RequestLine, bytes]:
    """Returns the first line of `data`, and the data with GET and HTTP/1.1 in this line. If the line cannot
    be read, the data are unchanged, and websockets refuses them."""
    found = _FIRST_LINE.match(data)
    if found is None:
        return RequestLine(), data
    method, path, version = found[1].decode(), found[2], found[3]
    line = RequestLine(method, path.decode("ascii", "surrogateescape"), version == b"0")
    return line, b"GET " + path + b" HTTP/1.1" + data[found.end() :]


_SLICE = 4096  # B that are parsed between two checks of the limits
_LINE = 8192  # largest length of a request's first line, B


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
        line: the first line of the request, as soon as it has arrived.
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
        self.line: RequestLine | None = None
        self._begun = b""  # the received part of the first line
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
        """As in websockets, but the first line of the request is read here, as websockets knows only GET and
        HTTP/1.1."""
        if self.line is None:
            data, self._begun = self._begun + data, b""
            if b"\r\n" not in data and len(data) <= _LINE:
                self._begun = data
                return
            self.line, data = request_line(data)
            answer = self.line.refusal
            if answer is not None:
                self._guard.refuse(self, answer)
                return
        for at in range(0, len(data), _SLICE):
            if self.transport.is_closing() or self.line.refusal is not None:
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
                if self._waiting > limits.WAITING:
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


def _nothing_said(_: str) -> None:
    """Does nothing; used while no page can show the sentence."""


HANDSHAKE = 5.0
"""Time, s, within which a request must be complete."""
FIRST_WORD = 45.0
"""Time, s, within which a page must send its first message. The first picture may take long without a
graphics card."""


class ConnectionGuard:
    """The guard that `open_server` installs. Before `open` is called, it refuses every request."""

    def __init__(self, door: Door) -> None:
        self.crowd = ConnectionLimits()
        self.refused = 0
        self.taken = 0
        """Number of messages that were passed on to viser."""
        self._door = door
        self._open = self._refers = False
        self._places: Sessions | Classroom | None = None
        self._class: ClassDoor | None = None

    def open(
        self,
        door: Door,
        places: Sessions | Classroom | None = None,
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
        return load_of(self._places, len(self.crowd), self.refused, self.taken, not self._open)

    def close(self) -> None:
        self._open = False

    def __call__(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the changed keywords for websockets' `serve`."""
        files: Callable[[ServerConnection, Request], Response | None] = given["process_request"] or _nothing

        def request(
            connection: ServerConnection, request: Request
        ) -> Response | Awaitable[Response | None] | None:
            told = None if is_upgrade(request) else report(request.path, self.load)
            if told is not None and (_is_a_monitors(connection, request) or not self._door.refuses(request)):
                return plain(*told)
            if is_upgrade(request) and _asks_for_the_head(connection):
                return as_response(NOT_ALLOWED)
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

        def secure(connection: ServerConnection, _: Request, response: Response) -> None:
            self._door.secure(response.headers)
            if _asks_for_the_head(connection):
                response.body = b""

        return {
            **given,
            "handler": serve,
            "process_request": request,
            "process_response": secure,
            "create_connection": lambda *of, **more: GuardedConnection(*of, guard=self, **more),
            "max_size": limits.MESSAGE,
            "open_timeout": HANDSHAKE,
            "server_header": None,
            "logger": _log(),
        }

    def refuse(self, connection: ServerConnection, answer: Answer) -> None:
        """Answers a request that websockets cannot read. The client then closes the connection."""
        self.refused += 1
        response = as_response(answer)
        self._door.secure(response.headers)
        connection.transport.write(response.serialize())

    def _judge(self, connection: ServerConnection, request: Request) -> Answer | None:
        answer = self._not_open(connection, request) or self._door.judge(request, _user(connection))
        return FULL if answer is None and self._refers and self.load.full else answer

    def _to_class(
        self, of: ClassDoor, connection: ServerConnection, request: Request
    ) -> Response | Awaitable[Response | None] | None:
        """Returns the response to a request for a page of the class; None for an upgrade that is admitted.
        The response is late if its address has sent many wrong codes."""
        refused = self._not_open(connection, request) or self._door.refuses(request)
        address = self.address(connection, request)
        found = refused or of.answer(self._door, request, _user(connection), address)
        if refused is None and request.path.startswith(PHONES) and of.wrong_codes.are_many(address):
            return self._late(of.wrong_codes, connection, request, found)
        return self._of_class(found, connection, request)

    async def _late(
        self, wrong: WrongCodes, connection: ServerConnection, request: Request, found: Answer | Served
    ) -> Response | None:
        with wrong.waits(self.address(connection, request)) as may_wait:
            if may_wait:
                await asyncio.sleep(DELAY)
            return self._of_class(found if may_wait else GUESSED, connection, request)

    def _of_class(
        self, found: Answer | Served, connection: ServerConnection, request: Request
    ) -> Response | None:
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


def _asks_for_the_head(connection: ServerConnection) -> bool:
    line = connection.line if isinstance(connection, GuardedConnection) else None
    return line is not None and line.method == "HEAD"


def _is_a_monitors(connection: ServerConnection, request: Request) -> bool:
    """Returns whether this is a request in HTTP/1.0 that names no host, which no browser sends."""
    line = connection.line if isinstance(connection, GuardedConnection) else None
    return line is not None and line.is_old and "Host" not in request.headers


def _user(connection: ServerConnection) -> str:
    ends = ends_of(connection.transport)
    return "" if ends is None else ends.user


def _nothing(_: ServerConnection, __: Request) -> Response | None:
    return None


def _log() -> logging.Logger:
    """Returns a silent logger, so that malformed requests from outside are not reported on the terminal."""
    log = logging.getLogger("himpc-lab.connections")
    log.propagate = False
    log.setLevel(logging.CRITICAL)
    return log
