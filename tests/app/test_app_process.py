"""Simulations in processes of their own, forked from a server that has imported all modules. They start,
hang, are stopped or killed, and end. Nothing waits for them, and no process or memory is left."""

from __future__ import annotations

import errno
import multiprocessing
import os
import resource
import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import psutil
import pytest
from served import LONG, Start, begun, born, gone, rings, running
from stubborn import STEP, WARM

from app.client import simulation
from app.client.simulation_client import SimulationClient
from app.link import fork_server
from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from app.link.fork_server import SERVER
from app.link.messages import Load, Play, Post, RunDescription
from app.link.process import MOST, Spares, hang_up, receive, send, wait_until
from app.link.ring import MAX_ROWS, MIN_ROWS, Block
from app.web.sessions import WORKER, Sessions
from app.worker.simulation import SimulationRunner
from lessons.events import MoveTarget, Set
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import Ghost

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
LINK = pytest.mark.nightly("app/link", "app/client", "app/worker")


def parent(learner: SimulationClient) -> int:
    return psutil.Process(born(learner)).ppid()


def server() -> int:
    assert wait_until(lambda: SERVER.pid is not None, LONG)
    assert SERVER.pid is not None
    return SERVER.pid


def answers(learner: SimulationClient) -> bool:
    """Returns whether a stubborn simulation lives."""
    return learner.ask(LONG) is not None


def light(start: Start) -> SimulationClient:
    """Returns the first learner of a test with a fork server of its own."""
    learner = start("idle", "stubborn", own_server=True)
    assert answers(learner)
    return learner


# ---------------------------------------------------------------- the usual way


def test_children_are_forked_where_one_thread_lives(start: Start) -> None:
    """The fork server has one thread, because a lock that a second thread holds during a fork would stay
    locked in the child for ever. It outlives who used it first. A child lets the ticks of another end."""
    learner = begun(start, "iiwa14-hold")
    assert parent(learner) == server()
    assert psutil.Process(server()).num_threads() == 1
    child = psutil.Process(born(learner))
    assert child.memory_full_info().uss < 25e6  # its own memory, bytes
    assert os.sched_getscheduler(child.pid) == os.SCHED_BATCH != os.sched_getscheduler(0)
    before, other = server(), Spares(WORKER)
    other.close()
    assert SERVER.pid == before and not gone(before)


def test_a_page_that_shows_the_scene_before_keeps_its_settings(start: Start) -> None:
    """Until a page has built the next scene, it has the settings of the scene that it shows. The settings of
    the next scene may be of another type."""
    learner = begun(start)
    learner.send(Post(Set("horizon", 8)))
    before = learner.ready
    assert before is not None
    assert wait_until(lambda: learner.settings_of(before).horizon == 8, LONG)  # pyright: ignore
    learner.send(Load(SceneChoice.of_lesson(LessonPlace("first-hold-then-reach"))))
    assert wait_until(lambda: learner.ready is not before, LONG)
    now = learner.ready
    assert now is not None
    assert learner.settings_of(before) is before.settings
    assert learner.settings_of(now) is learner.settings is not before.settings
    assert learner.choice_of(before).exercise is None
    later = LessonPlace("first-hold-then-reach", 1)
    learner.send(Load(SceneChoice.of_lesson(later)))
    assert wait_until(lambda: learner.choice_of(now).exercise == later, LONG)
    assert learner.ready is now


def test_a_bad_scene_is_a_sentence_and_the_process_waits(start: Start) -> None:
    learner, refusals = start(RunSpec("hold", urdf="/nowhere/robot.urdf")), list[str]()
    assert wait_until(lambda: bool(refusals.extend(learner.take_messages()[0]) or refusals), LONG)
    assert "/nowhere/robot.urdf" in refusals[0] and learner.failure is None


def test_sessions_resume_end_and_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    """Free memory is given back when the last page has gone, not while one is open, as this takes some
    milliseconds."""
    given: list[int] = []
    monkeypatch.setattr("app.web.sessions.give_back", lambda: given.append(len(sessions.learners)))
    monkeypatch.setattr("app.web.sessions._TIDY", LONG)
    sessions = Sessions(SceneChoice(RunSpec("planar3-hold")), max_sessions=2, grace=1.0)
    try:
        one, two = sessions.enter([]), sessions.enter([])
        assert one is not None and two is not None and one is not two
        assert sessions.enter([]) is None  # full
        assert sessions.enter([one.token]) is None  # attached elsewhere: two tabs never share a robot
        sessions.leave(one)
        assert sessions.enter([]) is None  # the place is reserved for the page that reloads
        assert sessions.enter(["stranger", one.token]) is one  # a reload
        sessions.leave(two)
        assert wait_until(lambda: two not in sessions.learners, LONG)
        assert one in sessions.learners
        sessions.leave(one)
        three = sessions.enter([])
        assert three is not None and three is not one
        assert given == []
        sessions.leave(three)
        assert wait_until(lambda: given == [0], LONG)
    finally:
        sessions.close()
    assert not sessions.learners


