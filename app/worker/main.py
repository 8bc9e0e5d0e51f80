"""The simulation process: runs one `SimulationRunner` in real time and never skips a tick. `rehearse` is
called in the fork server and loads everything that a simulation needs."""

from __future__ import annotations

import os
import pickle
import signal
import sys
import time
import traceback
from contextlib import suppress
from multiprocessing.connection import Connection

from app.link.choice import SceneChoice
from app.link.messages import Command, FollowLeader, Load, Loading, LoadRefused, Quit, SimulationFailed
from app.link.process import send
from app.worker.ghost import follow
from app.worker.simulation import SimulationRunner
from lessons.scenes.run_spec import RunSpec
from robots import InputError

BACKLOG = 0.1
"""Largest time, s, by which the simulation may be late: real time if the requested speed is above 1,
otherwise simulated time. If it is later, simulated time slows down and no further work accumulates."""
_MEMORY = 1.0
"""Time, s, over which the real-time factor is averaged and for which a slowdown is shown."""


class Pacer:
    """Computes the simulated time that is due. Times are arguments, so that tests need no clock."""

    def __init__(self, now: float) -> None:
        self.speed = 1.0
        self._last = now
        self._debt = 0.0
        self._capped_at = -float("inf")
        self._window: tuple[float, float] = (now, 0.0)
        self._ran = 0.0
        self._factor = 0.0

    def due(self, now: float, T_s: float) -> int:
        """Returns the number of ticks to run now."""
        self._debt += (now - self._last) * self.speed
        self._last = now
        most = BACKLOG * max(1.0, self.speed)
        if self._debt > most:
            self._debt = most
            self._capped_at = now
        return int(self._debt / T_s + 1e-9)

    def ran(self, ticks: int, T_s: float) -> None:
        """Notes that this number of ticks was run."""
        self._debt -= ticks * T_s
        self._ran += ticks * T_s

    def rest(self, now: float) -> None:
        """Called while the simulation is paused or loads a scene. This time does not count as due."""
        self._last = now
        self._debt = 0.0
        self._window = (now, self._ran)
        self._factor = 0.0
        self._capped_at = -float("inf")

    def capped(self, now: float) -> bool:
        """Returns whether simulated time was slowed down within the last second."""
        return now - self._capped_at < _MEMORY

    def real_time_factor(self, now: float) -> float:
        """Returns simulated over real seconds, averaged over about a second."""
        start, ran = self._window
        if now - start >= 0.5 * _MEMORY:
            self._factor = (self._ran - ran) / (now - start)
            self._window = (now, self._ran)
        return self._factor


POSE_PERIOD = 1 / 60  # s
STATUS_PERIOD = 0.1  # s
SCRIPT_PERIOD = 0.02  # s
CODE_PERIOD = 1.0
"""Shortest time, s, between two state codes while settings change."""
_CHUNK = 0.01  # s: the longest run between two checks for commands
_BEAT = 0.004
"""Time, s, between two checks for steps that are due. If the process woke up for each tick of a millisecond,
it would need three times as much processor time, as the caches are cold each time. A command wakes the
process at once."""
_IDLE = 0.02  # s: time between two checks while the simulation is idle
_STIR = 0.3  # s: for this time after a command or a run, an idle simulation reports as often as a running one
PULSE = 0.5
"""Time, s, between two reports of a simulation that rests: it is idle, and received no command for _STIR."""


_USUAL = ("iiwa14-hold", "ridgeback-ur10-square")


def rehearse() -> None:
    """Runs both kinds of controllers for a moment. Everything that is loaded on first use is then loaded."""
    for scene in _USUAL:
        body = SimulationRunner(SceneChoice(RunSpec(scene)))
        body.tick(3)
        pickle.dumps(body.ready())
        pickle.dumps(body.status())
        body.close()


