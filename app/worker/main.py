"""The simulation process: one `Body`, driven in real time."""

from __future__ import annotations

import os
import signal
import sys
import time
import traceback
from multiprocessing.connection import Connection

from app.link.choice import SceneChoice
from app.link.messages import Command, Failed, Follow, Load, Quit, Refused
from app.worker.follower import follow
from app.worker.pacing import Pacer
from app.worker.simulation import Body
from robots import InputError

POSE_PERIOD = 1 / 60  # s
STATUS_PERIOD = 0.1  # s
SCRIPT_PERIOD = 0.02  # s
_CHUNK = 0.01  # s: the longest run before commands are looked at again


def main(pipe: Connection) -> None:
    """Entry point of the process. Waits (warm, everything imported) for the first scene, then simulates it
    until the page says Quit or is gone."""
    # Ctrl-C in a terminal reaches the whole process group; the page ends its children itself.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        _serve(pipe)
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return  # the page is gone
    except Exception as error:
        traceback.print_exc(file=sys.stderr)
        pipe.send(Failed(_sentence(error)))


def _serve(pipe: Connection) -> None:
    body = _first(pipe)
    if isinstance(body, Follow):
        follow(pipe, body)
        return
    if body is None:
        return
    try:
        _simulate(pipe, body)
    finally:
        body.block.close()


def _first(pipe: Connection) -> Body | Follow | None:
    while True:
        command: Command = pipe.recv()
        if isinstance(command, Quit):
            return None
        if isinstance(command, Follow):
            return command
        if isinstance(command, Load):
            body = _try(pipe, command.choice)
            if body is not None:
                return body


def _try(pipe: Connection, choice: SceneChoice) -> Body | None:
    try:
        body = Body(choice)
    except InputError as error:
        pipe.send(Refused(str(error)))
        return None
    pipe.send(body.ready())
    return body


def _simulate(pipe: Connection, body: Body) -> None:
    pacer = Pacer(time.perf_counter())
    next_pose = next_status = next_script = 0.0
    while True:
        while pipe.poll():
            command: Command = pipe.recv()
            if isinstance(command, Quit):
                return
            answer = body.handle(command)
            if answer is not None:
                pipe.send(answer)
                pacer.rest(time.perf_counter())
        pacer.speed = body.pace
        now = time.perf_counter()
        ran = 0
        if body.running:
            due = pacer.due(now, body.run.step_s)
            ran = _run(body, pacer, due, until=now + _CHUNK)
        else:
            pacer.rest(now)
            body.settle()
            body.tick(body.take_steps())
        now = time.perf_counter()
        if now >= next_pose:
            body.write_poses()
            next_pose = now + POSE_PERIOD
        if now >= next_status:
            # A run as fast as it goes is no computer that cannot keep up.
            capped = pacer.capped(now) and body.pace == body.speed
            pipe.send(body.status(pacer.real_time_factor(now), capped))
            next_status = now + STATUS_PERIOD
        if now >= next_script:
            script = body.leader.script(body.session)
            if script is not None:
                pipe.send(script)
            next_script = now + SCRIPT_PERIOD
        if ran == 0:
            pipe.poll(0.001 if body.busy else 0.02)


def _run(body: Body, pacer: Pacer, due: int, until: float) -> int:
    """Runs up to so many steps, and returns how many it were."""
    for ran in range(due):
        step_s = body.run.step_s
        if body.leader.waits(body.session.t + step_s):
            return ran
        body.advance()
        pacer.ran(1, step_s)
        if time.perf_counter() > until:
            return ran + 1
    return due


def _sentence(error: Exception) -> str:
    """The exception and the place of ours it came from, short enough for a page."""
    frames = traceback.extract_tb(error.__traceback__)
    place = f" ({os.path.basename(frames[-1].filename)}, line {frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {error}{place}"[:600]
