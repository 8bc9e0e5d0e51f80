"""A simulation process that misbehaves; the name of the scene selects how."""

from __future__ import annotations

import time
from collections.abc import Callable
from multiprocessing.connection import Connection

from app.link.choice import SceneChoice
from app.link.messages import GetRun, Load, Loading, Quit, RunDescription
from lessons.scenes.catalog import load_scene
from lessons.scenes.run_spec import RunSpec


def warm(say: Callable[[str], None]) -> None:
    say("nothing to be done")


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