def main(page: Connection) -> None:
    """Entry point of the process, called after all imports. Waits for the first scene, then simulates it
    until the page sends Quit or ends."""
    # Ctrl-C in a terminal reaches the whole process group; the page itself ends its children.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _let_ticks_end()
    try:
        _serve(page)
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return  # the page has ended
    except Exception as error:
        traceback.print_exc(file=sys.stderr)
        send(page, SimulationFailed(_sentence(error)))


def _let_ticks_end() -> None:
    """Lets a tick finish before another simulation gets the core. With eight simulations on two cores, this
    reduces the number of late ticks by a third."""
    if hasattr(os, "SCHED_BATCH"):  # only on Linux
        with suppress(OSError):  # forbidden in some containers
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


def _serve(page: Connection) -> None:
    body = _first(page)
    if isinstance(body, FollowLeader):
        follow(page, body)
        return
    if body is None:
        return
    try:
        _simulate(page, body)
    finally:
        body.block.close()


def _first(page: Connection) -> SimulationRunner | FollowLeader | None:
    while True:
        command: Command = page.recv()
        if isinstance(command, Quit):
            return None
        if isinstance(command, FollowLeader):
            return command
        if isinstance(command, Load):
            body = _try(page, command.choice)
            if body is not None:
                return body


def _try(page: Connection, choice: SceneChoice) -> SimulationRunner | None:
    send(page, Loading())
    try:
        body = SimulationRunner(choice)
    except InputError as error:
        send(page, LoadRefused(str(error)))
        return None
    send(page, body.ready())
    return body


def _simulate(page: Connection, body: SimulationRunner) -> None:
    pacer = Pacer(time.perf_counter())
    next_pose = next_status = next_script = next_code = 0.0
    stirred = time.perf_counter()
    while True:
        while page.poll():
            command: Command = page.recv()
            stirred, next_status = time.perf_counter(), min(next_status, time.perf_counter() + STATUS_PERIOD)
            if isinstance(command, Quit):
                return
            if isinstance(command, Load):
                send(page, Loading())
                next_code = 0.0
            answer = body.handle(command)
            if answer is not None:
                send(page, answer)
                pacer.rest(time.perf_counter())
        pacer.speed = body.pace
        now = time.perf_counter()
        behind = False
        if body.running:
            due = pacer.due(now, body.session.step_s)
            behind = 0 < _run(body, pacer, due, until=now + _CHUNK) < due
        else:
            pacer.rest(now)
            body.settle()
            body.tick(body.take_steps())
        news = body.news()
        if news is not None:
            send(page, news)
        now = time.perf_counter()
        if body.busy:
            stirred = now
        rests = now - stirred > _STIR
        if now >= next_pose and not rests:
            body.write_poses()
            next_pose = now + POSE_PERIOD
        if now >= next_status:
            # A run at full speed never reaches the requested speed, and does not count as slowed down.
            capped = pacer.capped(now) and body.pace == body.speed
            status = body.status(pacer.real_time_factor(now), capped, coded=now >= next_code)
            send(page, status)
            if status.code is not None:
                next_code = now + CODE_PERIOD
            next_status = now + (PULSE if rests else STATUS_PERIOD)
        if now >= next_script:
            script = body.leader.script(body.session)
            if script is not None:
                send(page, script)
            next_script = now + SCRIPT_PERIOD
        if rests:
            page.poll(max(0.0, next_status - time.perf_counter()))
        elif not behind:
            page.poll(_BEAT if body.busy else _IDLE)


def _run(body: SimulationRunner, pacer: Pacer, due: int, until: float) -> int:
    """Runs at most `due` steps; returns the number of steps that were run."""
    for ran in range(due):
        step_s = body.session.step_s
        if body.leader.waits(body.session.t + step_s):
            return ran
        body.advance()
        pacer.ran(1, step_s)
        if time.perf_counter() > until:
            return ran + 1
    return due


def _sentence(error: Exception) -> str:
    """Returns the exception and the line of our code that raised it, in a text that is short enough for a
    page."""
    frames = traceback.extract_tb(error.__traceback__)
    place = f" ({os.path.basename(frames[-1].filename)}, line {frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {error}{place}"[:600]
