"""Functions by which tests check the processes of simulations."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import psutil

from app.client.simulation_client import SimulationClient
from app.link.process import wait_until

LONG = 60.0  # s
Start = Callable[..., SimulationClient]


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
