"""The text that is printed when the page can be opened."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from app.classes.words import ONLY_HERE
from app.server.address import seen_from_outside
from app.server.classroom import Classroom

if TYPE_CHECKING:
    from app.server.server import PageServer

_WIDTH = 22
_INSTRUCTOR = "instructor's token:"


def greeting(server: PageServer) -> Iterator[str]:
    """Yields one line for a user who works alone; otherwise a list of addresses, each with the people who
    should use it."""
    yield f"himpc-lab ready at {server.link}"
    shared = server.public or server.hall is not None or _has_an_instructor(server)
    if shared:
        yield from _for_others(server)
    if server.hall is not None:
        yield f"  {'teacher:':{_WIDTH}}{server.teachers_link}"
        yield f"  {'phones:':{_WIDTH}}{server.outside}/v/{server.hall.code}"
        if not server.public:
            yield f"  {'':{_WIDTH}}{ONLY_HERE}"
    if server.continued is not None:
        yield f"  {'continues:':{_WIDTH}}{_CONTINUES.format(len(server.continued.state.members))}"
    if server.passes.token is None:
        yield "  --no-token: " + (_ALL if server.public else _ALL_HERE)
    if shared and server.passes.owner is not None:
        yield "  " + _KEEP


def _has_an_instructor(server: PageServer) -> bool:
    return isinstance(server.sessions, Classroom) and not server.sessions.all_steer


def _for_others(server: PageServer) -> Iterator[str]:
    here = seen_from_outside(server.host, server.url)  # in numbers: few networks resolve a laptop's name
    by_proxy = [("through the proxy:", each) for each in server.proxies]
    for what, address in by_proxy if server.proxy_only else (("for others:", here), *by_proxy):
        link = address if server.proxy_only else server.passes.link(address, "guest")
        yield f"  {what:{_WIDTH}}{link}"
    if isinstance(server.sessions, Classroom) and not server.sessions.all_steer:
        yield f"  {_INSTRUCTOR:{_WIDTH}}{server.sessions.token}"


_CONTINUES = (
    "the class of the last start, with {} people; Ctrl-C ends it, and the next start begins a new class"
)
_KEEP = "Keep the first address secret: its page can run your Python files (not with --no-own-files)."
_ALL = "everybody who can reach this address can open the page, run simulations here and upload robots."
_ALL_HERE = "every user of this machine can open the page, run simulations as you and upload robots."
