"""Access control: decides from a request's headers before any response is sent and before any upgrade. A
response that replaces the page says why the page is not sent."""

from __future__ import annotations

import ipaddress
import re
import socket
from dataclasses import dataclass, field
from html import escape
from http import HTTPStatus
from urllib.parse import parse_qs, quote, urlencode, urlsplit

from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from app.web.passes import QUERY, USER_HEADER, Passes, Role, came_through_a_proxy
from robots import InputError

_HOST = re.compile(r"(?P<name>\[[0-9a-fA-F:.]+\]|[A-Za-z0-9._-]+)(?::(?P<port>\d{1,5}))?")
_PLAIN = re.compile(r"(/[A-Za-z0-9_~-][A-Za-z0-9._~@-]*)*/?")
ELSEWHERE = frozenset({"websocket", "playbackPath"})
NAME = "page"
"""The page's name if it is served below a path of another site, see `under_its_name`."""
SELF = "'self'"
"""Used in place of an origin. It means the origin of the page itself, for a proxy that also serves other
pages."""
_NO_FRAMES = {"Content-Security-Policy": "frame-ancestors 'none'", "X-Frame-Options": "DENY"}
_ON_EVERY_ANSWER = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}


@dataclass(frozen=True)
class Answer:
    """A response that replaces the requested page. `headers` are sent in addition to the headers of every
    response."""

    status: HTTPStatus
    title: str
    text: str
    headers: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Door:
    """The access rules of a server.

    Attributes:
        local: whether only this machine can connect.
        trusted: further allowed origins, as browsers write them, e.g. a reverse proxy's.
        passes: the secrets that a visitor must send in the URL or in the cookie.
        names: the names by which other machines know this machine.
        proxy_only: whether only a proxy that sends the token in its header is admitted. The proxy may use any
            name for this server, and it sends its visitor's name.
        embedders: origins of the pages that may show this page in a frame.
    """

    local: bool = True
    trusted: frozenset[str] = frozenset()
    passes: Passes = field(default_factory=Passes)
    names: frozenset[str] = frozenset()
    proxy_only: bool = False
    embedders: frozenset[str] = frozenset()

    def judge(self, request: Request, who: str = "") -> Answer | None:
        """Returns None if the request is admitted, else the response to send. An admitted request names this
        server as its host. If the browser names the page that sent the request, this page must be one of
        ours. who: identifies the sender, see `app.web.passes`."""
        return self.refuses(request) or self._ask_token(request, request.headers["Host"], who)

    def refuses(self, request: Request) -> Answer | None:
        """As `judge`, but does not check the token."""
        headers = request.headers
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        if len(hosts) != 1 or len(origins) > 1:
            return _foreign("The request must name one host and at most one origin.")
        if len(headers.get_all(USER_HEADER)) > 1:
            return _foreign(
                f"The request names two accounts: the proxy must replace the visitor's own {USER_HEADER}."
            )
        if not self._is_ours(hosts[0]):
            return _foreign(
                "The request names a host that is not this server. If the name is right, start himpc-lab "
                "with --trusted-origin and the whole address, e.g. --trusted-origin http://NAME:8080."
            )
        if origins and not self._is_own_page(origins[0], hosts[0]):
            return _foreign("The request comes from a page of another site.")
        if not is_upgrade(request) and _is_embedded(headers, bool(self.embedders)):
            return _foreign("A page of another site embeds this page.")
        if self.proxy_only and not _PLAIN.fullmatch(request.path.partition("?")[0]):
            # A proxy may treat //v/x as /v/x, for which it asks no password. This server treats the two as
            # different addresses.
            return _foreign("The address of the request has an unusual form.")
        if _leads_away(request) and urlsplit(request.path).path != f"/{NAME}":
            return _foreign("The address of the request would connect the page to another server.")
        return None

    def is_owner(self, request: Request, who: str = "") -> bool:
        """Returns whether the person who started the server sent this upgrade. The upgrade must have been
        admitted."""
        return self.role(request, who) == "owner" and not came_through_a_proxy(request.headers)

    def role(self, request: Request, who: str = "") -> Role | None:
        """Returns the role whose secret or cookie a request contains, from any machine; None if it contains
        none."""
        found = self.passes.in_address(request.path), self.passes.in_cookies(request.headers, who)
        return "owner" if "owner" in found else found[0] or found[1]

    def secure(self, headers: Headers) -> None:
        """Adds the headers of every response: only the embedders may show the page in a frame, and browsers
        must not guess its type."""
        framed = _NO_FRAMES
        if self.embedders:
            framed = {"Content-Security-Policy": f"frame-ancestors {' '.join(sorted(self.embedders))}"}
        for name, value in {**framed, **_ON_EVERY_ANSWER}.items():
            if name not in headers:
                headers[name] = value

    def not_by_the_proxy(self, request: Request) -> Answer | None:
        """Returns a refusal if only a proxy is admitted and the request did not pass through it; else
        None."""
        if not self.proxy_only or self.passes.in_header(request.headers):
            return None
        return Answer(HTTPStatus.FORBIDDEN, "Not at this address", _ELSEHOW, _NOT_KEPT)

    def account(self, request: Request) -> str:
        """Returns the name with which the sender of an admitted request has signed in at the proxy; "" if
        requests need not pass through a proxy."""
        return self.passes.account(request.headers) if self.proxy_only else ""

    def _is_ours(self, host: str) -> bool:
        found = _HOST.fullmatch(host)
        if found is None:
            return False
        if self.proxy_only or host.lower() in {urlsplit(origin).netloc for origin in self.trusted}:
            return True
        name = found["name"].lower().strip("[]").rstrip(".")
        try:
            address = ipaddress.ip_address(name)
        except ValueError:
            # Any name may resolve to this machine (DNS rebinding), so names that are not ours are refused.
            return name == "localhost" or (not self.local and name in self.names)
        return address.is_loopback or not self.local

    def _is_own_page(self, origin: str, host: str) -> bool:
        own = {f"http://{host.lower()}"} | ({f"https://{host.lower()}"} if self.proxy_only else set())
        return origin in self.trusted or origin in own

    # ---------------------------------------------------------------- token

    def _ask_token(self, request: Request, host: str, who: str) -> Answer | None:
        past = self.not_by_the_proxy(request)
        if past is not None:
            return past
        role = self.passes.in_address(request.path)
        if role == "owner" or (role is not None and not self.proxy_only):
            return None if is_upgrade(request) else self._keep(request, host, role, who)
        if self.passes.in_header(request.headers):
            return None
        if self.passes.token is None or self.passes.in_cookies(request.headers, who) is not None:
            return None
        text = _WRONG if QUERY in query_of(request) else _NEEDED
        return Answer(HTTPStatus.FORBIDDEN, "A token is needed", text, _NOT_KEPT)

    def _keep(self, request: Request, host: str, role: Role, who: str) -> Answer:
        """Returns a response that removes the secret from the address and puts a proof of the secret into a
        cookie. The browser sends the cookie to the folder of this address and below, also behind a proxy's
        prefix."""
        secure = "; Secure" if f"https://{host.lower()}" in self.trusted else ""
        cookie = f"{self.passes.keep(role, who)}; HttpOnly; SameSite=Strict{secure}"
        kept = (("Set-Cookie", cookie), *_NOT_KEPT)
        rest = urlencode({name: values for name, values in query_of(request).items() if name != QUERY}, True)
        name = quote(urlsplit(request.path).path.rpartition("/")[2], safe="")
        page = f"./{name}?{rest}" if rest else f"./{name}"
        if request.headers.get("Referer") or request.headers.get("Sec-Fetch-Site") == "cross-site":
            # A browser sends no strict cookie with a redirect that began with a link on another site.
            return Answer(HTTPStatus.OK, "himpc-lab", "Opening …", (*kept, ("Refresh", f"0; url={page}")))
        return Answer(HTTPStatus.SEE_OTHER, "himpc-lab", "Opening …", (*kept, ("Location", page)))


