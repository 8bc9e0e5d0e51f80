"""`himpc-lab new`, and paths where the command line takes names, in a folder outside the checkout."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from app.__main__ import main
from lessons.authoring.new import TASKS
from lessons.exercises import EXERCISES
from lessons.parallel import one_by_one


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_new_file_of_ones_own_runs(capsys: pytest.CaptureFixture[str]) -> None:
    for kind in ("controller", "scene", "task"):
        assert main(["new", kind, f"my_{kind}.py"]) == 0
        assert f"my_{kind}.py" in Path(f"my_{kind}.py").read_text()
    line = "run planar3-circle --controller my_controller.py --duration 0.05 --json a.json"
    assert main(line.split()) == 0
    assert json.loads(Path("a.json").read_text())["controller"] == "my_controller.py"
    assert main(["run", "my_scene.py", "--duration", "0.05", "--json", "b.json"]) == 0
    assert json.loads(Path("b.json").read_text())["scene"] == "my_scene.py"
    assert main(["run", "my_task.py", "--duration", "0.02", "--json", "c.json"]) == 0
    assert json.loads(Path("c.json").read_text())["tasks"][1]["name"] == "reach"
    capsys.readouterr()


@pytest.mark.parametrize("word", TASKS)
def test_a_new_task_may_begin_with_a_kind_of_the_lab(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    """A task file that starts from a built-in kind defines a new kind, and this kind moves the arm like the
    built-in one."""
    assert main(["new", "task", "mine.py", "--from", word]) == 0
    line = ["--duration", "0.02", "--set", "plant.payload_kg=1", "--json", "a.json"]
    errors = {}
    for task in ("mine.py", word):
        stack = [{"task": task, "name": "x", "K_p": 100.0, "K_v": 20.0}, {"task": "posture"}]
        assert main(["run", "iiwa14-hold", "--set", f"stack={json.dumps(stack)}", *line]) == 0
        errors[task] = json.loads(Path("a.json").read_text())["tasks"][0]["max_abs"]
    assert errors["mine.py"] == pytest.approx(errors[word], rel=1e-9, abs=1e-12)
    capsys.readouterr()


@pytest.mark.parametrize("name", EXERCISES)
def test_the_file_of_an_exercise_runs_as_it_is_told_to(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "controller", "mine.py", "--from", name]) == 0
    first, *_, last = (line.strip() for line in capsys.readouterr().out.splitlines()[1:])
    assert last == "himpc-lab grade mine.py"
    assert main([*first.split()[1:], "--duration", "0.02", "--json", "a.json"]) == 0
    capsys.readouterr()


def test_new_lesson_of_ones_own_is_checked(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "lesson", "my_lesson.md"]) == 0
    assert main(["lessons", "--check", "my_lesson.md"]) == 0
    assert "faults: 0" in capsys.readouterr().out


def test_new_writes_over_nothing_of_ones_own(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "controller", "mine.py", "--from", "osf"]) == 0
    before = Path("mine.py").read_text()
    assert main(["new", "scene", "mine.py"]) == 2
    assert Path("mine.py").read_text() == before
    assert main(["new", "controller", "mine.txt"]) == 2
    assert main(["new", "controller", "other.py", "--from", "ofs"]) == 2
    assert "did you mean 'osf'" in capsys.readouterr().err


def test_grade_lists_the_exercises_and_their_own_hints(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["grade"]) == 0
    listed = capsys.readouterr().out
    assert "joint-pd" in listed
    assert "\\" not in listed  # no LaTeX in a terminal
    assert main(["grade", "two-levels", "--hints", "2"]) == 0
    out = capsys.readouterr().out
    assert "hint 2 of 4" in out
    assert "hint 3" not in out
    assert "joint-pd" not in out
    assert main(["grade", "two-level"]) == 2
    assert "did you mean 'two-levels'" in capsys.readouterr().err


def test_grade_has_exit_codes_of_its_own(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "controller", "mine.py", "--from", "joint-pd"]) == 0
    assert main(["grade", "mine.py", "--json", "grade.json"]) == 1
    found = json.loads(Path("grade.json").read_text())
    assert (found["exercise"], found["of"]) == ("joint-pd", 10)
    assert set(found["protection"]) <= {"Landlock", "seccomp"}
    assert 0 <= found["points"] < 10
    Path("mine.py").write_text("import os\nos._exit(0)\n")
    assert main(["grade", "mine.py", "joint-pd"]) == 2
    assert "it ends its own process" in capsys.readouterr().out
    assert main(["grade", "mine.py", "joint-dp"]) == 2
    assert main(["grade", "nothing.py"]) == 2


def test_grade_executes_only_the_second_file_with_the_rights_of_the_teacher(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A solution is executed by the grader's sandbox alone, in whatever order the files are given, and a file
    that it left behind is not taken for a result."""
    assert main(["new", "exercise", "softer.py"]) == 0
    leaves = "open('ran_here', 'w').write('x')\ndef torque(now):\n    return now.gravity\n"
    for name in ("str", "own_exercise"):
        Path("mine.py").write_text(f"EXERCISE = {name}('softer')\n{leaves}")
        Path("result.json").write_text("{}")
        assert main(["grade", "mine.py", "softer.py", "--format", "github", "--json", "result.json"]) == 2
        assert json.loads(Path("result.json").read_text())["status"] == "error"
        assert main(["grade", "mine.py", "softer.py"]) == 2
    Path("mine.py").write_text(f"EXERCISE = own_exercise('softer')\n{leaves}")
    for further in ([], ["--format", "github", "--json", "result.json"]):
        assert main(["grade", "softer.py", "mine.py", *further]) == 2
    assert "stands after the solutions" in capsys.readouterr().err
    Path("mine.py").write_text(f"EXERCISE = str('softer')\n{leaves}")
    for line in (["softer.py", "mine.py"], ["--check", "mine.py"], ["--autograder", "mine.py"]):
        assert main(["grade", *line]) == 2
    assert not Path("ran_here").exists()


def test_only_regular_files_are_read(capsys: pytest.CaptureFixture[str]) -> None:
    """Reading a named pipe would wait for ever."""
    for name in ("fifo.py", "fifo.txt"):
        os.mkfifo(name)
    for line in (
        "grade fifo.py",
        "grade fifo.txt",
        "grade fifo.py joint-pd --format github",
        "run planar3-hold --controller fifo.py",
        "run fifo.py",
        "run planar3-hold --task fifo.py",
        "new controller x.py --from fifo.py",
    ):
        assert main(line.split()) == 2, line
    assert "fifo.py: cannot be read (not a regular file)" in capsys.readouterr().err


def test_sweep_takes_files_of_ones_own(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lessons.parallel.on_cores", one_by_one)
    main(["new", "controller", "mine.py"])
    line = "sweep planar3-circle --controller mine.py --over M_bar_scale=1:2:2 --duration 0.05 --out s"
    assert main(line.split()) == 0
    assert "0 could not be run" in capsys.readouterr().out
