"""Worker processes end when their owner was killed, whether they sleep or compute."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from lessons.parallel import on_cores

HERE = Path(__file__).parent
LONG = 60.0  # s

OWNER = """
import sys
sys.path[:0] = {paths!r}
from test_lessons_orphans import run
if __name__ == "__main__":
    run({folder!r})
"""


def work(task: tuple[str, str]) -> None:
    """Writes a file with its process id and never returns."""
    folder, how = task
    Path(folder, f"{how}-{os.getpid()}").touch()
    while True:
        if how == "asleep":
            time.sleep(1e6)


def run(folder: str) -> None:
    """Starts two workers; the process that calls this function is their owner."""
    list(on_cores(work, [(folder, "asleep"), (folder, "busy")]))


def gone(pid: int) -> bool:
    try:
        return psutil.Process(pid).status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


def wait_for(folder: Path, count: int) -> None:
    end = time.monotonic() + LONG
    while len(list(folder.glob("*-*"))) < count:
        assert time.monotonic() < end
        time.sleep(0.02)


def wait_gone(pids: list[int]) -> None:
    end = time.monotonic() + LONG
    while not all(map(gone, pids)):
        assert time.monotonic() < end, [pid for pid in pids if not gone(pid)]
        time.sleep(0.02)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_workers_end_with_their_owner(tmp_path: Path, number: signal.Signals) -> None:
    script = tmp_path / "owner.py"
    script.write_text(OWNER.format(paths=[str(HERE), str(HERE.parents[1])], folder=str(tmp_path)))
    owner = subprocess.Popen([sys.executable, str(script)])
    try:
        wait_for(tmp_path, min(2, len(os.sched_getaffinity(0))))
        children = [child.pid for child in psutil.Process(owner.pid).children(recursive=True)]
    finally:
        owner.send_signal(number)
        owner.wait()
    assert len(children) >= 2
    wait_gone(children)


def test_a_worker_takes_sigterm(tmp_path: Path) -> None:
    """A worker that receives SIGTERM ends."""
    script = tmp_path / "owner.py"
    script.write_text(OWNER.format(paths=[str(HERE), str(HERE.parents[1])], folder=str(tmp_path)))
    owner = subprocess.Popen([sys.executable, str(script)], stderr=subprocess.DEVNULL)
    try:
        wait_for(tmp_path, 1)
        (name, *_) = tmp_path.glob("*-*")
        pid = int(name.name.split("-")[1])
        os.kill(pid, signal.SIGTERM)
        wait_gone([pid])
    finally:
        owner.kill()
        owner.wait()
