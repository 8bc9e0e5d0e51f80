"""Access control for the pages of a class. The owner's secret opens the teacher's page. The class's code
gives the right to vote and to watch. The key of the class lets other servers take part."""

from __future__ import annotations

import secrets
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

from websockets.http11 import Request

from app.classes import relayed, words
from app.classes.hall import Hall
from app.classes.pages import PageName, page, policy
from app.classes.sockets import Sockets
from app.classes.table import table
from app.classes.words import BRANCH, CLASS_KEY, PHONES, TEACHER
from app.server.answers import NO_CLASS
from app.server.door import Answer, Door, is_upgrade
from app.server.passes import QUERY

_TEACHER, _SERVERS = f"/{TEACHER}", f"/{BRANCH}"
_NOT_KEPT = ("Cache-Control", "no-store")


@dataclass(frozen=True)
class Served:
    """A response of a class.

    Attributes:
        kind: the media type of `text`.
        serve: serves the connection, if the request is an upgrade.
        longest: the largest size of a message on this connection, B.
    """

    status: HTTPStatus
    kind: str
    text: str
    headers: tuple[tuple[str, str], ...]
    serve: Callable[[Any], Awaitable[None]]
    longest: int = words.LONGEST


@dataclass(frozen=True)
class ClassDoor:
    """The pages of a class, and the rules for opening them. key: the key of the class; None if no other
    server takes part."""

    hall: Hall
    sockets: Sockets
    key: str | None = field(default=None, repr=False)

    def is_for_servers(self, path: str) -> bool:
        """Returns whether an address is only for other servers of the class, which have the class's key."""
        return urlsplit(path).path == _SERVERS

    def answer(self, door: Door, request: Request, who: str) -> Answer | Served:
        """Returns the response to a request. The request must name this server and come from one of its
        pages, or be for other servers. who: identifies the sender, see `app.server.peers`."""
        if self.is_for_servers(request.path):
            return self._to_server(request)
        plain, host = urlsplit(request.path).path, request.headers["Host"]
        past = door.not_by_the_proxy(request)
        if past is not None:
            return past
        if plain.startswith(PHONES):
            given = plain.removeprefix(PHONES).encode(errors="replace")
            if not secrets.compare_digest(given, self.hall.code.encode()):
                return NO_CLASS
            return _page("phone", host, self.sockets.phone)
        if QUERY in request.path and not is_upgrade(request):
            return door.judge(request, who) or _NOT_THE_TEACHER  # the response puts the secret into a cookie
        if door.role(request, who) != "owner":
            return _NOT_THE_TEACHER
        if plain == _TEACHER:
            return _page("teacher", host, self.sockets.teacher)
        kept = (("Content-Disposition", 'attachment; filename="class.csv"'),)
        text = table(self.hall.state)
        return Served(HTTPStatus.OK, "text/csv; charset=utf-8", text, kept, self.sockets.teacher)

    def _to_server(self, request: Request) -> Answer | Served:
        given = request.headers.get_all(CLASS_KEY)
        right = self.key is not None and len(given) == 1
        known = right and secrets.compare_digest(given[0].encode(errors="replace"), str(self.key).encode())
        if not known or not is_upgrade(request):
            return _NO_SERVER
        return Served(HTTPStatus.OK, "text/plain", "", (), self.sockets.server, relayed.LONGEST)


def _page(name: PageName, host: str, serve: Callable[[Any], Awaitable[None]]) -> Served:
    headers = (("Content-Security-Policy", policy(name, host)),)
    return Served(HTTPStatus.OK, "text/html; charset=utf-8", page(name), headers, serve)


_NO_SERVER = Answer(
    HTTPStatus.FORBIDDEN,
    "For servers of this class only",
    "<p>Start both servers with the same key, see <i>--class-key</i>.</p>",
    (_NOT_KEPT,),
)
_NOT_THE_TEACHER = Answer(
    HTTPStatus.FORBIDDEN,
    "This is the teacher's page",
    "<p>Open the whole address that himpc-lab printed after <i>teacher</i> when it was started.</p>",
    (_NOT_KEPT,),
)
