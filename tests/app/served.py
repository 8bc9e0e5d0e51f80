"""Functions by which tests start pages and simulations, and check their processes."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psutil

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.process import wait_until
from app.web.server import PageServer, ServerOptions
from lessons.scenes.run_spec import RunSpec

LONG = 60.0
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
