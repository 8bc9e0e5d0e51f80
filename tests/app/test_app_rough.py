"""Simulations and pages that hang, are stopped or are killed: nothing else waits for them, and no process or
memory is left."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import threading
from pathlib import Path

import psutil
import pytest
from children import LONG, Start, born, gone, running

from app.client import simulation
from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.messages import Load, Play, Post, RunDescription
from app.link.process import MOST, wait_until
from app.link.ring import MAX_ROWS, MIN_ROWS, Block
from lessons.events import MoveTarget
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import Ghost

HERE = Path(__file__).parent


# ---------------------------------------------------------------- simulations that do not answer


def test_nobody_waits_for_a_stopped_child(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    """Calls of a stopped simulation return at once although its pipe is full, the user gets a notice about
    lost commands, and a restart does not wait."""
    learner, other = start("planar3-hold"), start("planar3-hold")
    assert wait_until(lambda: running(learner) and running(other), LONG)
    pid = born(learner)
    os.kill(pid, signal.SIGSTOP)
    calls = threading.Thread(target=lambda: flood(learner), daemon=True)
    calls.start()
    calls.join(LONG)
    assert not calls.is_alive()
    assert any("is lost" in notice for notice in learner.take_messages()[1])
    assert wait_until(lambda: learner.trouble() is not None, LONG)
    said = learner.trouble()
    assert said is not None and said.state == "SILENT" and "not reported anything" in said.sentence
    assert running(other)
    learner.reset_all()
    assert wait_until(lambda: running(learner), LONG)
    assert wait_until(lambda: gone(pid), LONG)


def flood(learner: SimulationClient) -> None:
    for _ in range(20 * MOST):
        learner.send(Post(MoveTarget("position", (0.5, 0.1, 0.0))))


def test_a_child_that_goes_on_is_no_trouble_any_more(start: Start) -> None:
    learner = start("planar3-hold")
    assert wait_until(lambda: running(learner), LONG)
    os.kill(born(learner), signal.SIGSTOP)
    assert wait_until(lambda: learner.trouble() is not None, LONG)
    os.kill(born(learner), signal.SIGCONT)
    assert wait_until(lambda: learner.trouble() is None, LONG)


def test_a_load_that_hangs_can_be_cancelled(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    learner = start("planar3-hold", "stubborn")
    pid = born(learner)
    learner.send(Load(SceneChoice(RunSpec("loads"))))
    assert wait_until(lambda: learner.trouble() is not None, LONG)
    said = learner.trouble()
    assert (
        said is not None
        and (said.state, said.offer) == ("LOADING", "Cancel")
        and "of at most 30 s" in said.sentence
    )
    monkeypatch.setattr(simulation, "DEADLINE", 3.5)
    assert wait_until(lambda: getattr(learner.trouble(), "state", "") == "SILENT", LONG)
    assert not gone(pid)  # the machine may only be slow, so the user decides
    learner.restart()
    assert wait_until(lambda: gone(pid), LONG)
    assert learner.choice.run.scene == "planar3-hold"
    assert learner.ask() is not None


@pytest.mark.parametrize("scene", [None, "panda-hold"])
def test_what_is_pressed_before_a_death_is_known_is_done(start: Start, scene: str | None) -> None:
    """*Reset all*, or another scene, is requested after a child's death and before this death is detected."""
    learner = start("planar3-hold")
    assert wait_until(lambda: running(learner), LONG)
    pid, ready = born(learner), learner.ready
    with learner._lock:  # no message is processed meanwhile
        os.kill(pid, signal.SIGKILL)
        assert wait_until(lambda: gone(pid), LONG)
        if scene is None:
            learner.reset_all()
        else:
            learner.load(SceneChoice(RunSpec(scene)))
    assert wait_until(lambda: learner.ready is not ready and running(learner), LONG)
    assert learner.choice.run.scene == (scene or "planar3-hold") and learner.failure is None
    os.kill(born(learner), signal.SIGKILL)  # the command is not repeated after a second death
    assert wait_until(lambda: learner.failure is not None, LONG)


def test_a_ghost_that_hangs_is_started_again_with_its_robot(start: Start) -> None:
    learner = start("planar3-hold")
    assert wait_until(lambda: running(learner), LONG)
    learner.start_ghost(Ghost("N = 1", ("horizon=1",)))
    ghost = learner.ghost
    assert ghost is not None and wait_until(lambda: ghost.status is not None, LONG)
    pid = ghost.pid
    assert pid is not None
    os.kill(pid, signal.SIGSTOP)
    assert wait_until(lambda: learner.trouble() is not None, LONG)
    said = learner.trouble()
    assert said is not None and said.sentence.startswith("The ghost")
    learner.reset_all()
    assert wait_until(lambda: gone(pid) and running(learner), LONG)
    now = learner.ghost
    assert now is not None and wait_until(lambda: now.status is not None and now.status.t > 0.2, LONG)


