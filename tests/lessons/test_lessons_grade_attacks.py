"""Attacks by graded submissions are refused, with and without the protection of the operating system."""

from __future__ import annotations

import dataclasses
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from right_laws import PD

from himpc.controllers.answers import OwnFault
from himpc.controllers.own import OwnController
from himpc.controllers.view import Bounds, Further, LevelView, NearView, View
from lessons.exercises.apart import Apart, Exhausted, Refused
from lessons.exercises.cells import cell, of_cell
from lessons.exercises.folder import grade_folder
from lessons.exercises.grade import Submission, grade_apart
from lessons.exercises.inside import now as told
from lessons.exercises.inside.now import rebuilt, shape_of
from lessons.own.files import Source
from lessons.parallel import one_by_one
from lessons.scenes.catalog import torque_scene
from lessons.session.torque import TorqueSession
from lessons.settings.torque import TorqueSettings
from robots import InputError, Robot

linux = pytest.mark.skipif(sys.platform != "linux", reason="Landlock and seccomp are Linux's")


@pytest.fixture(scope="module")
def now() -> View:
    """Returns the view that a controller receives at the first tick of a scene."""
    seen: list[View] = []
    scene = torque_scene("planar3-hold")

    def make(settings: TorqueSettings, robot: Robot) -> OwnController:
        def call(_: object, view: View) -> object:
            seen.append(view)
            return view.tau_0

        return OwnController(robot, settings.for_controller(), lambda: lambda view: view.tau_0, call, "here")

    TorqueSession(scene, controllers=make).tick()
    return seen[0]


def apart(text: str, kernel: bool = True, seconds: float = 30.0, memory: int = 2_000_000_000) -> Apart:
    return Apart(
        Source("mine.py", f"{PD.replace('def torque', 'def right')}\n{text}\n"), seconds, memory, kernel
    )


def once(line: str) -> str:
    return f"def torque(now):\n    {line}\n    return right(now)"


def said(text: str, now: View, kernel: bool = True, **limits) -> str:
    """Returns the error message of a submission when it is loaded or at its first tick, or "" if there is no
    error."""
    try:
        with apart(text, kernel, **limits) as one:
            one.fresh()(now)
    except (InputError, OwnFault, Exhausted, Refused) as fault:
        return str(fault)
    return ""


def test_a_grade_is_made_of_the_same_numbers_on_both_sides(now: View) -> None:
    names = {each.name for each in dataclasses.fields(View)} | {"M", "bias", "gravity"}
    assert names == {
        *told.OF_TICK,
        *("T_s", "N", "levels", "bounds", "near", "further", "nominal"),
    }
    assert {each.name for each in dataclasses.fields(Bounds)} == {
        *told.OF_BOUNDS,
        *("approach", "paper"),
    }
    assert {each.name for each in dataclasses.fields(Further)} == {*told.OF_FURTHER}
    assert {each.name for each in dataclasses.fields(NearView)} == {
        *told.OF_NEAR,
        *("names", "reaction", "deceleration"),
    }
    assert {each.name for each in dataclasses.fields(LevelView)} == {
        *told.OF_LEVEL,
        *("name", "tasks", "x", "horizon", "jacobian"),
    }
    data = b"".join(each.tobytes() for each in told.numbers_of(now))
    again = rebuilt(shape_of(now), data, lambda *_: now.M)
    for ours, theirs in zip(told.numbers_of(now), told.numbers_of(again), strict=True):
        assert (ours == theirs).all()
        assert not theirs.flags.writeable


def test_a_grade_needs_what_a_solution_may_use(now: View) -> None:
    """A graded submission may use packages, the QP solver of the lab, and the model at other
    configurations."""
    text = """
import dataclasses, pinocchio, scipy.linalg, scipy.optimize
from himpc.qp import solve_qp
def torque(now):
    level = now.level("posture")
    assert abs(level.jacobian(now.q) - level.J).max() < 1e-12
    assert abs(now.nominal.mass_matrix(now.q) - now.M).max() < 1e-12
    assert abs(now.nominal.bias(now.q, now.q_dot) - now.bias).max() < 1e-12
    return right(now)
"""
    assert said(text, now) == ""


