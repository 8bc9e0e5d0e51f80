"""Functions by which tests check the processes of simulations."""

from __future__ import annotations

from collections.abc import Callable

import psutil

from app.client.simulation_client import SimulationClient
from app.link.process import wait_until

LONG = 60.0  # s
Start = Callable[..., SimulationClient]


def running(learner: SimulationClient) -> bool:
    status = learner.status
    return learner.trouble() is None and status is not None and status.ticks > 20


def gone(pid: int) -> bool:
    try:
        return psutil.Process(pid).status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


def born(learner: SimulationClient) -> int:
    assert wait_until(lambda: learner.pid is not None, LONG)
    assert learner.pid is not None
    return learner.pid
