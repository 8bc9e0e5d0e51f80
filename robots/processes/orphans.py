"""A process that ends with the one that started it, whatever it is doing."""

from __future__ import annotations

import contextlib
import multiprocessing as mp
import os
import signal
import threading
from multiprocessing.connection import wait


def end_with(pipe: int, group: bool = False) -> None:
    """Ends this process when the last writer of a pipe is gone, even while it is asleep, stopped or deep in a
    library; with `group` all of its process group.

    Args:
        pipe: the end to read from. Nothing may ever be written to it.
        group: whether the rest of the process group ends too.
    """
    try:
        import fcntl

        fcntl.fcntl(pipe, fcntl.F_SETOWN, -os.getpgrp() if group else os.getpid())
        fcntl.fcntl(pipe, fcntl.F_SETSIG, signal.SIGKILL)
        fcntl.fcntl(pipe, fcntl.F_SETFL, fcntl.fcntl(pipe, fcntl.F_GETFL) | os.O_ASYNC)
    except (ImportError, AttributeError, OSError):
        # Not Linux: the next best is a thread, which a long call of a library may keep from running.
        threading.Thread(target=_wait, args=(pipe,), daemon=True).start()
        return
    with contextlib.suppress(OSError):
        if wait([pipe], timeout=0.0):
            _end()  # it was gone before we asked


def end_with_parent() -> None:
    """`end_with` the process that spawned this one through multiprocessing; nothing in any other."""
    parent = mp.parent_process()
    if parent is not None:
        end_with(parent.sentinel)


def _wait(pipe: int) -> None:
    wait([pipe])
    _end()


def _end() -> None:
    os.kill(os.getpid(), signal.SIGKILL if hasattr(signal, "SIGKILL") else signal.SIGTERM)