# ---------------------------------------------------------------- without the fork server, or with a bad one


@pytest.mark.parametrize("how", ["broken", pytest.param("threaded", marks=LINK)])
def test_without_a_fork_server_children_are_spawned(
    start: Start, how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(WARM, how)
    learner = light(start)
    assert parent(learner) == os.getpid()
    assert answers(start("idle"))


def test_after_a_limit_of_processes_a_page_gets_its_robot(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If no process can be started, the page says why; when there is room again, it gets its robot."""

    def no_spawn(how: Any, *run: Any) -> Any:
        if how._name == "spawn":
            raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")
        return started(how, *run)

    started = fork_server._started
    with monkeypatch.context() as limited:
        limited.setenv(WARM, "childless")
        limited.setattr(fork_server, "_started", no_spawn)
        learner = start("idle", "stubborn", own_server=True)
        assert wait_until(lambda: learner.failure is not None, LONG)
    assert "No simulation can be started: the limit of processes is reached (ulimit -u" in str(
        learner.failure
    )
    trouble = learner.trouble()
    assert trouble is not None and trouble.offer is not None
    learner.restart()
    assert wait_until(lambda: learner.pid is not None, LONG) and answers(learner) and learner.failure is None


def test_a_server_that_nobody_waits_for_any_more_leaves_room_for_the_next(start: Start) -> None:
    """A page that closes at once ends its server before this has connected; the next page has its own."""
    SERVER.end()
    early = Spares("stubborn")
    early.refill()
    SERVER.end()
    early.close()
    assert parent(light(start)) == server()


def test_a_dead_fork_server_takes_nobody_along(start: Start) -> None:
    """Its children live on, and end and start again as others do, also if they are stopped."""
    learner = light(start)
    before, pid = server(), born(learner)
    os.kill(before, signal.SIGKILL)
    assert wait_until(lambda: SERVER.pid is None, LONG)
    another = start("idle")
    assert parent(another) == server() != before and answers(another) and answers(learner)
    os.kill(pid, signal.SIGSTOP)
    learner.restart()
    assert wait_until(lambda: gone(pid), LONG) and answers(learner)
    for each in (learner, another):
        os.kill(born(each), signal.SIGKILL)
        assert wait_until(lambda each=each: "signal 9" in str(each.failure), LONG)
    learner.restart()
    assert answers(learner)


@pytest.mark.parametrize("how", ["", pytest.param("slow", marks=LINK)], ids=["ready", "getting ready"])
def test_a_fork_server_that_is_stopped_is_replaced(
    start: Start, how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A simulation that waits for the stopped server is started from a new one automatically. The stopped
    server is ended, and its children keep running."""
    monkeypatch.setenv(WARM, how)
    waiting = first = start("idle", "stubborn", own_server=True)
    if how:
        assert wait_until(lambda: SERVER.doing.endswith("0"), LONG)
    else:
        assert answers(first)
    before = server()
    os.kill(before, signal.SIGSTOP)
    if not how:
        waiting = start("idle")
    assert wait_until(lambda: gone(before) and waiting.pid is not None, LONG)
    assert answers(waiting) and waiting.failure is None and answers(first)
    assert parent(waiting) == server() != before


@LINK
def test_a_fork_server_that_says_what_it_does_is_not_stuck(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The server counts as alive as long as it reports progress, because a slow machine may take minutes to
    compile."""
    monkeypatch.setenv(WARM, "slow")
    learner = start("idle", "stubborn", own_server=True)
    assert wait_until(lambda: bool(SERVER.doing), LONG)
    before = server()
    monkeypatch.setattr(fork_server, "FIRST_PATIENCE", 5 * STEP)
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
    program.write_text(PROGRAM.format(paths=[str(HERE), str(ROOT)]))
    done = subprocess.run(
        [sys.executable, program], capture_output=True, text=True, timeout=LONG, check=False
    )
    assert done.stdout.split()[0] == "runs" and done.stdout.count("runs") == 1, done.stdout
    assert done.stdout.split()[1].isdigit() and not done.stderr, done.stderr


# ---------------------------------------------------------------- simulations that do not answer


def test_nobody_waits_for_a_stopped_child(start: Start) -> None:
    """Calls of a stopped simulation return at once although its pipe is full, the user gets a notice about
    lost commands, and a restart does not wait. One that goes on is no trouble any more."""
    learner, other = begun(start), begun(start)
    pid = born(learner)
    os.kill(pid, signal.SIGSTOP)
    calls = threading.Thread(target=lambda: flood(learner), daemon=True)
    calls.start()
    calls.join(LONG)
    assert not calls.is_alive()
    assert any("is lost" in notice for notice in learner.take_messages()[1])
    os.kill(born(other), signal.SIGSTOP)
    assert wait_until(lambda: None not in (learner.trouble(), other.trouble()), LONG)
    said = learner.trouble()
    assert said is not None and said.state == "SILENT" and "not reported anything" in said.sentence
    os.kill(born(other), signal.SIGCONT)
    assert wait_until(lambda: running(other), LONG)
    learner.reset_all()
    assert wait_until(lambda: running(learner), LONG)
    assert wait_until(lambda: gone(pid), LONG)


def flood(learner: SimulationClient) -> None:
    for _ in range(20 * MOST):
        learner.send(Post(MoveTarget("position", (0.5, 0.1, 0.0))))


def test_a_load_that_hangs_can_be_cancelled(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    learner = start("planar3-hold", "stubborn")
    pid = born(learner)
    learner.send(Load(SceneChoice(RunSpec("loads"))))
    assert wait_until(lambda: learner.trouble() is not None, LONG)
    said = learner.trouble()
    assert said is not None and (said.state, said.offer) == ("LOADING", "Cancel")
    assert "of at most 30 s" in said.sentence
    monkeypatch.setattr(simulation, "DEADLINE", 3.5)
    assert wait_until(lambda: getattr(learner.trouble(), "state", "") == "SILENT", LONG)
    assert not gone(pid)  # the machine may only be slow, so the user decides
    learner.restart()
    assert wait_until(lambda: gone(pid), LONG)
    assert learner.choice.run.scene == "planar3-hold"
    assert answers(learner)


@pytest.mark.parametrize("scene", [None, "panda-hold"])
def test_what_is_pressed_before_a_death_is_known_is_done(start: Start, scene: str | None) -> None:
    """*Reset all*, or another scene, is requested after a child's death and before this death is detected."""
    learner = begun(start)
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
    learner = begun(start)
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


Answers = list[RunDescription | None]


def asked(learner: SimulationClient, times: int) -> tuple[Answers, list[threading.Thread]]:
    """Asks on threads; returns the list that gets the answers, and the threads."""
    answered: Answers = []
    asking = [threading.Thread(target=lambda: answered.append(learner.ask(10 * LONG))) for _ in range(times)]
    for each in asking:
        each.start()
    return answered, asking


def test_quick_questions_are_all_answered_and_one_to_who_dies_at_once(start: Start) -> None:
    answered, asking = asked(start("planar3-hold", "stubborn"), 8)
    for each in asking:
        each.join(LONG)
    assert len(answered) == 8 and all(isinstance(each, RunDescription) for each in answered)
    asleep = start("asleep")
    pid = born(asleep)
    answered, (one,) = asked(asleep, 1)
    assert wait_until(lambda: bool(asleep._run_requests._waiting), LONG)
    os.kill(pid, signal.SIGKILL)
    one.join(LONG)
    assert answered == [None]


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
    code = PAGE.format(paths=[str(HERE), str(ROOT)], spawn=spawn)
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


def test_children_take_sigterm(start: Start) -> None:
    for learner in [start(scene, "stubborn") for scene in ("asleep", "busy", "idle")]:
        pid = born(learner)
        os.kill(pid, signal.SIGTERM)
        assert wait_until(lambda pid=pid: gone(pid), LONG)
        assert wait_until(lambda learner=learner: "signal 15" in str(learner.failure), LONG)


# ---------------------------------------------------------------- memory


def test_no_child_and_no_memory_is_left(start: Start) -> None:
    """A `Ready` message that arrives after the learner was closed is discarded, and its memory is released.
    One that breaks off before its file leaves no open file."""
    learner = begun(start)
    pid, before = learner.pid, rings()
    assert pid is not None and before > 0
    learner.close()
    assert wait_until(lambda: not psutil.pid_exists(pid), LONG)
    assert rings() == before - 1
    late = SimulationRunner(SceneChoice(RunSpec("planar3-hold")))
    ends: tuple[Any, Any] = multiprocessing.Pipe()
    here, there = ends
    files = open_files()
    send(there, late.ready())
    ready = receive(here)
    assert os.fstat(ready.block)
    learner._hear(learner._process, ready)
    with pytest.raises(OSError):
        os.fstat(ready.block)
    there.send(late.ready())  # the file does not follow
    hang_up(there)
    with pytest.raises(OSError, match="did not arrive"):
        receive(here)
    assert open_files() == files
    for each in (here, there, late):
        each.close()


def open_files() -> int:
    return len(os.listdir("/proc/self/fd"))


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
    command = [sys.executable, "-c", code]
    return subprocess.run(
        command, cwd=ROOT, preexec_fn=smaller, capture_output=True, text=True, check=True
    ).stdout.strip()


def test_files_arrive_with_their_message(start: Start) -> None:
    """A ring has no name in the file system: the page holds its file descriptor, which stays valid after the
    child's death, and releases it."""
    learner = begun(start)
    before = open_files()
    for _ in range(5):
        learner.send(Load(SceneChoice(RunSpec("panda-hold"))))
        learner.send(Load(SceneChoice(RunSpec("planar3-hold"))))
    learner.send(Play(False))
    assert wait_until(lambda: learner.status is not None and not learner.status.running, LONG)
    assert open_files() <= before
    assert isinstance(learner.read(lambda run: run.block), Block)
