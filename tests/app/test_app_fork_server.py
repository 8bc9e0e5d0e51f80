"""Simulations are forked from a server that has imported all modules; if it fails, they are spawned
instead."""

from __future__ import annotations

import os
import signal

import psutil
import pytest
from children import LONG, Start, born, gone, running

from app.client.simulation_client import SimulationClient
from app.link import forkserver
from app.link.forkserver import ForkServer
from app.link.process import wait_until


def server_of(learner: SimulationClient) -> ForkServer:
    server = learner._spares.server
    assert server is not None
    return server


def test_children_are_forked_where_one_thread_lives(start: Start) -> None:
    """The fork server has one thread, because a lock that a second thread holds during a fork would stay
    locked in the child for ever."""
    learner = start("iiwa14-hold", own_server=True)
    assert wait_until(lambda: running(learner), LONG)
    server = psutil.Process(server_of(learner).pid)
    assert psutil.Process(born(learner)).ppid() == server.pid
    assert server.num_threads() == 1
    assert psutil.Process(born(learner)).memory_full_info().uss < 25e6  # its own memory, bytes


@pytest.mark.parametrize("worker", ["broken", "threaded"])
def test_without_a_fork_server_children_are_spawned(start: Start, worker: str) -> None:
    learner = start("planar3-hold", worker)
    assert wait_until(lambda: running(learner), LONG)
    assert psutil.Process(born(learner)).ppid() == os.getpid()
    another = start("planar3-hold")
    assert wait_until(lambda: running(another), LONG)


def test_a_dead_fork_server_takes_nobody_along(start: Start) -> None:
    learner = start("planar3-hold", own_server=True)
    assert wait_until(lambda: running(learner), LONG)
    server = server_of(learner)
    os.kill(server.pid, signal.SIGKILL)
    assert wait_until(lambda: not server.alive, LONG)
    another = start("planar3-hold")
    assert wait_until(lambda: running(another), LONG)
    assert server_of(another) is not server and running(learner)
    os.kill(born(learner), signal.SIGKILL)
    assert wait_until(lambda: learner.failure is not None, LONG)
    learner.reset_all()
    assert wait_until(lambda: running(learner), LONG)


def test_a_fork_server_that_is_stopped_is_replaced(start: Start) -> None:
    """A simulation that waits for the stopped server is started from a new one automatically. The stopped
    server is ended, and its children keep running."""
    learner = start("planar3-hold", own_server=True)
    assert wait_until(lambda: running(learner), LONG)
    before = server_of(learner)
    os.kill(before.pid, signal.SIGSTOP)
    waiting = start("planar3-hold")
    assert wait_until(lambda: gone(before.pid), LONG)
    assert wait_until(lambda: running(waiting), LONG)
    assert waiting.failure is None and running(learner)
    assert psutil.Process(born(waiting)).ppid() == server_of(waiting).pid != before.pid


def test_a_fork_server_that_is_stopped_while_it_gets_ready_is_replaced(start: Start) -> None:
    learner = start("idle", "slow")
    before = server_of(learner)
    assert wait_until(lambda: bool(before.doing), LONG)
    os.kill(before.pid, signal.SIGSTOP)
    assert wait_until(lambda: gone(before.pid) and learner.pid is not None, LONG)
    assert psutil.Process(born(learner)).ppid() == server_of(learner).pid != before.pid


def test_a_fork_server_that_says_what_it_does_is_not_stuck(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The server counts as alive as long as it reports progress, because a slow machine may take minutes to
    compile."""
    learner = start("idle", "slow")
    server = server_of(learner)
    assert wait_until(lambda: bool(server.doing), LONG)
    monkeypatch.setattr(forkserver, "FIRST_PATIENCE", 3.0)
    seen: set[str] = set()

    def gets_ready() -> bool:
        seen.add(server.doing)
        return server.ready or not server.alive or server.stuck

    assert wait_until(gets_ready, LONG)
    assert server.ready and len(seen) > 2
    assert psutil.Process(born(learner)).ppid() == server.pid