_NOT_KEPT = (("Cache-Control", "no-store"),)
_FIELD = (
    f'<form action="./" method="get"><input name="{QUERY}" size="30" autocomplete="off" autofocus> '
    "<button>Open the page</button></form>"
)
_NEEDED = (
    "<p>Open the whole address that himpc-lab printed in its terminal. The address ends in "
    f"<code>?{QUERY}=…</code>. Or enter the token here:</p>{_FIELD}"
    '<p>If you have opened this page before: <a href="./">Open the page</a>.</p>'
)
_ELSEHOW = (
    "<p>This himpc-lab can only be opened through the site that started it, for example from the launcher of "
    "JupyterHub.</p>"
)
_WRONG = (
    "<p>This token is not valid now: each start of himpc-lab has a new token. The token is printed in "
    f"the terminal where himpc-lab was started:</p>{_FIELD}"
)


def names_of_this_machine() -> frozenset[str]:
    """Returns the names by which other machines on the network know this machine."""
    name = socket.gethostname().lower()
    short = name.partition(".")[0]
    return frozenset({name, short, f"{short}.local"})


def as_origin(text: str, option: str = "--trusted-origin") -> str:
    """Returns the origin as browsers write it. Raises InputError, which names the option, if `text` is not a
    valid origin."""
    try:
        parts = urlsplit(text.strip())
        port = parts.port
    except ValueError:
        parts, port = urlsplit(""), None
    plain = parts.scheme in ("http", "https") and parts.hostname and parts.path in ("", "/")
    if not plain or parts.query or parts.fragment or "@" in parts.netloc or not _HOST.fullmatch(parts.netloc):
        raise InputError(
            f"{option} '{text[:80]}' is not an origin: give scheme, host and, if it is not the "
            "usual one, the port, e.g. https://lab.example.org"
        )
    host = parts.netloc.lower().rpartition(":")[0] if port is not None else parts.netloc.lower()
    usual = port in (None, {"http": 80, "https": 443}[parts.scheme])
    return f"{parts.scheme}://{host}" if usual else f"{parts.scheme}://{host}:{port}"