CHEATS = {
    "patches the grader": "import lessons.exercises.grade as g\ng.judged_by = lambda *_: ()\n" + once("pass"),
    "asks the lab's controller": "from himpc.controllers import make_controller\n" + once("pass"),
    "climbs to the plan": once(
        "import sys; f = sys._getframe(); names = []\n"
        "    while f: names += [str(type(v)) for v in f.f_locals.values()]; f = f.f_back\n"
        "    assert not [n for n in names if 'himpc' in n or 'session' in n or 'Plan' in n], names"
    ),
    "looks among all objects": once(
        "import gc, sys\n"
        "    found = {str(type(o).__module__) for o in gc.get_objects()} | set(sys.modules)\n"
        "    assert not [n for n in found if n.split('.')[0] in ('app', 'mujoco')\n"
        "                or n.startswith(('lessons.session', 'lessons.exercises.grade', 'himpc.controllers',"
        " 'robots.plant'))]"
    ),
}


@pytest.mark.parametrize("cheat", CHEATS)
def test_a_grade_cannot_be_taken_from_the_grader(cheat: str, now: View) -> None:
    """The process of a submission contains no data of the grader."""
    refused = not CHEATS[cheat].startswith("def")
    assert ("cannot be imported during grading" in said(CHEATS[cheat], now)) == refused
    assert refused or said(CHEATS[cheat], now) == ""


ATTACKS = {
    "a thread runs a program": "import os, threading\n"
    "threading.Thread(target=os.system, args=('touch {0}/hi',)).start()\n" + once("pass"),
    "a thread reads a file": "import threading\nt = threading.Thread(target=open, args=('/etc/passwd',))\n"
    "t.start(); t.join()\n" + once("pass"),
    "kills its parent": once("import os; os.kill(os.getppid(), 9)"),
    "forks": once("import os; os.fork()"),
    "writes a file": once("open('{0}/hi', 'w').write('x')"),
    "reads what others hand in": once("open('{0}/theirs.txt').read()"),
    "network": once("import socket; socket.socket()"),
}


@pytest.mark.parametrize("kernel", [True, False])
@pytest.mark.parametrize("attack", ATTACKS)
def test_a_grade_is_not_for_those_who_attack(attack: str, kernel: bool, now: View, tmp_path: Path) -> None:
    """An attack is refused in every thread, and the message names the attack."""
    (tmp_path / "theirs.txt").write_text("def torque")
    answer = said(ATTACKS[attack].format(tmp_path), now, kernel)
    assert "a submission may not do that" in answer
    assert not (tmp_path / "hi").exists()


HIDES = """
import os, sys
done = []
def torque(now):
    if not done:
        done.append(True)
        try:
            {0}
        except OSError:
            pass
        frame = sys._getframe()
        while frame:
            for held in list(frame.f_locals.values()):
                if isinstance(held, list) and any(isinstance(each, str) for each in held):
                    held.clear()
            frame = frame.f_back
    return right(now)
"""


@linux
@pytest.mark.parametrize("kernel", [True, False])
@pytest.mark.parametrize(
    "call",
    [
        "open('/etc/passwd')",
        "os.utime('/etc/passwd')",
        "os.sched_setaffinity(os.getppid(), {min(os.sched_getaffinity(0))})",
        "os.sched_setscheduler(os.getppid(), os.SCHED_BATCH, os.sched_param(0))",
    ],
)
def test_a_grade_is_0_for_those_who_hide_a_refused_call(call: str, kernel: bool) -> None:
    """The right law follows, and gets no points."""
    if "sched" in call and not kernel:
        pytest.skip("Python has no event for this call; see the next test")
    text = PD.replace("def torque", "def right") + HIDES.format(call)
    found = grade_apart(Submission(Source("mine.py", text), "joint-pd", kernel=kernel))
    assert found.points == 0
    assert found.lines
    assert all("a submission may not do that" in line.why for line in found.lines)


@linux
def test_a_grade_is_0_for_those_who_slow_the_grader(now: View) -> None:
    """The grader notices a change of its own scheduling, and undoes it."""
    before = os.sched_getaffinity(0), os.sched_getscheduler(0), os.sched_getparam(0).sched_priority
    call = f"os.sched_setscheduler({os.getpid()}, os.SCHED_BATCH, os.sched_param(0))"
    one = apart(once(f"import os; {call}"), kernel=False)
    one.fresh()(now)
    assert os.sched_getscheduler(0) == os.SCHED_BATCH
    with pytest.raises(Refused, match="changing the scheduling of the grader"):
        one.close()
    assert (os.sched_getaffinity(0), os.sched_getscheduler(0), os.sched_getparam(0).sched_priority) == before


