"""A page for one test, and ports of other servers."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from app.link.choice import SceneChoice
from app.web.server import PageServer, ServerOptions
from lessons.scenes.run_spec import RunSpec


@contextmanager
def served(choice: SceneChoice | str = "planar3-hold", **options: Any) -> Iterator[PageServer]:
    """Runs a server on a free port until the context ends.

    choice: also the name of a scene. options: those of `PageServer`; by default one learner has room.
    """
    opened = choice if isinstance(choice, SceneChoice) else SceneChoice(RunSpec(choice))
    server = PageServer(opened, ServerOptions(**{"port": 0, "max_sessions": 1, **options}))
    try:
        yield server
    finally:
        server.close()


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def answers(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0
