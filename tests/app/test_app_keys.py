"""Keys: each command has a key of its own, no such key moves the camera, and the help names all keys."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import viser
from served import served

from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from app.panels.widgets.command import CAMERA_KEYS
from browsing.wire import Wire, eventually
from lessons.scenes.run_spec import RunSpec


def test_the_cameras_keys_are_those_of_viser() -> None:
    source = Path(viser.__file__).parent / "client" / "src" / "CameraControls.tsx"
    listed = re.search(r"CAMERA_MOVEMENT_KEYS = new Set\(\[(.*?)\]\)", source.read_text(), re.DOTALL)
    assert listed is not None
    assert {name.removeprefix("Key") for name in re.findall(r'"(\w+)"', listed[1])} == CAMERA_KEYS


@pytest.mark.parametrize(
    "choice",
    [
        SceneChoice(RunSpec("planar3-hold")),
        SceneChoice(RunSpec("ridgeback-ur10-drag")),
        SceneChoice.of_lesson(LessonPlace("deadlines")),
    ],
    ids=["torque", "velocity", "lesson"],
)
def test_every_command_has_a_key_of_its_own(choice: SceneChoice) -> None:
    with served(choice) as server, Wire(server.link) as page:
        assert eventually(lambda: page.shows("every command, searchable") and len(page.commands) >= 10)
        commands = [each for each in page.commands.values() if each["hotkey"] is not None]
        keys = [(each["hotkey"], each["modifier"]) for each in commands]
        assert len(set(keys)) == len(keys), sorted(keys)
        assert {key for key, _ in keys} & CAMERA_KEYS == set()
        shown = " ".join(str(each["props"].get("content")) for each in page.controls.values())
        table = shown[shown.index("run or pause") - 200 : shown.index("every command, searchable")]
        for key, _ in keys:
            names = {"space": "Space"} if not str(key).isdigit() else {str(key): "1 … 9"}
            assert re.search(rf"<b>[^<]*{re.escape(names.get(str(key), str(key)))}[^<]*</b>", table), key
