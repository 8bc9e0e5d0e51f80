"""Responses that replace the page, with the reason why the page is not sent."""

from __future__ import annotations

from html import escape
from http import HTTPStatus

from websockets.datastructures import Headers
from websockets.http11 import Response

from app.server.door import Answer

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