def is_upgrade(request: Request) -> bool:
    """Returns whether a request opens a web socket. The test is the same as in viser."""
    return request.headers.get_all("Upgrade") == ["websocket"]


def query_of(request: Request) -> dict[str, list[str]]:
    """Returns the parameters in the address of a request."""
    return parse_qs(urlsplit(request.path).query, keep_blank_values=True)


def _leads_away(request: Request) -> bool:
    """Returns whether the address makes viser's page connect to another server or play a recording. Messages
    from another server or a recording may contain scripts, which would run as a part of our page."""
    return not ELSEWHERE.isdisjoint(query_of(request))


def _is_embedded(headers: Headers, framed: bool) -> bool:
    """Returns whether a page of another site loads a part of its content from this server. A link on such a
    page is allowed. framed: frames are allowed; the browser then checks which page contains them."""
    site, mode, dest = (headers.get_all(f"Sec-Fetch-{name}") for name in ("Site", "Mode", "Dest"))
    if dest and set(dest) & {"iframe", "frame", "embed", "object"} and not (framed and dest == ["iframe"]):
        return True
    return bool(site) and site[0] not in ("same-origin", "none") and mode != ["navigate"]


def _foreign(reason: str) -> Answer:
    return Answer(HTTPStatus.FORBIDDEN, "Request refused", f"<p>himpc-lab refuses this request. {reason}</p>")


_PAGE = (
    '<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
    "<title>{title}</title><body style='font:16px/1.5 sans-serif;max-width:40em;margin:3em auto'>"
    "<h1>{title}</h1>{text}</body></html>"
)

NOT_OPEN = Answer(HTTPStatus.SERVICE_UNAVAILABLE, "Starting or stopping", "<p>Try again in a moment.</p>")
CROWDED = Answer(HTTPStatus.SERVICE_UNAVAILABLE, "Too many pages", "<p>Close some pages and try again.</p>")
FULL = Answer(
    HTTPStatus.SERVICE_UNAVAILABLE,
    "All places are taken",
    "<p>Every robot is in use. This page tries again by itself.</p>",
    (("Retry-After", "5"), ("Refresh", "5"), ("Cache-Control", "no-store")),
)
NO_CLASS = Answer(
    HTTPStatus.FORBIDDEN,
    "There is no such class",
    "<p>Each start of a class has a new address: scan the code on the projector again.</p>",
    (("Cache-Control", "no-store"),),
)

GUESSED = Answer(
    HTTPStatus.TOO_MANY_REQUESTS,
    "Too many wrong codes",
    "<p>Your network sent many wrong codes. This page tries again by itself.</p>",
    (("Retry-After", "5"), ("Refresh", "5"), ("Cache-Control", "no-store")),
)


def plain(status: HTTPStatus, kind: str, text: str, more: tuple[tuple[str, str], ...] = ()) -> Response:
    """Returns a response with a text, which browsers must not store. more: further headers."""
    body = text.encode()
    headers = Headers({"Content-Type": kind, "Content-Length": str(len(body)), "Cache-Control": "no-store"})
    for name, value in more:
        headers[name] = value
    headers["Connection"] = "close"
    return Response(status.value, status.phrase, headers, body)


def as_response(answer: Answer) -> Response:
    body = _PAGE.format(title=escape(answer.title), text=answer.text).encode()
    headers = Headers(answer.headers)
    headers["Content-Type"] = "text/html; charset=utf-8"
    headers["Content-Length"] = str(len(body))
    headers["Connection"] = "close"
    return Response(answer.status.value, answer.status.phrase, headers, body)


PREFIX = "X-Forwarded-Prefix"
"""The header in which a proxy, e.g. jupyter-server-proxy, sends the path that it removed."""


def under_its_name(request: Request) -> Answer | None:
    """Serves the page below a path of another site: changes a request for the page's name so that it opens
    the page. Returns a redirect to this name if the request is for the folder below a path or names another
    server, else None.

    viser's page opens its web socket at its own address without the slash at the end. A proxy that serves the
    page below a path redirects this address to the address with the slash, but browsers do not follow
    redirects of web sockets. Therefore the page has a name (`NAME`) below a path, and its address has no
    slash at the end. viser's page then also writes the address of its web socket into its own address, and a
    reload sends this parameter. It could name another server, and is removed.
    """
    parts, given = urlsplit(request.path), query_of(request)
    rest = urlencode({name: values for name, values in given.items() if name not in ELSEWHERE}, True)
    query = f"?{rest}" if rest else ""
    named = parts.path == f"/{NAME}"
    if named and ELSEWHERE.isdisjoint(given):
        request.path = f"/{query}"
    elif named or (parts.path == "/" and any(each.strip("/") for each in request.headers.get_all(PREFIX))):
        link = (("Location", f"./{NAME}{query}"), ("Cache-Control", "no-store"))
        return Answer(HTTPStatus.SEE_OTHER, "himpc-lab", "Opening …", link)
    return None
