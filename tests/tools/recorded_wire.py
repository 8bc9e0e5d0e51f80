"""Stores what the page of every scene, step and challenge sends to a browser, and compares two such records.

    python -m tests.tools.recorded_wire store FOLDER [NAME …]
    python -m tests.tools.recorded_wire compare FOLDER [NAME …]

A record lists the controls (type, label, hint, options, smallest and largest value) and the objects of the 3D
view. It is used when code of the page moves: the record before and the record after must be equal. NAME is a
part of the name of a scene or a step; without a name, all are recorded, which takes some minutes.
"""

from __future__ import annotations

import difflib
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace, parts_of
from app.link.messages import Play
from app.web.server import PageServer, ServerOptions
from browsing.wire import Wire, eventually
from lessons.course import COURSE, load_lesson
from lessons.scenes.names import ALL_SCENES
from lessons.scenes.run_spec import RunSpec

_QUIET = 1.5
"""Time, s, without a new control or object after which a page is complete."""
_PROPS = ("label", "hint", "options", "min", "max")


def places() -> Iterator[tuple[str, SceneChoice]]:
    """Yields every scene, and every step and challenge of the course, with its name."""
    for scene in ALL_SCENES:
        if scene != "hold":  # needs a URDF
            yield scene, SceneChoice(RunSpec(scene))
    for name in COURSE:
        for step in range(len(parts_of(load_lesson(name)))):
            yield f"{name}.{step + 1}", SceneChoice.of_lesson(LessonPlace(name, step)).resolved()


def recorded(server: PageServer, choice: SceneChoice) -> list[str]:
    """Opens a page and returns one line for each control and object, sorted."""
    server.sessions.start = choice  # pyright: ignore
    with Wire(server.url) as wire:
        assert eventually(lambda: bool(server.sessions.learners), 120.0)
        (learner,) = server.sessions.learners
        learner.send(Play(False))  # the controls of a mission depend on its progress
        assert eventually(lambda: learner.status is not None, 120.0), learner.failure
        assert eventually(
            lambda: any(each["type"] == "GuiTabGroupMessage" for each in list(wire.made)), 120.0
        )
        known, since = (0, 0), time.monotonic()
        while time.monotonic() < since + _QUIET:
            time.sleep(0.1)
            if known != (known := (len(wire.made), len(wire.nodes))):
                since = time.monotonic()
        controls = [
            f"{each['type']} " + " ".join(f"{name}={each['props'].get(name)!r}" for name in _PROPS)
            for each in list(wire.controls.values())
        ]
        lines = sorted((*controls, *(f"{kind} {name}" for name, kind in list(wire.nodes.items()))))
    assert eventually(lambda: not server.sessions.learners)
    return lines


def main(task: str, folder: Path, *names: str) -> int:
    """Returns the number of records that differ; 0 after `store`."""
    folder.mkdir(parents=True, exist_ok=True)
    server = PageServer(
        SceneChoice(RunSpec("iiwa14-hold")), ServerOptions(port=0, max_sessions=1, grace=0.0, ask_token=False)
    )
    different = 0
    for name, choice in places():
        if names and not any(each in name for each in names):
            continue
        file, lines = folder / f"{name}.txt", recorded(server, choice)
        if task == "store":
            file.write_text("\n".join(lines))
            continue
        before = file.read_text().split("\n")
        if before != lines:
            lines = recorded(server, choice)  # on a busy machine a page may pause while it is built
        if before != lines:
            different += 1
            print("\n".join(difflib.unified_diff(before, lines, name, "now", "", "", 0)), flush=True)
    server.close()
    return different


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], Path(sys.argv[2]), *sys.argv[3:]))
