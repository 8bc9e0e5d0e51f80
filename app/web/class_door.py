"""Access control for the pages of a class. The owner's secret opens the teacher's page. The class's code
gives the right to vote and to watch."""

from __future__ import annotations

import secrets
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

from websockets.http11 import Request

from app.classes.hall import Hall
from app.classes.sockets import PageName, Sockets, page, policy
from app.classes.views import table
from app.classes.words import PHONES, TEACHER
from app.web.door import NO_CLASS, Answer, Door, is_upgrade
from app.web.limits import WrongCodes
from app.web.passes import QUERY

_TEACHER = f"/{TEACHER}"
_NOT_KEPT = ("Cache-Control", "no-store")


@dataclass(frozen=True)
class Served:
    """A response of a class.

    Attributes:
        kind: the media type of `text`.
        serve: serves the connection, if the request is an upgrade.
    """

    status: HTTPStatus
    kind: str
    text: str
    headers: tuple[tuple[str, str], ...]
    serve: Callable[[Any], Awaitable[None]]


@dataclass(frozen=True)
class ClassDoor:
    """The pages of a class, and the rules for opening them."""

    hall: Hall
    sockets: Sockets
    wrong_codes: WrongCodes = field(default_factory=WrongCodes)

    def answer(self, door: Door, request: Request, who: str, address: str | None) -> Answer | Served:
        """Returns the response to a request. The request must name this server and come from one of its
        pages. who: identifies the sender, see `app.web.passes`; address: the address of the client, None if
        it is unknown."""
        plain, host = urlsplit(request.path).path, request.headers["Host"]
        past = door.not_by_the_proxy(request)
        if past is not None:
            return past
        if plain.startswith(PHONES):
            given = plain.removeprefix(PHONES)
            if not secrets.compare_digest(given.encode(errors="replace"), self.hall.code.encode()):
                self.wrong_codes.note(address, given)
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


def _page(name: PageName, host: str, serve: Callable[[Any], Awaitable[None]]) -> Served:
    headers = (("Content-Security-Policy", policy(name, host)),)
    return Served(HTTPStatus.OK, "text/html; charset=utf-8", page(name), headers, serve)


_NOT_THE_TEACHER = Answer(
    HTTPStatus.FORBIDDEN,
    "This is the teacher's page",
    "<p>Open the whole address that himpc-lab printed after <i>teacher</i> when it was started.</p>",
    (_NOT_KEPT,),
)
