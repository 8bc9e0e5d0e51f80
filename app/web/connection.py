"""A connection that limits and checks the messages of a page."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any, NoReturn, Protocol
from urllib.parse import urlsplit

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosedError
from websockets.frames import CloseCode, Frame, Opcode
from websockets.http11 import Request

from app.classes.words import LONGEST
from app.web import limits
from app.web.door import Answer
from app.web.inlet import refusal
from app.web.limits import TRANSFER, Budget, ConnectionLimits, Uploads
from app.web.load import PATHS

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


class Guard(Protocol):
    """The guard of the server, see `app.web.guard.ConnectionGuard`."""

    crowd: ConnectionLimits
    taken: int

    def address(self, connection: ServerConnection, request: Request | None) -> str | None: ...

    def refuse(self, connection: ServerConnection, answer: Answer) -> None: ...


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

    def __init__(self, *of: Any, guard: Guard, **more: Any) -> None:
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
