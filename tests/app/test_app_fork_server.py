"""Simulations are forked from a server that has imported all modules; if it fails, they are spawned
instead."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest
from children import LONG, Start, born, gone, running

from app.client.simulation_client import SimulationClient
from app.link import fork_server
from app.link.fork_server import SERVER
from app.link.process import Spares, wait_until
from app.web.sessions import WORKER

HERE = Path(__file__).parent
LINK = pytest.mark.nightly("app/link", "app/client", "app/worker")


def parent(learner: SimulationClient) -> int:
    return psutil.Process(born(learner)).ppid()


def server() -> int:
    assert wait_until(lambda: SERVER.pid is not None, LONG)
    assert SERVER.pid is not None
    return SERVER.pid


def test_children_are_forked_where_one_thread_lives(start: Start) -> None:
    """The fork server has one thread, because a lock that a second thread holds during a fork would stay
    locked in the child for ever."""
    learner = start("iiwa14-hold", own_server=True)
    assert wait_until(lambda: running(learner), LONG)
    assert parent(learner) == server()
    assert psutil.Process(server()).num_threads() == 1
    assert psutil.Process(born(learner)).memory_full_info().uss < 25e6  # its own memory, bytes


@pytest.mark.parametrize("worker", ["broken", pytest.param("threaded", marks=LINK)])
def test_without_a_fork_server_children_are_spawned(start: Start, worker: str) -> None:
    learner = start("planar3-hold", worker, own_server=True)
    assert wait_until(lambda: running(learner), LONG)
    assert parent(learner) == os.getpid()
    another = start("planar3-hold")
    assert wait_until(lambda: running(another), LONG)


def test_a_server_that_nobody_waits_for_any_more_leaves_room_for_the_next(start: Start) -> None:
    """A page that closes at once ends its server before this has connected; the next page has its own."""
    SERVER.end()
    early = Spares(WORKER)
    early.refill()
    SERVER.end()
    early.close()
    learner = start("planar3-hold", own_server=True)
    assert wait_until(lambda: running(learner), LONG)
    assert parent(learner) == server()


def test_a_dead_fork_server_takes_nobody_along(start: Start) -> None:
    learner = start("planar3-hold", own_server=True)
    assert wait_until(lambda: running(learner), LONG)
    before = server()
    os.kill(before, signal.SIGKILL)
    assert wait_until(lambda: SERVER.pid is None, LONG)
    another = start("planar3-hold")
    assert wait_until(lambda: running(another), LONG)
    assert parent(another) == server() != before and running(learner)
    os.kill(born(learner), signal.SIGKILL)
    assert wait_until(lambda: learner.failure is not None, LONG)
    learner.reset_all()
    assert wait_until(lambda: running(learner), LONG)
    os.kill(born(another), signal.SIGKILL)
    assert wait_until(lambda: "signal 9" in str(another.failure), LONG)


@LINK
def test_a_robot_without_its_fork_server_can_be_ended(start: Start) -> None:
    """A child whose fork server has died is ended as others are, also if it is stopped."""
    learner = start("planar3-hold", own_server=True)
    assert wait_until(lambda: running(learner), LONG)
    pid = born(learner)
    os.kill(server(), signal.SIGKILL)
    assert wait_until(lambda: SERVER.pid is None, LONG)
    another = start("planar3-hold")
    assert wait_until(lambda: running(another), LONG)
    os.kill(pid, signal.SIGSTOP)
    learner.restart()
    assert wait_until(lambda: gone(pid) and running(learner), LONG)


def test_a_fork_server_that_is_stopped_is_replaced(start: Start) -> None:
    """A simulation that waits for the stopped server is started from a new one automatically. The stopped
    server is ended, and its children keep running."""
    learner = start("planar3-hold", own_server=True)
    assert wait_until(lambda: running(learner), LONG)
    before = server()
    os.kill(before, signal.SIGSTOP)
    waiting = start("planar3-hold")
    assert wait_until(lambda: gone(before), LONG)
    assert wait_until(lambda: running(waiting), LONG)
    assert waiting.failure is None and running(learner)
    assert parent(waiting) == server() != before


@LINK
def test_a_fork_server_that_is_stopped_while_it_gets_ready_is_replaced(start: Start) -> None:
    learner = start("idle", "slow", own_server=True)
    assert wait_until(lambda: bool(SERVER.doing), LONG)
    before = server()
    os.kill(before, signal.SIGSTOP)
    assert wait_until(lambda: gone(before) and learner.pid is not None, LONG)
    assert parent(learner) == server() != before


@LINK
def test_a_fork_server_that_says_what_it_does_is_not_stuck(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The server counts as alive as long as it reports progress, because a slow machine may take minutes to
    compile."""
    learner = start("idle", "slow", own_server=True)
    assert wait_until(lambda: bool(SERVER.doing), LONG)
    before = server()
    monkeypatch.setattr(fork_server, "FIRST_PATIENCE", 3.0)
    seen: set[str] = set()

    def gets_ready() -> bool:
        seen.add(SERVER.doing)
        return SERVER.ready or SERVER.pid != before

    assert wait_until(gets_ready, LONG)
    assert SERVER.ready and len(seen) > 2
    assert parent(learner) == before == server()


PROGRAM = """
import sys
sys.path[:0] = {paths!r}
print("runs", flush=True)
from app.link.fork_server import SERVER
from app.link.process import Spares, wait_until
spares = Spares("stubborn")
process = spares.take()
assert wait_until(lambda: process.pid is not None, 60.0)
print(process.pid, flush=True)
process.close()
spares.close()
"""


def test_children_do_not_run_the_page_s_program_again(tmp_path: Path) -> None:
    """A user's program that opens the page may have no `if __name__ == "__main__"`."""
    program = tmp_path / "mine.py"
    program.write_text(PROGRAM.format(paths=[str(HERE), str(HERE.parents[1])]))
    done = subprocess.run(
        [sys.executable, program], capture_output=True, text=True, timeout=LONG, check=False
    )
    assert done.stdout.split()[0] == "runs" and done.stdout.count("runs") == 1, done.stdout
    assert done.stdout.split()[1].isdigit() and not done.stderr, done.stderr