def test_a_grade_is_for_runs_without_memory_of_other_runs(now: View) -> None:
    """What a submission changes in its process is gone in the next run of the robot."""
    counts = "import builtins\nbuiltins.runs = getattr(builtins, 'runs', 0) + 1\n"
    with apart(counts + "def torque(now):\n    return now.q * 0 + builtins.runs") as one:
        assert [float(one.fresh()(now)[0]) for _ in range(3)] == [1.0, 1.0, 1.0]


WALK = """
import contextlib, ctypes, os, signal
import pyseccomp
from lessons.exercises.inside.confine import ALLOWED, UNANSWERED, _calls

restrict, call = _calls(), ctypes.CDLL(None, use_errno=True).syscall
quiet = {name: error for error, names in UNANSWERED.items() for name in names}
names = {}
for number in range(1024):
    with contextlib.suppress(ValueError):
        names[number] = pyseccomp.resolve_syscall(pyseccomp.Arch.NATIVE, number).decode()
assert len(names) > 300
for number, name in names.items():
    if name in ALLOWED:
        continue
    child = os.fork()
    if child == 0:
        signal.alarm(10)
        if restrict():
            least = ctypes.c_long(-1)
            call(ctypes.c_long(number), *(least,) * 6)
            os._exit(min(ctypes.get_errno(), 250))
        os._exit(251)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code != quiet.get(name, -signal.SIGSYS):
        print(name, code)
"""
"""Makes every system call that libseccomp knows, in a restricted process of its own, with the arguments −1,
and prints the calls that are neither on a list of `confine` nor end the process."""


@linux
def test_every_system_call_is_on_the_list_or_refused() -> None:
    with apart(once("pass")) as one:
        if "seccomp" not in one.protection:
            pytest.skip("this system has no libseccomp")
    done = subprocess.run([sys.executable, "-c", WALK], capture_output=True, text=True, timeout=300)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr


@linux
@pytest.mark.parametrize(
    ("call", "allowed"),
    [
        ("os.open('/dev/null', os.O_RDONLY)", True),
        ("os.open('/dev/null', os.O_WRONLY)", False),
        ("os.open('/dev/null', os.O_RDONLY | os.O_CREAT)", False),
        ("os.open('/dev/null', os.O_RDONLY | os.O_PATH)", False),
        ("os.fork()", False),
        ("os.kill(os.getpid(), 0)", False),
        ("fcntl.fcntl(0, fcntl.F_GETFD)", True),
        ("fcntl.fcntl(0, fcntl.F_SETOWN, os.getpid())", False),
        ("resource.getrlimit(resource.RLIMIT_CPU)", True),
        ("resource.setrlimit(resource.RLIMIT_CPU, (1, 1))", False),
        ("resource.prlimit(os.getppid(), resource.RLIMIT_CPU)", False),
        ("threading.Thread(target=int).start()", True),
    ],
)
def test_some_system_calls_are_allowed_with_some_arguments_only(call: str, allowed: bool) -> None:
    """The calls are made without Python's hook."""
    text = (
        "import fcntl, os, resource, threading\n"
        "from lessons.exercises.inside.confine import _calls\n"
        f"if _calls()():\n    {call}\n    os._exit(0)\nprint('no seccomp')\n"
    )
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, timeout=60)
    if "no seccomp" in done.stdout:
        pytest.skip("this system has no libseccomp")
    assert done.returncode == (0 if allowed else -signal.SIGSYS), done.stderr


SPAWN = """
import _posixsubprocess, os
def spawn():
    r, w = os.pipe()
    line, name = [b'/bin/sh', b'-c', b'{0}'], [b'/bin/sh']
    files = (-1, -1, -1, -1, -1, -1, r, w)
    return _posixsubprocess.fork_exec(
        line, name, True, (w,), None, None, *files, True, False, -1, None, None, None, -1, None, False)
"""
"""A call for which Python raises no audit event; only the operating system can refuse it."""


@linux
def test_a_grade_is_not_for_those_who_go_below_python(now: View) -> None:
    with apart(once("pass")) as one:
        if one.protection != ("Landlock", "seccomp"):
            pytest.skip("this system has not both")
    text = SPAWN.format("sleep 100") + once("spawn()")
    assert "a submission may not do that" in said(text, now)


@linux
@pytest.mark.parametrize("how", ["sleep 100", "setsid sleep 100"])
def test_a_grade_leaves_no_process_behind_without_the_systems_help(how: str, now: View) -> None:
    """Child processes are ended together with the submission, also those that moved to another session."""
    text = SPAWN.format(how) + once("spawn()")
    one = apart(text, kernel=False)
    try:
        one.fresh()(now)
        end = time.monotonic() + 20.0
        mark = psutil.Process(one.pid).environ()["HIMPC_LAB_SUBMISSION"]
        while len(marked_with(mark)) < 2:
            assert time.monotonic() < end
            time.sleep(0.05)
    finally:
        one.close()
    assert marked_with(mark) == []


