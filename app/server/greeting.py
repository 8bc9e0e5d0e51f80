"""The text that is printed when the page can be opened."""

from __future__ import annotations

import socket
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from app.server.classroom import Classroom

if TYPE_CHECKING:
    from app.server.server import PageServer

_WIDTH = 22
_INSTRUCTOR = "instructor's token:"


def greeting(server: PageServer, host: str, origins: Sequence[str]) -> Iterator[str]:
    """One line for a user who works alone; otherwise a block of addresses that says for whom each one is."""
    yield f"himpc-lab ready at {server.link}"
    shared = server.public or isinstance(server.sessions, Classroom)
    if shared:
        yield from _for_others(server, host, origins)
    if server.passes.token is None:
        yield "  --no-token: " + (_ALL if server.public else _ALL_HERE)
    if shared and server.passes.owner is not None:
        yield "  " + _KEEP


def _for_others(server: PageServer, host: str, origins: Sequence[str]) -> Iterator[str]:
    port = urlsplit(server.url).port
    here = f"http://{socket.gethostname()}:{port}" if host in ("0.0.0.0", "::") else server.url
    for what, address in (("for others:", here), *(("through the proxy:", each) for each in origins)):
        yield f"  {what:{_WIDTH}}{server.passes.link(address, 'guest')}"
    if isinstance(server.sessions, Classroom):
        yield f"  {_INSTRUCTOR:{_WIDTH}}{server.sessions.token}"


_KEEP = "Keep the first address secret: its page can run your Python files (not with --no-own-files)."
_ALL = (
    "everybody who can reach this address can open the page, run simulations on this machine, upload robots."
)
_ALL_HERE = "every user of this machine can open the page, run simulations as you and upload robots."
