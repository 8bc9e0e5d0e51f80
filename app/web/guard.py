"""The guard around viser's web server: access control, connection limits and rate limits."""

from __future__ import annotations

import asyncio
import ipaddress
import logging
from collections.abc import Awaitable, Callable, Mapping
from http import HTTPStatus
from typing import TYPE_CHECKING, Any

from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from app.classes.words import PHONES, is_of_a_class
from app.web import limits
from app.web.connection import NOT_ALLOWED, GuardedConnection
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
from app.web.limits import ConnectionLimits
from app.web.load import Load, Places, load_of, report
from app.web.peers import ends_of
from app.web.wrong_codes import DELAY, WrongCodes

if TYPE_CHECKING:  # loaded only for a class: the server listens before these modules are loaded
    from app.web.class_door import ClassDoor, Served

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