def marked_with(mark: str) -> list[int]:
    found = []
    for each in psutil.process_iter():
        try:
            if each.environ().get("HIMPC_LAB_SUBMISSION") == mark and each.status() != psutil.STATUS_ZOMBIE:
                found.append(each.pid)
        except psutil.Error:
            continue
    return found


@linux
def test_a_grade_counts_the_memory_of_all_its_processes(now: View) -> None:
    eats = f"{sys.executable} -c \"x = b'x' * 5 * 10**8; import time; time.sleep(100)\"".replace("'", "\\'")
    text = SPAWN.format(eats) + "spawn()\nspawn()\n" + once("import time; time.sleep(0.2)")
    with apart(text, kernel=False, memory=800_000_000) as one:
        law = one.fresh()
        with pytest.raises(OwnFault, match=r"needs more memory than 0\.8 GB"):
            for _ in range(60):
                law(now)
        assert one.pid is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("while True: pass", "one call takes longer than 0.5 s"),
        ("import time; time.sleep(100)", "one call takes longer than 0.5 s"),
        ("import os; os.closerange(3, 50)", "leave that out"),
        ("import os; os._exit(0)", "ends its own process (exit code 0)"),
        ("return 'abc'", "it returned a str instead of numbers"),
        ("return None", "it returned nothing"),
        ("now.q[0] = 1", "read-only"),
        ("now.q = 1", "read-only"),
        ("held = [bytes(10**9) for _ in range(9)]", "memory"),
        ("now.levels[0].jacobian('x')", "line"),
        ("import os; [os.write(f, b'U' + b'\\xff' * 8) for f in range(3, 9) if os.fstat(f)]", "mine.py"),
    ],
)
def test_a_grade_process_that_answers_badly_is_one_sentence(text: str, words: str, now: View) -> None:
    answer = said(once(text), now)
    assert words in answer
    assert "\n" not in answer
    assert len(answer) < 1200


@linux
def test_a_grade_process_ends_with_the_lab(now: View) -> None:
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        one = apart(once("pass"))
        os.write(write, str(one.pid).encode())
        time.sleep(100.0)
        os._exit(0)
    pid = int(os.read(read, 20))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    end = time.monotonic() + 20.0
    while psutil.pid_exists(pid) and psutil.Process(pid).status() != psutil.STATUS_ZOMBIE:
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.mark.parametrize("separator", [",", ";", "\t", "|"])
@pytest.mark.parametrize("text", ["a;=1+1;b", "＝1+1", "a;\t@x", "a|=1", "'=1", "a;'=1", "a\tb; -1", "a=b"])
def test_a_cell_is_text_wherever_a_spreadsheet_splits_it(text: str, separator: str) -> None:
    line = f'1,"{cell(text)}",x' if "," in text else f"1,{cell(text)},x"
    for part in line.split(separator):
        assert part.strip()[:1] not in ("=", "+", "-", "@", "＝", "＋", "－", "＠")
    assert of_cell(cell(text)) == text


def test_a_table_of_grades_is_no_program_of_a_spreadsheet(tmp_path: Path) -> None:
    """Cells of the table never begin with a character that starts a formula. A submission in another
    encoding, or with a file name that is not UTF-8, does not stop the grading of a folder."""
    folder, out = tmp_path / "all", tmp_path / "grades.csv"
    folder.mkdir()
    for name in ("=1+cmd|calc", "+1", "-1", "@x", "z;=1", "＝1"):
        (folder / f"{name}.py").write_text("x = (")
    (folder / "latin.py").write_bytes("# é\ndef torque(now): return now.q\n".encode("latin-1"))
    Path(os.fsdecode(os.fsencode(folder) + b"/n\xe9.py")).write_text("x = (")
    rows = grade_folder(folder, None, 0, out, one_by_one, lambda _: None)
    assert {row["points"] for row in rows} == {"0"}
    cells = [line.split(",")[0] for line in out.read_text().splitlines()[1:]]
    assert sorted(cells)[:5] == ["'+1.py", "'-1.py", "'=1+cmd|calc.py", "'@x.py", "'＝1.py"]
    assert "z;'=1.py" in cells
    assert any("is not text in UTF-8" in row["error"] for row in rows)
    before = out.read_text()
    grade_folder(folder, None, 0, out, one_by_one, lambda _: None)
    assert out.read_text() == before
