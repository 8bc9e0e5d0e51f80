"""A child process as the page sees it: forked by the fork server, spawned if forking is not available, or
forked from this process."""

from __future__ import annotations

import contextlib
import errno
import multiprocessing as mp
import os
import signal
import socket
from collections.abc import Callable
from importlib import import_module
from multiprocessing.process import BaseProcess

from app.link.wire import Wire
from robots.processes.orphans import end_with_parent


class Forked:
    """A child of the fork server. Two numbers arrive over `status`: its process id, and later its exit
    code.

    Attributes:
        pid: the process id; None before the process has started.
        exitcode: −N if signal N ended the process; None if it is not known.
    """

    def __init__(self, status: socket.socket, doing: Callable[[], str]) -> None:
        """doing: returns a sentence about the fork server's work before the process can start."""
        self._status, self._doing = status, doing
        self._ended = False
        self._alone: int | None = None
        self.pid: int | None = None
        self.exitcode: int | None = None

    @property
    def unborn(self) -> bool:
        return self.pid is None and not self._ended

    @property
    def doing(self) -> str:
        return self._doing()

    def fileno(self) -> int:
        """Returns a descriptor that is readable when there is news for `look`. It may change after each
        `look`."""
        return self._status.fileno() if self._alone is None else self._alone

    def look(self) -> bool:
        """Reads the news; returns whether the process has ended."""
        if self._alone is not None:
            self._ended = True
            return True
        told = self._status.recv(8, socket.MSG_WAITALL)
        number = int.from_bytes(told, "big", signed=True) if len(told) == 8 else None
        if number is None and self.pid is not None:
            # The fork server has died. Its children continue, but their exit codes will never be reported.
            with contextlib.suppress(OSError):
                self._alone = os.pidfd_open(self.pid)
            self._ended = self._alone is None
        elif self.pid is None and number is not None:
            self.pid = number
        else:
            self._ended, self.exitcode = True, number
        return self._ended

    def kill(self) -> None:
        """Kills the process if it has started."""
        if self.pid is not None and not self._ended:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGKILL)

    def close(self) -> None:
        """Closes the handle of a process that has ended."""
        self._ended = True
        self._status.close()
        if self._alone is not None:
            os.close(self._alone)
            self._alone = None


class Spawned:
    """A process of Python's own `multiprocessing`; with the same methods as `Forked`."""

    doing = ""

    def __init__(self, process: BaseProcess) -> None:
        """process: the process, which is then started."""
        self._process = process
        process.start()
        self.pid = process.pid
        self.exitcode: int | None = None

    def fileno(self) -> int:
        return self._process.sentinel

    def look(self) -> bool:
        self._process.join(1.0)
        self.exitcode = self._process.exitcode
        return True

    def kill(self) -> None:
        with contextlib.suppress(ValueError):  # raised if the process has ended and the handle is closed
            self._process.kill()

    def close(self) -> None:
        with contextlib.suppress(ValueError):  # raised if the process was killed but has not ended yet
            self._process.close()


class NotStarted:
    """A process that could not be started; with the same methods as `Forked`."""

    doing, pid, exitcode = "", None, None

    def fileno(self) -> int:
        return -1

    def look(self) -> bool:
        return True

    def kill(self) -> None:
        """Does nothing."""

    def close(self) -> None:
        """Does nothing."""


Child = Forked | Spawned | NotStarted


def why_not(error: OSError) -> str:
    """Returns a sentence with the limit because of which a process cannot be started."""
    limit = {
        errno.EAGAIN: "the limit of processes is reached (ulimit -u, or that of the container)",
        errno.EMFILE: "the limit of open files is reached (ulimit -n)",
        errno.ENFILE: "the limit of open files of this computer is reached",
        errno.ENOMEM: "there is not enough memory",
    }.get(error.errno or 0, str(error))
    return (
        f"No simulation can be started: {limit}. Close pages or end other programs, then try again; the "
        "person who started himpc-lab can also raise the limit, or lower --max-sessions."
    )


def spawned(worker: str, theirs: socket.socket) -> Spawned:
    """Returns a new interpreter, which needs a second or two for the imports. worker: module name, as for
    `ForkServer`."""
    return Spawned(mp.get_context("spawn").Process(target=_run, args=(worker, theirs), daemon=True))


def _run(worker: str, theirs: socket.socket) -> None:
    end_with_parent()
    import_module(worker).main(Wire(theirs))
