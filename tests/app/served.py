"""Functions by which tests start pages and simulations, and check their processes."""

from __future__ import annotations

import http.client
import socket
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import numpy as np
import psutil

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.process import wait_until
from app.web.server import PageServer, ServerOptions
from browsing.wire import Wire
from lessons.scenes.run_spec import RunSpec

LONG = 120.0
"""Time, s, within which everything happens also on a busy machine."""
Start = Callable[..., SimulationClient]


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


@contextmanager
def visited(
    choice: SceneChoice | str = "planar3-hold", **options: Any
) -> Iterator[tuple[Wire, SimulationClient]]:
    """Runs a server with one page, and yields the page and its simulation, which has begun."""
    with served(choice, **options) as server, Wire(server.guest_link if server.hall else server.link) as page:
        assert wait_until(lambda: bool(server.sessions.learners), LONG)
        (learner,) = server.sessions.learners
        assert wait_until(lambda: learner.status is not None, LONG)
        yield page, learner


class Page(NamedTuple):
    """The answer to a request."""

    status: int
    headers: http.client.HTTPMessage
    text: str


def get(address: str, **headers: str) -> Page:
    """Requests an address and follows no redirect. headers: with _ in place of -."""
    parts = urlsplit(address)
    with closing(http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=LONG)) as line:
        named = {name.replace("_", "-"): text for name, text in headers.items()}
        line.request(
            "GET", parts._replace(scheme="", netloc="", path=parts.path or "/").geturl(), headers=named
        )
        answer = line.getresponse()
        return Page(answer.status, answer.headers, answer.read().decode())


def vacated(server: PageServer) -> PageServer:
    """Returns the server after the pages of the previous test have gone."""
    assert wait_until(lambda: not server.sessions.learners, LONG)
    return server


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def answers(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def running(learner: SimulationClient) -> bool:
    status = learner.status
    return learner.trouble() is None and status is not None and status.ticks > 20


def begun(start: Start, scene: str = "planar3-hold") -> SimulationClient:
    """Returns the learner of a new simulation, as soon as that runs."""
    learner = start(scene)
    assert wait_until(lambda: running(learner), LONG)
    return learner


def latest(learner: SimulationClient, field: str) -> np.ndarray:
    """Returns a field of the newest row of telemetry."""
    found = learner.read(lambda run: run.latest[run.layout.fields[field]].copy())
    assert found is not None
    return found


def error(learner: SimulationClient, task: str) -> float:
    """Returns ‖x̃‖ now, m or rad."""
    return float(np.linalg.norm(latest(learner, f"error/{task}")))


def rings() -> int:
    """Returns the number of telemetry rings that this process maps."""
    return Path("/proc/self/maps").read_text().count("memfd:himpc-lab")


def gone(pid: int) -> bool:
    try:
        return psutil.Process(pid).status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


def born(learner: SimulationClient) -> int:
    assert wait_until(lambda: learner.pid is not None, LONG)
    assert learner.pid is not None
    return learner.pid
