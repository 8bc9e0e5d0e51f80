"""A simulation process that misbehaves; the name of the scene selects how. Its fork server is ready sooner
than that of the real worker, and misbehaves as the variable `WARM` of the environment says."""

from __future__ import annotations

import errno
import os
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection

from app.link.choice import SceneChoice
from app.link.messages import GetRun, Load, Loading, Quit, RunDescription
from lessons.scenes.catalog import load_scene
from lessons.scenes.run_spec import RunSpec

WARM = "HIMPC_LAB_WARM"
STEPS, STEP = 10, 0.3
"""How often a slow fork server reports its progress, and the time between two reports, s."""


def warm(say: Callable[[str], None]) -> None:
    say("nothing to be done")
    match os.environ.get(WARM):
        case "broken":
            raise RuntimeError("no fork server today")
        case "threaded":  # a lock that this thread held could never be released in a child
            threading.Thread(target=threading.Event().wait, daemon=True).start()
        case "childless":
            os.fork = _refused
        case "slow":
            for done in range(STEPS):
                say(f"{done} of {STEPS}")
                time.sleep(STEP)
        case _:
            pass


def _refused() -> int:
    raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")


def main(page: Connection) -> None:
    choice = SceneChoice(RunSpec("planar3-hold"))
    settings = load_scene("planar3-hold").settings
    while True:
        command = page.recv()
        match command:
            case Load(choice) if choice.run.scene == "asleep":
                time.sleep(1e6)
            case Load(choice) if choice.run.scene == "busy":
                while True:
                    pass
            case Load(choice) if choice.run.scene == "loads":
                page.send(Loading())
                time.sleep(1e6)
            case GetRun():
                page.send(RunDescription(choice, settings, (), 0.0))
            case Quit():
                return
            case _:
                pass
