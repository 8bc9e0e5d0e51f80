"""A user's own file is a controller, a scene, a task or a lesson, depending on what it defines; each error is
one sentence."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from lessons.authoring.lesson import lesson_named
from lessons.authoring.new import text_of
from lessons.own.files import execute, read
from lessons.own.kinds import kind_of
from lessons.own.load import load
from lessons.recording.run import run
from lessons.recording.summary import summary
from lessons.replay.state import decode, encode, state_of
from lessons.runs.named import scene_named
from lessons.scenes.catalog import load_scene, prepared, torque_scene
from lessons.scenes.run_spec import RunSpec
from lessons.session.torque import TorqueSession
from robots import InputError

HOLDS = "def torque(now):\n    return now.bias - 10 * now.M_bar * now.q_dot\n"


@pytest.fixture
def file(tmp_path: Path):
    def write(text: str, name: str = "mine.py") -> str:
        path = tmp_path / name
        path.write_text(text)
        return str(path)

    return write


@pytest.mark.parametrize("kind", ["controller", "scene", "task", "exercise"])
def test_own_file_is_what_it_defines(kind, file) -> None:
    assert kind_of(execute(read(file(text_of(kind, None, "mine.py"))))) == kind


def test_own_controller_sees_what_the_paper_names(file) -> None:
    """The view of a user's own controller has the shapes of the paper, and its numbers agree with an
    independent computation."""
    text = """
        import numpy as np

        def torque(now):
            n, N = now.n, now.N
            assert now.q.shape == now.q_dot.shape == now.q_ddot.shape == now.tau_0.shape == (n,)
            assert now.M.shape == (n, n) and now.bias.shape == now.gravity.shape == (n,)
            one, two = now.levels
            assert (one.name, one.tasks, one.J.shape) == ("position", ("position",), (2, n))
            assert np.allclose(one.x_dot, one.J @ now.q_dot)
            assert np.allclose(one.jacobian(now.q), one.J, atol=1e-14)
            assert one.error.shape == one.J_dot_q_dot.shape == one.K_p.shape == one.Q.shape == (2,)
            assert one.x_dot_d.shape == one.displacement_d.shape == (N + 1, 2)
            assert not one.displacement_d[0].any() and one.R.shape == (n,)
            assert now.level("q1") is two and (now.bounds.tau_upper > 0).all()
            h = 1e-6
            drift = (one.jacobian(now.q + h * now.q_dot) - one.J) @ now.q_dot / h
            assert np.allclose(drift, one.J_dot_q_dot, atol=1e-4)
            for values in (now.q, now.tau_0, one.J):
                assert not values.flags.writeable
            return now.bias
    """
    recording = run(prepared(load_scene("planar3-circle"), file(_dedented(text)), ()), 0.05)
    assert recording.session.failure is None


def test_own_rows_of_torques_tell_the_leak(file) -> None:
    """The leak is computed from one torque per level; a controller that returns a single torque has no
    leak."""
    rows = "def torque(now):\n    return [now.bias, now.bias + 0.1]\n"
    scene = load_scene("planar3-circle")
    assert summary(run(prepared(scene, file(rows), ()), 0.05))["priority_leak_max"] > 0.01
    assert summary(run(prepared(scene, file(HOLDS, "holds.py"), ()), 0.05))["priority_leak_max"] is None


def test_own_controller_runs_twice_the_same(file) -> None:
    scene = prepared(load_scene("iiwa14-hold"), file(HOLDS), ("plant.payload_kg=1",))
    first, second = run(scene, 0.3), run(scene, 0.3)
    assert np.array_equal(first["q"], second["q"])
    assert first.session.settings.controller.endswith("mine.py")


def _dedented(text: str) -> str:
    import textwrap

    return textwrap.dedent(text)


FAULTS = {
    "no file": (None, "cannot be read"),
    "no text": (b"\xff\xfe\x00torque", "UTF-8"),
    "empty": ("", "defines neither"),
    "two things": ("TASK = 1\nSCENE = 2\n", "defines a scene and a task"),
    "syntax": (
        "def torque(now)\n    return 1\n",
        r"mine.py, line 1: expected ':'\n  def torque\(now\)\n {17}\^",
    ),
    "far to the right": (
        "a = " + 40 * "wide + " + "(\n",
        r"mine.py, line 1: .* closed\n  .*wide \+ \(\n {52}\^",
    ),
    "indentation": ("def torque(now):\nreturn 1\n", r"mine.py, line 2"),
    "missing name at import": ("x = nothing\n", r"mine.py, line 1: NameError"),
    "missing module": ("import no_such_module\n", r"mine.py, line 1: ModuleNotFoundError"),
    "raises at import": ("\nraise ValueError('so')\n", r"mine.py, line 2: ValueError: so"),
    "exits at import": ("import sys\nsys.exit(3)\n", r"mine.py, line 2: .*SystemExit"),
    "leaves at import": ("import os\nos._exit(0)\n", "ends the program"),
    "crashes at import": ("import ctypes\nctypes.string_at(0)\n", "SIGSEGV"),
    "forks at import": (
        "import os\nfor _ in range(4):\n    os.fork()\n",
        r"line 3: .*must not start or signal a process \(os.fork\)",
    ),
    "signals at import": (
        "import os, signal\nos.kill(os.getppid(), signal.SIGINT)\n",
        r"line 2: .*must not start or signal a process \(os.kill\)",
    ),
    "interrupts at import": ("import _thread\n_thread.interrupt_main()\nwhile True: pass\n", "loading it"),
    "runs a program at import": (
        "import subprocess\nsubprocess.Popen(['sleep', '60'])\n",
        r"line 2: .*\(subprocess.Popen\)",
    ),
    "replaces parts of NumPy": (
        "import numpy as np\nnp.array = np.linalg.inv = None\n" + HOLDS,
        r"loading it replaces numpy\.\w+.*leave that out",
    ),
    "signals in a tick": (
        "import os\ndef torque(now):\n    os.kill(os.getpid(), 2)\n",
        r"line 3: .*must not start or signal a process \(os.kill\)",
    ),
    "memory at import": ("x = [0] * 10**12\n", "line 1: .*memory"),
    "no function": ("torque = 3\n", "torque must be a function"),
    "no method": ("class Controller:\n    pass\n", "a method torque"),
    "a task instead": ("TASK = 1\n", "is a task, but a controller is needed"),
    "constructor": ("class Controller:\n    def __init__(self, x): ...\n    def torque(self, n): ...\n", "x"),
    "missing name in a tick": (HOLDS.replace("now.bias", "nowbias"), r"mine.py, line 2: NameError"),
    "arguments": ("def torque():\n    return 0\n", "TypeError"),
    "nothing returned": ("def torque(now):\n    pass\n", "mine.py, line 1: it returned nothing"),
    "wrong shape": ("def torque(now):\n    return now.q[:2]\n", r"shape \(2,\)"),
    "no numbers": ("def torque(now):\n    return 'abc'\n", "a str"),
    "not a number": ("def torque(now):\n    return now.q * float('nan')\n", "finite"),
    "writes to what it sees": ("def torque(now):\n    now.q[0] = 1\n    return now.q\n", "read-only"),
    "exits in a tick": ("def torque(now):\n    raise SystemExit\n", "line 2.*SystemExit"),
    "endless in a tick": (
        "def torque(now):\n    while True:\n        pass\n",
        "line [23].*longer than 0.5 s",
    ),
}


@pytest.mark.parametrize("what", FAULTS)
def test_own_controller_that_is_wrong_is_one_sentence(what: str, tmp_path: Path) -> None:
    text, words = FAULTS[what]
    path = tmp_path / "mine.py"
    if text is not None:
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InputError, match=words) as caught:
        run(prepared(load_scene("planar3-hold"), str(path), ()), 0.05)
    said = str(caught.value)
    sentence, *shown = said.split("\n")
    assert str(path) in sentence
    assert not shown or (len(shown) == 2 and shown[1].endswith("^")), "a wrong line, with a caret below"


def test_own_call_may_wait_for_a_core_but_not_sleep(file, monkeypatch) -> None:
    """The deadline of a call counts the time in which the process sleeps, but not the time in which it waits
    for a core."""
    from lessons.own import load

    scene = load_scene("planar3-hold")
    law = file("import time\n\ndef torque(now):\n    time.sleep(0.7)\n    return now.bias\n")
    with pytest.raises(InputError, match=r"line 4: one call takes longer than 0\.5 s"):
        run(prepared(scene, law, ()), 0.01)
    monkeypatch.setattr(load, "waited", lambda pid: time.monotonic())
    assert run(prepared(scene, law, ()), 0.003)["tau"].shape == (3, 3)


def test_own_endless_import_ends_at_the_deadline(file, monkeypatch) -> None:
    from dataclasses import replace

    from lessons.own import load

    monkeypatch.setattr(load, "LOADING", replace(load.LOADING, seconds=3.0))
    with pytest.raises(InputError, match="loading it takes longer than 3 s"):
        run(prepared(load_scene("planar3-hold"), file("while True:\n    pass\n"), ()), 0.05)


ONCE = """
import pathlib
seen = pathlib.Path(__file__).with_suffix(".seen")
if seen.exists():
    {}
