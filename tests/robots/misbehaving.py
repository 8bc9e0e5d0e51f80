"""Functions that crash, hang or print; tests run them in a separate process."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

_seen: list[str] = []


def seen_by(*what: str) -> list[str]:
    """Adds the given words to those that this process has received, and returns all of them."""
    _seen.extend(what)
    return _seen


def open_files() -> set[str]:
    """Returns the open files of this process, except its standard streams."""
    found = set()
    for number in os.listdir("/proc/self/fd"):
        if int(number) > 2 and os.path.exists(f"/proc/self/fd/{number}"):
            found.add(os.readlink(f"/proc/self/fd/{number}").split(" ")[0])
    return found


def apart(work: Any, *args: Any, seconds: float = 10.0) -> Any:
    """Runs `isolated(work, *args)`, in a copy of this process if possible. The copy contains the word "the
    original"."""
    from robots.processes.isolation import Allowance, Fault, isolated

    _seen[:] = ["the original"]
    try:
        return isolated(work, *args, within=Allowance(seconds), copied=True)
    except Fault as fault:
        return f"Fault: {fault}"


def crash() -> None:
    os.kill(os.getpid(), signal.SIGSEGV)


def eat() -> int:
    return len(bytearray(3_000_000_000))


def descend() -> None:
    descend()


def chatter() -> str:
    """Prints to standard output, with `print` and directly to file descriptor 1, and returns an answer."""
    print("x" * 100_000)
    os.write(1, b"y" * 100_000)
    sys.stdout.flush()
    return "heard"


def stay(file: str) -> None:
    """Writes the process id into a file and sleeps."""
    Path(file).write_text(str(os.getpid()))
    time.sleep(3600.0)


def load_in_a_daemon(text: str, answers: Any) -> None:
    from robots import InputError, load_urdf_text

    try:
        answers.put(load_urdf_text(text).n)
    except InputError as error:
        answers.put(str(error))


def leave() -> None:
    os._exit(0)


def multiply() -> int:
    """Starts a process that does not end, and returns its id."""
    child = os.fork()
    if child == 0:
        time.sleep(3600.0)
        os._exit(0)
    return child
