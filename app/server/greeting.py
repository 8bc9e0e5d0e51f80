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
    """One line for a user who works alone; otherwise a list of addresses, each with the people who should use
    it."""
    yield f"himpc-lab ready at {server.link}"
    shared = server.public or server.hall is not None or _has_an_instructor(server)
    if shared:
        yield from _for_others(server, host, origins)
    if server.hall is not None:
        yield f"  {'teacher:':{_WIDTH}}{server.teachers_link}"
        yield f"  {'phones:':{_WIDTH}}{server.outside}/v/{server.hall.code}"
    if server.follows:
        yield f"  {'takes part in:':{_WIDTH}}{server.follows}"
    if server.passes.token is None:
        yield "  --no-token: " + (_ALL if server.public else _ALL_HERE)
    if shared and server.passes.owner is not None:
        yield "  " + _KEEP


def _has_an_instructor(server: PageServer) -> bool:
    return isinstance(server.sessions, Classroom) and not server.sessions.all_steer


def _for_others(server: PageServer, host: str, origins: Sequence[str]) -> Iterator[str]:
    here = seen_from_outside(host, server.url, ())  # an IP address: few networks resolve a laptop's name
    by_proxy = [("through the proxy:", each) for each in origins]
    for what, address in by_proxy if server.proxy_only else (("for others:", here), *by_proxy):
        link = address if server.proxy_only else server.passes.link(address, "guest")
        yield f"  {what:{_WIDTH}}{link}"
    if isinstance(server.sessions, Classroom) and not server.sessions.all_steer:
        yield f"  {_INSTRUCTOR:{_WIDTH}}{server.sessions.token}"


def seen_from_outside(host: str, url: str, origins: Sequence[str]) -> str:
    """The address of the server for other machines: the first proxy's, or the one of this machine in its
    network if the server listens there."""
    if origins:
        return origins[0]
    if host not in ("0.0.0.0", "::"):
        return url
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        try:
            line.connect(("192.0.2.1", 9))  # no machine has this address, and nothing is sent to it
            here = line.getsockname()[0]
        except OSError:
            here = socket.gethostname()
    return f"http://{here}:{urlsplit(url).port}"


_KEEP = "Keep the first address secret: its page can run your Python files (not with --no-own-files)."
_ALL = (
    "everybody who can reach this address can open the page, run simulations on this machine, upload robots."
)
_ALL_HERE = "every user of this machine can open the page, run simulations as you and upload robots."
