"""Measures the total memory and computing time of a process and its descendants, and ends them together."""

from __future__ import annotations

import os
import signal
import time
from contextlib import suppress

import psutil


def family(pid: int) -> list[psutil.Process]:
    """Returns a process and all its descendants that still exist."""
    try:
        eldest = psutil.Process(pid)
        return [eldest, *eldest.children(recursive=True)]
    except psutil.Error:
        return []


def has_ended(pid: int, within: float) -> bool:
    """Waits up to `within` seconds and returns whether a child process has ended. `wait` must not have been
    called for this child."""
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
    """Returns the CPU time, s, of all threads of a process, and whether the process is idle: it neither
    computes nor waits for a core."""
    try:
        process = psutil.Process(pid)
        times = process.cpu_times()
        return times.user + times.system, process.status() != psutil.STATUS_RUNNING
    except psutil.Error:
        return 0.0, True


def memory_of(pid: int) -> int:
    """Returns the memory, in bytes, of a process and its descendants. Shared pages count once per process."""
    found = 0
    for each in family(pid):
        with suppress(psutil.Error):
            found += each.memory_info().rss
    return found


def end_family(pid: int, mark: tuple[str, str] | None = None) -> bool:
    """Ends a process, all its descendants, and its process group if it leads one.

    Args:
        pid: process id. The process may have ended, but `wait` must not have been called for it.
        mark: name and unique value of an environment variable. All processes with this variable and value are
            ended too, whatever their group or parent is.

    Returns:
        whether there were other processes than the process itself.
    """
    found = family(pid)
    for each in found:
        with suppress(psutil.Error):
            each.suspend()  # a stopped process cannot start further ones
    others = [each for each in {*found, *family(pid)} if each.pid != pid]
    for each in others:
        with suppress(psutil.Error):
            each.kill()
    with suppress(OSError):
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
    """Ends all processes whose environment contains the variable and the value in `mark`, and repeats this
    until no such process is left. Returns whether there were any."""
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
