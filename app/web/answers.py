"""Responses that replace the page, with the reason why the page is not sent."""

from __future__ import annotations

from html import escape
from http import HTTPStatus
from urllib.parse import urlencode, urlsplit

from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from app.web.door import ELSEWHERE, NAME, Answer, query_of

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
    """Returns the response as a complete HTML page."""
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
