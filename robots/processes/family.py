"""A process and all it started: ended as a whole, and how much memory they have together."""

from __future__ import annotations

import os
import signal
import time
from contextlib import suppress

import psutil


def family(pid: int) -> list[psutil.Process]:
    """A process, its children and theirs, as far as they are there."""
    try:
        eldest = psutil.Process(pid)
        return [eldest, *eldest.children(recursive=True)]
    except psutil.Error:
        return []


def has_ended(pid: int, within: float) -> bool:
    """Whether a child that nobody waited for is over, or is so within some seconds."""
    end = time.monotonic() + within
    while True:
        try:
            if psutil.Process(pid).status() == psutil.STATUS_ZOMBIE:
                return True
        except psutil.Error:
            return True
        if time.monotonic() > end:
            return False
        time.sleep(0.01)


def spent(pid: int) -> tuple[float, bool]:
    """Seconds that a process computed until now, in all its threads, and whether it neither computes now nor
    waits for a core to do so."""
    try:
        process = psutil.Process(pid)
        times = process.cpu_times()
        return times.user + times.system, process.status() != psutil.STATUS_RUNNING
    except psutil.Error:
        return 0.0, True


def memory_of(pid: int) -> int:
    """Bytes that a process and all it started hold, pages they share counted once each time."""
    found = 0
    for each in family(pid):
        with suppress(psutil.Error):
            found += each.memory_info().rss
    return found


def end_family(pid: int, mark: tuple[str, str] | None = None) -> bool:
    """Ends a process, all it started, and its process group if it leads one.

    Args:
        pid: of the process. It may be over, and must not have been waited for.
        mark: a variable of its environment with a value that nothing else has: who still has it is ended too,
            wherever it moved to.

    Returns:
        whether there was anything beside the process itself.
    """
    found = family(pid)
    for each in found:
        with suppress(psutil.Error):
            each.suspend()  # so that it starts nothing more
    others = [each for each in {*found, *family(pid)} if each.pid != pid]
    for each in others:
        with suppress(psutil.Error):
            each.kill()
    with suppress(OSError, AttributeError):
        if os.getpgid(pid) == pid:
            others += [each for each in _alive(pid) if each.pid != pid]
            os.killpg(pid, signal.SIGKILL)
    with suppress(psutil.Error):
        psutil.Process(pid).kill()
    return _end_marked(mark) or bool(others)


def _alive(group: int) -> list[psutil.Process]:
    found = []
    for each in psutil.process_iter():
        with suppress(psutil.Error, OSError):
            if os.getpgid(each.pid) == group and each.status() != psutil.STATUS_ZOMBIE:
                found.append(each)
    return found


def _end_marked(mark: tuple[str, str] | None) -> bool:
    """Ends who has a variable of that value, until nobody has."""
    any_found = False
    for _ in range(100 if mark else 0):
        found = []
        for each in psutil.process_iter():
            with suppress(psutil.Error, OSError):
                if mark and each.environ().get(mark[0]) == mark[1] and each.status() != psutil.STATUS_ZOMBIE:
                    each.kill()
                    found.append(each)
        if not found:
            break
        any_found = True
    return any_found
