"""Who may come in, judged by a request's headers before anything is answered and before any upgrade."""

from __future__ import annotations

import ipaddress
import re
import secrets
import socket
from collections.abc import Iterable
from dataclasses import dataclass, field
from http import HTTPStatus
from urllib.parse import parse_qs, urlsplit

from websockets.datastructures import Headers
from websockets.http11 import Request

from robots import InputError

_HOST = re.compile(r"(?P<name>\[[0-9a-fA-F:.]+\]|[A-Za-z0-9._-]+)(?::(?P<port>\d{1,5}))?")
_ON_EVERY_ANSWER = {
    "Content-Security-Policy": "frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}


@dataclass(frozen=True)
class Answer:
    """In place of what was asked for. `headers` on top of those of every answer."""

    status: HTTPStatus
    title: str
    text: str
    headers: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Door:
    """Attributes:
    local: whether only this machine can connect.
    trusted: origins beside our own, as a browser writes them: a reverse proxy's.
    token: what a visitor must bring, in the URL or in the cookie; None: nothing.
    names: what this machine is called by others.
    cookie: the cookie's name; cookies of one host are shared by all its ports.
    """

    local: bool = True
    trusted: frozenset[str] = frozenset()
    token: str | None = field(default=None, repr=False)
    names: frozenset[str] = frozenset()
    cookie: str = "himpc-lab"

    def judge(self, request: Request) -> Answer | None:
        """None: may come in. A request is one of ours if it names us as its host and, where a browser says
        which page it comes from, that page is ours too."""
        headers = request.headers
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        if len(hosts) != 1 or len(origins) > 1:
            return _foreign("It must name one host and at most one origin.")
        if not self._is_ours(hosts[0]):
            return _foreign(
                "It asks for a host of another name. If this name is meant, start himpc-lab with "
                "--trusted-origin and the whole address, e.g. --trusted-origin http://NAME:8080."
            )
        if origins and not self._is_own_page(origins[0], hosts[0]):
            return _foreign("It comes from a page of another site.")
        if not is_upgrade(request) and _is_embedded(headers):
            return _foreign("A page of another site asks for it.")
        return self._ask_token(request, hosts[0])

    def _is_ours(self, host: str) -> bool:
        found = _HOST.fullmatch(host)
        if found is None:
            return False
        if host.lower() in {urlsplit(origin).netloc for origin in self.trusted}:
            return True
        name = found["name"].lower().strip("[]").rstrip(".")
        try:
            address = ipaddress.ip_address(name)
        except ValueError:
            # A name that merely resolves to us may be anybody's (DNS rebinding).
            return name == "localhost" or (not self.local and name in self.names)
        return address.is_loopback or not self.local

    def _is_own_page(self, origin: str, host: str) -> bool:
        return origin in self.trusted or origin == f"http://{host.lower()}"

    # ---------------------------------------------------------------- token

    def _ask_token(self, request: Request, host: str) -> Answer | None:
        if self.token is None:
            return None
        given = parse_qs(urlsplit(request.path).query).get("token", [])
        if any(map(self._is_right, given)):
            return None if is_upgrade(request) else self._keep(request, host)
        if any(map(self._is_right, self._cookies(request.headers))):
            return None
        return Answer(HTTPStatus.FORBIDDEN, "A token is needed", _WRONG if given else _NEEDED, _NOT_KEPT)

    def _is_right(self, given: str) -> bool:
        return self.token is not None and secrets.compare_digest(
            given.encode(errors="replace"), self.token.encode()
        )

    def _cookies(self, headers: Headers) -> Iterable[str]:
        # By hand: the library gives up the whole line where another server's cookie of this host is odd.
        for part in ";".join(headers.get_all("Cookie")).split(";"):
            name, _, value = part.strip().partition("=")
            if name == self.cookie:
                yield value

    def _keep(self, request: Request, host: str) -> Answer:
        """The token goes into the cookie, and out of the address."""
        secure = "; Secure" if f"https://{host.lower()}" in self.trusted else ""
        kept = (
            ("Set-Cookie", f"{self.cookie}={self.token}; HttpOnly; SameSite=Strict; Path=/{secure}"),
            *_NOT_KEPT,
        )
        if request.headers.get("Referer") or request.headers.get("Sec-Fetch-Site") == "cross-site":
            # The browser would leave a strict cookie out of a redirect that a link elsewhere began.
            return Answer(HTTPStatus.OK, "himpc-lab", "Opening …", (*kept, ("Refresh", "0; url=/")))
        return Answer(HTTPStatus.SEE_OTHER, "himpc-lab", "Opening …", (*kept, ("Location", "/")))


_NOT_KEPT = (("Cache-Control", "no-store"),)
_FIELD = (
    '<form action="/" method="get"><input name="token" size="30" autocomplete="off" autofocus> '
    "<button>Open the page</button></form>"
)
_NEEDED = (
    "<p>Open the whole address that himpc-lab printed where it was started; it ends in "
    f"<code>?token=…</code>. Or give the token here:</p>{_FIELD}"
    '<p>Have you been here before? <a href="/">Open the page</a>.</p>'
)
_WRONG = (
    "<p>This is not the token of the himpc-lab that runs now; each start has a new one. It is printed where "
    f"himpc-lab was started:</p>{_FIELD}"
)


def new_token() -> str:
    """128 bits, as text that fits into an address."""
    return secrets.token_urlsafe(16)


def names_of_this_machine() -> frozenset[str]:
    """What others on its network may call it."""
    name = socket.gethostname().lower()
    short = name.partition(".")[0]
    return frozenset({name, short, f"{short}.local"})


def as_origin(text: str) -> str:
    """An origin as browsers write it. Raises InputError for what is none."""
    try:
        parts = urlsplit(text.strip())
        port = parts.port
    except ValueError:
        parts, port = urlsplit(""), None
    plain = parts.scheme in ("http", "https") and parts.hostname and parts.path in ("", "/")
    if not plain or parts.query or parts.fragment or "@" in parts.netloc or not _HOST.fullmatch(parts.netloc):
        raise InputError(
            f"--trusted-origin '{text[:80]}' is not an origin: give scheme and host and, if it is not the "
            "usual one, the port, e.g. https://lab.example.org"
        )
    host = parts.netloc.lower().rpartition(":")[0] if port is not None else parts.netloc.lower()
    usual = port in (None, {"http": 80, "https": 443}[parts.scheme])
    return f"{parts.scheme}://{host}" if usual else f"{parts.scheme}://{host}:{port}"


def is_upgrade(request: Request) -> bool:
    """Whether a web socket is asked for, as viser sees it."""
    return request.headers.get_all("Upgrade") == ["websocket"]


def secured(headers: Headers) -> None:
    """What every answer says: nobody shows us in a frame or guesses at types."""
    for name, value in _ON_EVERY_ANSWER.items():
        if name not in headers:
            headers[name] = value


def _is_embedded(headers: Headers) -> bool:
    """Another site's page asks for a part of its own; following a link from there is welcome."""
    site, mode, dest = (headers.get_all(f"Sec-Fetch-{name}") for name in ("Site", "Mode", "Dest"))
    if dest and set(dest) & {"iframe", "frame", "embed", "object"}:
        return True
    return bool(site) and site[0] not in ("same-origin", "none") and mode != ["navigate"]


def _foreign(reason: str) -> Answer:
    return Answer(HTTPStatus.FORBIDDEN, "Not from here", f"<p>himpc-lab refuses this request. {reason}</p>")
