"""Ctrl-C in every phase of a command: the command ends without a traceback and leaves no process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

from app.link.process import wait_until

ROOT = Path(__file__).parents[2]
LONG = 120.0  # s


class Program:
    """`himpc-lab` in a process group of its own, as a terminal starts it."""

    def __init__(self, arguments: list[str], folder: Path, cache: str | None) -> None:
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        if cache is not None:
            environment["NUMBA_CACHE_DIR"] = cache
        self.process = subprocess.Popen(
            [sys.executable, "-m", "app", *arguments],
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        self.said: list[str] = []
        self._listening = [
            threading.Thread(target=self._listen, args=(stream, self.said), daemon=True)
            for stream in (self.process.stdout, self.process.stderr)
        ]
        for thread in self._listening:
            thread.start()

    def _listen(self, stream: Iterator[str], said: list[str]) -> None:
        for line in stream:
            said.append(line)

    def loaded(self, library: str) -> bool:
        return library in Path(f"/proc/{self.process.pid}/maps").read_text()

    def has_said(self, word: str) -> bool:
        return any(word in line for line in self.said)

    @property
    def children(self) -> list[psutil.Process]:
        return psutil.Process(self.process.pid).children(recursive=True)

    def interrupt(self) -> None:
        """Sends SIGINT to the whole process group, as a terminal does."""
        os.killpg(self.process.pid, signal.SIGINT)

    def end(self) -> str:
        """Waits for the end and returns everything that was printed."""
        self.process.wait(LONG)
        for thread in self._listening:
            thread.join(LONG)
        return "".join(self.said)


When = Callable[[Program], bool]

PHASES: dict[str, tuple[list[str], bool, When]] = {
    "imports": (["run", "iiwa14-circle"], False, lambda it: it.loaded("numpy")),
    "imports of the page": (["--no-browser", "--port", "0"], False, lambda it: it.loaded("numpy")),
    "compiling": (["run", "iiwa14-circle"], True, lambda it: bool(it.children)),
    "compiling for the page": (["--no-browser", "--port", "0"], True, lambda it: len(it.children) > 1),
    "serving": (["--no-browser", "--port", "0"], False, lambda it: it.has_said("ready at")),
    "running": (["run", "iiwa14-circle", "--duration", "600"], False, lambda it: it.loaded("libmujoco")),
    "checking": (["lessons", "--check", "one-task"], False, lambda it: len(it.children) > 1),
    "sweeping": (
        ["sweep", "planar3-hold", "--over", "horizon=1:10:10", "--over", "Q=1:100:20", "--out", "swept"],
        False,
        lambda it: len(it.children) > 1,
    ),
}


@pytest.mark.parametrize("phase", PHASES)
def test_ctrl_c_ends_it(phase: str, tmp_path: Path) -> None:
    arguments, cold, when = PHASES[phase]
    program = Program(arguments, tmp_path, str(tmp_path / "cache") if cold else None)
    try:
        assert wait_until(lambda: program.process.poll() is not None or when(program), LONG)
        assert program.process.poll() is None, program.said
        children = program.children
        program.interrupt()
        said = program.end()
    finally:
        if program.process.poll() is None:
            os.killpg(program.process.pid, signal.SIGKILL)
    assert "Traceback" not in said and "Exception" not in said
    # If the signal interrupts code that was compiled from text, Python itself raises it again at its end.
    assert program.process.returncode in (0, 130, -signal.SIGINT)
    assert wait_until(lambda: not any(child.is_running() for child in children), LONG)


@pytest.mark.parametrize("again", [0.05, 1e-6])
def test_what_swallows_an_interrupt_is_interrupted_again(again: float) -> None:
    """A callback that a library calls loses the exception, and the library continues. It is interrupted
    again, also if the alarm comes before Python's hook for lost exceptions has returned."""
    code = f"""
import ctypes, time
from app.commands import interrupts
from app.commands.interrupts import interruptible
interrupts._AGAIN = {again}
compare = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)
numbers = (ctypes.c_int * 1000)()

@compare
def swallow(*_):
    print("begun", flush=True)
    time.sleep(0.4)
    return 0

with interruptible():
    ctypes.CDLL(None).qsort(numbers, 1000, 4, swallow)
"""
    process = subprocess.Popen(
        [sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None and process.stdout.readline() == "begun\n"
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=LONG)
    assert process.returncode == 130
    assert errors == ""


BEFORE_ANYTHING = """
import importlib.abc, os, runpy, signal, sys

class Interrupted(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name == "app.commands.interrupts":
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Interrupted())
{start}
"""


def python(*arguments: str, before: Callable[[], None] | None = None) -> subprocess.CompletedProcess[str]:
    """Runs Python with these arguments and returns the result. before: a function that is called first in the
    new process."""
    command = [sys.executable, *arguments]
    return subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, timeout=LONG, check=False, preexec_fn=before
    )


@pytest.mark.parametrize(
    "start",
    [
        "runpy.run_module('app', run_name='__main__')",
        "from app.commands.console import main; sys.exit(main())",
    ],
    ids=["module", "script"],
)
def test_ctrl_c_while_the_first_modules_load(start: str) -> None:
    done = python("-c", BEFORE_ANYTHING.replace("{start}", start), "scenes")
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def deaf() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def test_a_job_in_the_background_goes_on() -> None:
    """A program that was started so that it ignores Ctrl-C (`nohup`, `&` in a script) keeps ignoring it."""
    code = """
import os, signal
from app.commands.interrupts import interruptible
with interruptible():
    os.kill(os.getpid(), signal.SIGINT)
print("went on")
"""
    done = python("-c", code, before=deaf)
    assert (done.returncode, done.stdout, done.stderr) == (0, "went on\n", "")


def test_tests_in_the_background_start_programs_as_a_terminal_does() -> None:
    """Tests that run in the background ignore Ctrl-C, but the programs that they start must not."""
    done = python("-m", "pytest", "-n", "0", "-k", "first_modules_load", __file__, before=deaf)
    assert done.returncode == 0, done.stdout
    assert "2 passed" in done.stdout
