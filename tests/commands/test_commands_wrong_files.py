"""Files with wrong scenes, tasks and lessons, more than twenty cases each: one sentence that names the file,
exit code 2."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.__main__ import main
from lessons.authoring.new import text_of
from lessons.own import load

SCENE, TASK, LESSON = (text_of(kind, None, "mine.py") for kind in ("scene", "task", "lesson"))

FILE = {
    "empty": ("", "defines neither"),
    "two things": ("TASK = 1\nSCENE = 3\n", "put each into a file of its own"),
    "another kind": ("def torque(now):\n    return now.q\n", "is a controller, but a"),
    "syntax": ("SCENE = (\n", "mine.py, line 1: "),
    "indentation": ("def scene():\nreturn 1\n", "mine.py, line 2: "),
    "missing name": ("SCENE = TASK = nothing\n", "mine.py, line 1: NameError"),
    "missing module": ("import no_such_module\n", "mine.py, line 1: ModuleNotFoundError"),
    "missing part": ("from lessons.events import Kick\n", "mine.py, line 1: ImportError"),
    "raises": ("\nraise ValueError('so')\n", "mine.py, line 2: ValueError: so"),
    "exits": ("import sys\nsys.exit(0)\n", "mine.py, line 2: it ends the program"),
    "memory": ("held = [0] * 10**13\n", "mine.py, line 1: it needs more memory"),
    "recursion": ("def f():\n    f()\nf()\n", "RecursionError"),
    "no text": (b"\xff\xfe\x00SCENE", "UTF-8"),
}


def changed(text, good, bad):
    assert good in text, good
    return text.replace(good, bad)


SCENES = {
    "a number": ("SCENE = 3\n", "its scene is a int"),
    "nothing returned": ("def scene():\n    pass\n", "its scene is a NoneType"),
    "raises when asked": ("def scene():\n    return 1 / 0\n", "line 2: ZeroDivisionError"),
    "unknown scene": (changed(SCENE, "planar3-hold", "planar4-hold"), "planar4-hold"),
    "unknown setting": (changed(SCENE, '"horizon"', '"horizn"'), "horizn"),
    "value out of range": (changed(SCENE, '"horizon", 10', '"horizon", -1'), "horizon"),
    "shape of q_0": (changed(SCENE, "[0.0, 90.0, -90.0]", "[0.0, 90.0]"), "q must be 3 finite numbers"),
    "unknown body": (changed(SCENE, '"link_3"', '"link_9"'), "link_9"),
    "an event that is none": (
        changed(SCENE, 'Push("link_3", force=(0.0, 5.0, 0.0), seconds=0.1)', '"push"'),
        "event",
    ),
    "duration": (changed(SCENE, "duration=4.0", "duration=-1.0"), "duration"),
    "duration that is no number": (changed(SCENE, "duration=4.0", 'duration="long"'), "duration"),
    "a task that is not there": (changed(SCENE, '{"position"', '{"elbow"'), "elbow"),
    "shape of a reference": (
        changed(
            SCENE, "centre, radius = np.array([0.55, 0.3])", "centre, radius = np.array([0.55, 0.3, 0.0])"
        ),
        "mine.py: ValueError",
    ),
    "references that raise": (changed(SCENE, "    centre,", "    nothing\n    centre,"), "NameError"),
    "no references": (
        changed(SCENE, 'return {"position"', 'dict({"position"').replace('"eased"))}', '"eased"))})'),
        "references",
    ),
    "unknown field": (changed(SCENE, "duration=4.0", "lasting=4.0"), "lasting"),
}
TASKS = {
    "a number": ("TASK = 3\n", "TASK is a int"),
    "Jacobian of another value": (changed(TASK, "max(np.hypot(p[0], p[1]), 1e-6)", "2.0"), "is off by"),
    "sign of the Jacobian": (changed(TASK, "(direction @ J)", "(-direction @ J)"), "is off by"),
    "shape of the Jacobian": (changed(TASK, "[:, None, :]", ""), "has shape"),
    "Jacobian of nothing": (changed(TASK, "return (direction @ J)[:, None, :]", "pass"), "has shape"),
    "Jacobian without end": (
        changed(TASK, "(direction @ J)[:, None, :]", "np.nan * (direction @ J)[:, None, :]"),
        "is off by",
    ),
    "shape of the error": (changed(TASK, "return value - desired", "return np.zeros(3)"), "error"),
    "value that raises": (
        changed(TASK, "return np.array([np.hypot", "return nothing([np.hypot"),
        "NameError",
    ),
    "value of words": (changed(TASK, "return np.array([np.hypot(p[0], p[1])])", 'return "far"'), "mine.py"),
    "no coordinates": (changed(TASK, "def coordinates", "def coords"), "coordinates"),
    "coordinates too many": (changed(TASK, '("reach",)', '("a", "b")'), "shape"),
    "unknown frame": (changed(TASK, 'Reach(name="reach"', 'Reach(name="reach", frame="nose"'), "nose"),
    "negative stiffness": (changed(TASK, "K_p=100.0", "K_p=-1.0"), "K_p"),
    "no name": (changed(TASK, 'name="reach", ', ""), "name"),
    "unknown field": (changed(TASK, "K_p=100.0", "stiffness=100.0"), "stiffness"),
}
LESSONS = {
    "empty": ("", "mine.md, line 1, column 1: a lesson begins with '# Title'"),
    "no text": (b"\xff\xfe\x00# A", "UTF-8"),
    "Python": (SCENE, "mine.md, line 1, column 1: a lesson begins"),
    "no question": (changed(LESSON, "sag?", "sag."), "mine.md, line 1, column 1: below the title"),
    "no minutes": (changed(LESSON, "- minutes: 5\n", ""), "mine.md, line 1, column 1: a line '- minutes"),
    "unknown scene": (changed(LESSON, "scene: iiwa14-hold", "scene: iiwa15-hold"), "iiwa15-hold"),
    "unknown setting": (
        changed(LESSON, "set: plant.payload_kg=2", "set: plant.payload=2"),
        "line 14, column 3:",
    ),
    "a setting out of range": (
        changed(LESSON, "set: plant.payload_kg=2", "set: plant.payload_kg=-2"),
        "mine.md, line 14, column 3: plant.payload_kg",
    ),
    "no setting": (changed(LESSON, "set: plant.payload_kg=2", "set: heavy"), "line 14, column 3:"),
    "unknown unit": (changed(LESSON, "plot: error/position (mm)", "plot: error/position (miles)"), "line 17"),
    "no steps": (LESSON.split("## ")[0], "a lesson has at least one step"),
    "no claims": (changed(LESSON, "- claim: The", "The"), "has no claims"),
    "unknown relation": (
        changed(LESSON, "at most", "about"),
        "line 25, column 5: 'error/position (mm) about",
    ),
    "duration": (changed(LESSON, "run: 1 s", "run: -1 s"), "duration"),
    "unknown key": (
        changed(LESSON, "- plot:", "- plots:"),
        "line 17, column 3: There is no key of a step 'plots'",
    ),
    "unknown event": (
        changed(LESSON, "run: 1 s\n", "run: 1 s\n  - at 0.1 s: kick hand\n"),
        "line 16, column 5",
    ),
    "an event that is code": (
        changed(LESSON, "run: 1 s\n", "run: 1 s\n  - at 0.1 s: push link_4, force __import__('os')\n"),
        "line 16, column 5: '__import__('os')' does not have the form '(1, 2, 3)'",
    ),
    "a field without a value": (
        changed(LESSON, "run: 1 s\n", "run: 1 s\n  - at 0.1 s: move target position\n"),
        "'move target' needs task, value",
    ),
    "two runs": (changed(LESSON, "- run: 1 s\n", "- run: 1 s\n- run: 2 s\n"), "line 16, column 3"),
    "no tempting answer": (changed(LESSON, "tempting (from", "option (from"), "line 19, column 3"),
    "a range that is none": (changed(LESSON, "(below 1)", "(under 1)"), "'(under 1)' does not have the form"),
    "a control without an end": (changed(LESSON, "from 0 to 5", "from 0"), "line 16, column 3"),
    "another heading": (changed(LESSON, "### Why", "### Because"), "line 33, column 1"),
    "a mark without a note": (
        changed(LESSON, "the hand.", "the hand[^2]."),
        "line 31, column 58: a line '[^2]: …' is missing in this step",
    ),
    "a note without a mark": (
        changed(LESSON, "millimetre[^1].", "millimetre."),
        "line 37, column 1: no text of this step has the mark '[^1]'",
    ),
    "two notes of one name": (
        LESSON + "[^1]: given: a setting\n",
        "line 38, column 1: the note '[^1]' stands twice",
    ),
    "a note that is code": (
        changed(LESSON, "[^1]: error/position (mm) from", "[^1]: __import__('os') from"),
        "line 37, column 1: '__import__('os') from 0",
    ),
    "a note with a wrong setting": (changed(LESSON, "`controller=osf`", "`controller`"), "line 37, column 1"),
    "a note without an effect": (
        changed(LESSON, "from 10 to 200", "from 0.1 to 200"),
        "line 37, column 1: after 'but with' stands a range that does not overlap",
    ),
    "a note of another's ghost": (
        changed(LESSON, "(mm) from 0 to 0.1;", "(mm) over ghost from 0 to 0.1;"),
        "line 37, column 1: there is no ghost in this step",
    ),
    "a range that ends before it begins": (
        changed(LESSON, "from 0 to 0.1;", "from 1 to 0.1;"),
        "line 37, column 1",
    ),
    "no wrong setting": (
        changed(LESSON, "  - fails with: controller=osf\n", ""),
        "line 24, column 3: a line '- fails with: …' is missing",
    ),
}
WRONG = {"scene": FILE | SCENES, "task": FILE | TASKS, "lesson": LESSONS}
LINES = {
    "scene": ["run", "mine.py", "--duration", "0.02"],
    "task": ["run", "mine.py", "--duration", "0.02"],
    "lesson": ["lessons", "--check", "mine.md"],
}


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(("kind", "what"), [(kind, what) for kind in WRONG for what in WRONG[kind]])
def test_a_wrong_file_is_a_sentence(
    kind: str, what: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text, words = WRONG[kind][what]
    name = "mine.md" if kind == "lesson" else "mine.py"
    Path(name).write_bytes(text if isinstance(text, bytes) else text.encode())
    # None of these files harms the process that loads it; the tests below have files that do.
    monkeypatch.setattr(load, "isolated", lambda function, source, **_: function(source))
    assert main(LINES[kind]) == 2
    said, *shown = capsys.readouterr().err.strip().split("\n")
    assert words in said
    assert name in said
    assert not shown or (len(shown) == 2 and shown[1].endswith("^")), "a wrong line, with a caret below"


@pytest.mark.parametrize("kind", ["scene", "task"])
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("import os\nos._exit(0)\n", "ends the program"),
        ("import time\nwhile True: time.sleep(1.0)\n", "takes longer than 4 s"),
    ],
    ids=["leaves", "never ends"],
)
def test_a_file_that_would_take_the_program_along_is_a_sentence(
    kind: str, text: str, words: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from dataclasses import replace

    monkeypatch.setattr(load, "LOADING", replace(load.LOADING, seconds=4.0))
    Path("mine.py").write_text(text + f"# {kind}\n")
    assert main(LINES[kind]) == 2
    assert f"mine.py: loading it {words}" in capsys.readouterr().err