seen.touch()
def torque(now):
    return now.bias
"""


@pytest.mark.parametrize("where", ["main", "thread"])
def test_own_second_import_that_never_ends_is_ended(where: str, file, monkeypatch) -> None:
    """The time of the second import of a file is limited as well, also if the first import ended normally."""
    from concurrent.futures import ThreadPoolExecutor

    from lessons.session import controllers

    monkeypatch.setattr(controllers, "load", partial(load, seconds=1.0))
    scene = prepared(load_scene("planar3-hold"), file(ONCE.format("while True: pass")), ())
    began = time.monotonic()
    with pytest.raises(InputError, match=r"mine\.py: loading it takes longer than 1 s"):
        run(scene, 0.05) if where == "main" else ThreadPoolExecutor(1).submit(run, scene, 0.05).result()
    assert time.monotonic() - began < 40.0


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ("import os; os.fork()", "os.fork"),
        ("import os, signal; os.kill(os.getpid(), signal.SIGINT)", "os.kill"),
        ("import signal; signal.raise_signal(signal.SIGINT)", "interrupts"),
        ("import numpy; numpy.array = None", r"replaces numpy\.array"),
    ],
)
def test_own_second_import_does_no_harm(what: str, words: str, file) -> None:
    scene = prepared(load_scene("planar3-hold"), file(ONCE.format(what)), ())
    with pytest.raises(InputError, match=words) as caught:
        run(scene, 0.05)
    assert len(str(caught.value)) < 500
    assert np.array([1.0]).shape == (1,)


def test_own_controller_that_fails_holds_the_robot_until_reset(file) -> None:
    text = """
        class Controller:
            def __init__(self):
                self.ticks = 0

            def torque(self, now):
                self.ticks += 1
                return now.bias + 0.5 if self.ticks < 100 else 1 / 0
    """
    session = TorqueSession(prepared(torque_scene("planar3-hold"), file(_dedented(text)), ()))
    for _ in range(3000):
        session.tick()
    assert session.diverged_at is None
    assert session.failure is not None
    assert "line 8: ZeroDivisionError" in session.failure
    assert np.abs(session.plant.v).max() < 0.01
    session.reset()
    assert session.failure is None
    for _ in range(50):
        session.tick()
    assert session.failure is None


def test_own_code_that_is_saved_takes_over_without_a_bump(file) -> None:
    path = file(HOLDS)
    session = TorqueSession(prepared(torque_scene("planar3-hold"), path, ()))
    before = [session.tick()[session.layout.fields["tau"]].copy() for _ in range(50)]
    file(HOLDS.replace("now.bias", "now.bias + 0.1"))
    session.renew()
    after = [session.tick()[session.layout.fields["tau"]].copy() for _ in range(400)]
    steps = np.abs(np.diff([before[-1], *after], axis=0))
    assert steps.max() < 0.005
    assert np.abs(after[-1] - before[-1]).max() > 0.05
    file("def torque(now):\n    return oops\n")
    session.renew()
    session.tick()
    assert session.failure is not None


def test_own_files_are_run_only_where_the_command_line_says_so(file) -> None:
    """A state code, a setting or an event cannot make the lab run a file of the computer."""
    path = file("import os\nos._exit(1)\n")
    scene = load_scene("planar3-hold")
    with pytest.raises(InputError, match=r"--controller FILE\.py"):
        prepared(scene, None, (f"controller={path}",))
    with pytest.raises(InputError, match="scene"):
        load_scene(path)
    with pytest.raises(InputError):
        decode(encode(state_of(RunSpec("planar3-hold"), scene.settings)) + "x")


def test_own_controller_does_not_fit_a_velocity_scene(file) -> None:
    with pytest.raises(InputError, match="takes velocities"):
        prepared(load_scene("iiwa14-htmpc"), file(HOLDS), ())


def test_own_scene_and_task_run(file) -> None:
    scene = scene_named(file(text_of("scene", None, "mine.py")))
    result = summary(run(scene, 1.5))
    assert result["tasks"][0]["rmse_after_1s"][0] < 1e-3
    assert result["scene"].endswith("mine.py")
    scene = scene_named(file(text_of("task", None, "mine.py"), "task.py"))
    assert [level.name for level in scene.settings.levels][1] == "reach"
    assert not summary(run(scene, 0.1))["diverged"]


def test_own_scene_begins_with_any_there_is(file) -> None:
    scene = scene_named(file(text_of("scene", "iiwa14-htmpc", "mine.py")))
    assert scene.settings.horizon == 10


def test_own_lesson_is_named_after_its_file(file) -> None:
    path = file(text_of("lesson", None, "mine.md"), "mine.md")
    lesson = lesson_named(path)
    assert lesson.name == path
    assert lesson.card.question == "Does a heavier hand sag?"


def test_own_lesson_may_have_a_scene_and_a_robot_beside_it(file) -> None:
    """A lesson is data, and no program is run by reading it; its scene may be a Python file in its folder."""
    file(text_of("scene", None, "scene.py"), "scene.py")
    text = text_of("lesson", None, "mine.md").replace("scene: iiwa14-hold", "scene: scene.py")
    assert lesson_named(file(text.replace("osf", "weighted"), "mine.md")).scene.endswith("scene.py")


def test_own_controller_is_made_afresh_for_every_robot(file) -> None:
    """Two runs of the same file do not share its global variables."""
    path = file("seen = []\ndef torque(now):\n    seen.append(1)\n    return now.bias + len(seen)\n")
    scene = prepared(torque_scene("planar3-hold"), path, ())
    first, second = run(scene, 0.05), run(scene, 0.05)
    assert np.array_equal(first["tau"], second["tau"])
