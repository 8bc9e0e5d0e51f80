"""Helpers with which `private.self_test` checks viser's private names."""

from __future__ import annotations

import socket
from http import HTTPStatus

import viser
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from robots import InputError


def answer(port: int) -> bytes:
    """Returns the first bytes of a server's response to an HTTP request from this machine."""
    with socket.create_connection(("127.0.0.1", port), timeout=10.0) as stranger:
        stranger.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        return stranger.recv(100)


def refuse(connection: ServerConnection, _: Request) -> Response:
    """Refuses every request with status 503."""
    return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, "")


def reaches(start: object, path: str) -> bool:
    """Returns whether an object has the attribute, or a dataclass has the field, at a dotted path."""
    for name in path.split("."):
        if name in getattr(start, "__dataclass_fields__", ()):
            return True
        try:
            start = getattr(start, name)
        except (AttributeError, RecursionError):
            return False
    return True


def require(found: bool, what: str) -> None:
    """Raises InputError if a check failed; the server does not start then."""
    if not found:
        raise InputError(
            f"viser {viser.__version__} does not fit this page ({what} has changed). The page is not served, "
            "as requests without permission could not be refused. Install viser 1.1."
        )
