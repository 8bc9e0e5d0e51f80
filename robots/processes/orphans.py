"""Makes a process end together with the process that started it."""

from __future__ import annotations

import contextlib
import multiprocessing as mp
import os
import signal
import threading
from multiprocessing.connection import wait


def end_with(pipe: int, group: bool = False) -> None:
    """Ends this process when the last writer of a pipe is closed, even while the process sleeps, is stopped
    or runs in a library.

    Args:
        pipe: the end to read from. Nothing may be written to the other end.
        group: whether all other processes of the group end too.
    """
    try:
        import fcntl

        fcntl.fcntl(pipe, fcntl.F_SETOWN, -os.getpgrp() if group else os.getpid())
        fcntl.fcntl(pipe, fcntl.F_SETSIG, signal.SIGKILL)
        fcntl.fcntl(pipe, fcntl.F_SETFL, fcntl.fcntl(pipe, fcntl.F_GETFL) | os.O_ASYNC)
    except (ImportError, AttributeError, OSError):
        # On other systems than Linux, a thread watches the pipe. A long call of a library may delay this
        # thread.
        threading.Thread(target=_wait, args=(pipe,), daemon=True).start()
        return
    with contextlib.suppress(OSError):
        if wait([pipe], timeout=0.0):
            _end()  # the writer was closed before this call


def end_with_parent() -> None:
    """Makes this process end when its parent ends. Does nothing if the process was not started by
    `multiprocessing`."""
    parent = mp.parent_process()
    if parent is not None:
        end_with(parent.sentinel)


def _wait(pipe: int) -> None:
    wait([pipe])
    _end()


def _end() -> None:
    os.kill(os.getpid(), signal.SIGKILL)
