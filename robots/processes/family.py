"""A process and its descendants: their common memory and computing time, and how they are ended together."""

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
    """Returns whether a child that has not been waited for ends within some seconds."""
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
    """Returns the seconds of CPU time that a process has used in all its threads, and whether it is idle: it
    neither computes nor waits for a core."""
    try:
        process = psutil.Process(pid)
        times = process.cpu_times()
        return times.user + times.system, process.status() != psutil.STATUS_RUNNING
    except psutil.Error:
        return 0.0, True


def memory_of(pid: int) -> int:
    """Returns the bytes that a process and its descendants use; pages that they share count once per
    process."""
    found = 0
    for each in family(pid):
        with suppress(psutil.Error):
            found += each.memory_info().rss
    return found


def end_family(pid: int, mark: tuple[str, str] | None = None) -> bool:
    """Ends a process, all its descendants, and its process group if it leads one.

    Args:
        pid: process id. The process may have ended, but it must not have been waited for.
        mark: an environment variable of the process with a unique value: every process that has this value is
            ended too, whatever its group or parent is.

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
    """Ends the processes that have an environment variable with this value until none is left."""
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
