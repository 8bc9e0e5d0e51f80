"""Work that does not end well, for a process of its own."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path
from typing import Any


def crash() -> None:
    os.kill(os.getpid(), signal.SIGSEGV)


def eat() -> int:
    return len(bytearray(3_000_000_000))


def descend() -> None:
    descend()


def chatter() -> str:
    """Prints into what the answer comes from, from Python and below it."""
    print("x" * 100_000)
    os.write(1, b"y" * 100_000)
    sys.stdout.flush()
    return "heard"


def stay(file: str) -> None:
    """Writes its process id and stays."""
    Path(file).write_text(str(os.getpid()))
    time.sleep(3600.0)


def load_in_a_daemon(text: str, answers: Any) -> None:
    from robots import InputError, load_urdf_text

    try:
        answers.put(load_urdf_text(text).n)
    except InputError as error:
        answers.put(str(error))