def test_quick_questions_are_all_answered(start: Start) -> None:
    learner = start("planar3-hold", "stubborn")
    answers: list[RunDescription | None] = []
    asking = [threading.Thread(target=lambda: answers.append(learner.ask(LONG))) for _ in range(8)]
    for each in asking:
        each.start()
    for each in asking:
        each.join(LONG)
    assert len(answers) == 8 and all(isinstance(answer, RunDescription) for answer in answers)


def test_a_question_to_who_dies_is_answered_at_once(start: Start) -> None:
    learner = start("asleep", "stubborn")
    pid = born(learner)
    answers: list[RunDescription | None] = []
    asking = threading.Thread(target=lambda: answers.append(learner.ask(10 * LONG)))
    asking.start()
    assert wait_until(lambda: bool(learner._run_requests._waiting), LONG)
    os.kill(pid, signal.SIGKILL)
    asking.join(LONG)
    assert answers == [None]


# ---------------------------------------------------------------- ends

PAGE = """
import sys, time, os, signal
sys.path[:0] = {paths!r}
from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from lessons.scenes.run_spec import RunSpec
from app.link.fork_server import SERVER
from app.link.process import Spares, wait_until
spares = Spares("stubborn")
if {spawn}:
    SERVER._forks = False
names = ("asleep", "busy", "idle", "stopped")
learners = [SimulationClient(name, SceneChoice(RunSpec(name)), spares) for name in names]
assert wait_until(lambda: all(each.pid for each in learners), 60.0)
print(*(each.pid for each in learners), *([] if {spawn} else [SERVER.pid]), flush=True)
time.sleep(1e6)
"""


@pytest.mark.parametrize("spawn", [False, True])
def test_a_page_that_is_killed_leaves_nobody_behind(spawn: bool) -> None:
    """All child processes end with the page, whether they compute, sleep, wait or are stopped."""
    code = PAGE.format(paths=[str(HERE), str(HERE.parents[1])], spawn=spawn)
    page = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert page.stdout is not None
    pids = [int(word) for word in page.stdout.readline().split()]
    assert len(pids) == (4 if spawn else 5)
    busy = psutil.Process(pids[1])
    assert wait_until(lambda: busy.status() == psutil.STATUS_RUNNING, LONG)
    if not spawn:  # a spawned process that is stopped during its first imports cannot end with its parent
        os.kill(pids[3], signal.SIGSTOP)
    page.kill()
    page.communicate()
    assert wait_until(lambda: all(gone(pid) for pid in pids), LONG), [pid for pid in pids if not gone(pid)]


@pytest.mark.parametrize("scene", ["asleep", "busy", "idle"])
def test_a_child_takes_sigterm(start: Start, scene: str) -> None:
    learner = start(scene, "stubborn")
    pid = born(learner)
    os.kill(pid, signal.SIGTERM)
    assert wait_until(lambda: gone(pid), LONG)
    assert wait_until(lambda: "signal 15" in str(learner.failure), LONG)


# ---------------------------------------------------------------- memory


def test_a_ring_is_as_large_as_there_is_memory() -> None:
    """On a machine with little memory the ring is smaller, and with too little memory one sentence is shown.
    No run crashes later."""
    width = 180
    assert measured(width, None) == f"{min(MAX_ROWS, 12_000_000 // (8 * width))}"
    assert int(measured(width, 4_000_000)) in range(MIN_ROWS, 2800)
    assert "There is no memory for the telemetry" in measured(width, 100_000)


def measured(width: int, limit: int | None) -> str:
    """Returns the number of rows of a ring that was written completely, in a process with limited file size;
    or the error message."""
    code = (
        "import numpy as np; from app.link.ring import Block; from robots import InputError\n"
        "try:\n"
        f"    block = Block({width}, 8)\n"
        "except InputError as error:\n"
        "    print(error)\n"
        "else:\n"
        f"    [block.write(np.ones({width})) for _ in range(block.rows)]\n"
        "    print(block.rows)\n"
    )
    smaller = None if limit is None else (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=HERE.parents[1],
        env={**os.environ, "PYTHONPATH": str(HERE.parents[1])},
        preexec_fn=smaller,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()


def test_files_arrive_with_their_message(start: Start) -> None:
    """A ring has no name in the file system: the page holds its file descriptor, which stays valid after the
    child's death, and releases it."""
    learner = start("planar3-hold")
    assert wait_until(lambda: running(learner), LONG)
    open_before = len(os.listdir("/proc/self/fd"))
    for _ in range(5):
        learner.send(Load(SceneChoice(RunSpec("panda-hold"))))
        learner.send(Load(SceneChoice(RunSpec("planar3-hold"))))
    learner.send(Play(False))
    assert wait_until(lambda: learner.status is not None and not learner.status.running, LONG)
    assert len(os.listdir("/proc/self/fd")) <= open_before
    assert isinstance(learner.read(lambda recording: recording.block), Block)
