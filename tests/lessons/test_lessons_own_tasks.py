"""A task in a user's own file is part of the stack: it is named by its file or class, exported, and refused
if wrong."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from lessons.authoring.new import text_of
from lessons.recording.run import run
from lessons.recording.summary import summary
from lessons.replay.script import script
from lessons.replay.state import decode, encode, state_of
from lessons.scenes.run_spec import RunSpec
from lessons.settings.assignments import differences
from lessons.settings.torque import TorqueSettings
from robots import InputError


@pytest.fixture
def file(tmp_path: Path) -> str:
    path = tmp_path / "mine.py"
    path.write_text(text_of("task", None, "mine.py"))
    return str(path)


def stack(word: str) -> str:
    own = {"task": word, "name": "far", "frame": "link_4", "K_p": 50}
    return "stack=" + json.dumps([{"task": "position"}, own, {"task": "posture"}])


def settings_of(spec: RunSpec) -> TorqueSettings:
    found = spec.prepared().settings
    assert isinstance(found, TorqueSettings)
    return found


@pytest.mark.parametrize("by", ["path", "class"])
def test_an_own_task_is_named_in_a_stack(by: str, file: str) -> None:
    spec = RunSpec("iiwa14-hold", set=(stack(file if by == "path" else "Reach"),), tasks=(file,))
    settings = settings_of(spec)
    assert [level.name for level in settings.levels] == ["position", "far", "posture"]
    far = settings.levels[1].tasks[0]
    assert (vars(far)["frame"], far.K_p, far.K_v) == ("link_4", 50.0, 20.0)
    added = settings.changed("stack.add", {"task": "Reach", "with": "posture"})
    assert added.levels[2].name == "posture+reach"
    assert differences(spec.loaded().settings, added) == (
        "stack=" + json.dumps(added.value_at("stack"), separators=(",", ":"), ensure_ascii=False),
    )


def test_an_own_task_in_a_stack_runs_in_every_kind_of_run(file: str) -> None:
    spec = RunSpec("iiwa14-hold", duration=0.1).admitting(stack(file), "horizon=4")
    assert spec == RunSpec("iiwa14-hold", set=(stack(file), "horizon=4"), duration=0.1, tasks=(file,))
    found = summary(run(spec.prepared()))
    assert [task["name"] for task in found["tasks"]] == ["position", "far", "posture"]
    assert found["tasks"][1]["max_abs"][0] < 1e-3
    assert f"--task {file}" in spec.command_line()
    assert not summary(run(spec.but("controller=hqp").prepared()))["diverged"]


def test_a_code_tells_an_own_task_by_its_content(file: str) -> None:
    spec = RunSpec("iiwa14-hold", set=(stack(file),), tasks=(file,))
    code = encode(state_of(spec, settings_of(spec)))
    opened = decode(code).run
    assert file not in str(opened)
    assert settings_of(replace(opened, tasks=(file,))) == settings_of(spec)
    with pytest.raises(
        InputError, match=r"this was made with a user's file of a task, mine\.py@.*add --task mine\.py"
    ):
        opened.prepared()
    Path(file).write_text(Path(file).read_text() + "# changed\n")
    with pytest.raises(InputError, match="its fingerprint is"):
        replace(opened, tasks=(file,)).prepared()


def test_a_script_repeats_a_run_with_an_own_task(file: str, tmp_path: Path) -> None:
    spec = RunSpec("iiwa14-hold", set=(stack(file),), tasks=(file,))
    place = tmp_path / "again.py"
    place.write_text(script(spec, (), 0.05))
    done = subprocess.run([sys.executable, str(place)], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["tasks"] == summary(run(replace(spec, duration=0.05).prepared()))["tasks"]


def test_an_own_task_is_run_only_if_it_was_named_at_the_start(tmp_path: Path) -> None:
    """A state code, an event or a page cannot make the lab run a file of the computer."""
    path = tmp_path / "evil.py"
    path.write_text("import os\nos._exit(1)\n")
    with pytest.raises(InputError, match=r"start himpc-lab with --task FILE\.py"):
        RunSpec("iiwa14-hold", set=(stack(str(path)),)).prepared()
    with pytest.raises(InputError, match=r"evil\.py: loading it ends the program"):
        RunSpec("iiwa14-hold", tasks=(str(path),)).loaded()


def test_an_unknown_field_of_an_own_task_is_a_sentence(file: str) -> None:
    wrong = stack(file).replace("frame", "frames")
    with pytest.raises(InputError, match=r"no setting of the task of .*frames.*frame"):
        RunSpec("iiwa14-hold", set=(wrong,), tasks=(file,)).prepared()


def test_the_files_of_a_run_are_attached_once(file: str, monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[str] = []
    monkeypatch.setattr("lessons.runs.named.check_task", lambda *args: tried.append(args[-1]))
    RunSpec("iiwa14-hold", set=(stack(file),), tasks=(file,)).prepared()
    assert tried == [file]
