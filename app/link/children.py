"""A child process as the page sees it: forked by the fork server, or spawned where forking is not
available."""

from __future__ import annotations

import contextlib
import multiprocessing as mp
import os
import signal
import socket
from importlib import import_module
from typing import Protocol

from app.link.wire import Wire
from robots.processes.orphans import end_with_parent


class Child(Protocol):
    """The interface of a child process."""

    @property
    def pid(self) -> int | None:
        """The process id; None before the process has started."""
        ...

    @property
    def exitcode(self) -> int | None:
        """The exit code; −N if signal N ended the process; None if it is not known."""
        ...

    @property
    def doing(self) -> str:
        """What the fork server is doing before the process can start, as a sentence."""
        ...

    def fileno(self) -> int:
        """A descriptor that is readable when `look` has news; it may change after each `look`."""
        ...

    def look(self) -> bool:
        """Reads the news; returns whether the process has ended."""
        ...

    def kill(self) -> None:
        """Kills the process if it has started."""
        ...

    def close(self) -> None:
        """Closes the handle of a process that has ended."""
        ...


class Preparation(Protocol):
    """The preparation that a child waits for before it starts."""

    doing: str


class Forked:
    """A child of the fork server. Two numbers arrive over `status`: its process id, and later its exit
    code."""

    def __init__(self, status: socket.socket, server: Preparation) -> None:
        self._status, self._server = status, server
        self._ended = False
        self._alone: int | None = None
        self.pid: int | None = None
        self.exitcode: int | None = None

    @property
    def unborn(self) -> bool:
        return self.pid is None and not self._ended

    @property
    def doing(self) -> str:
        return self._server.doing

    def fileno(self) -> int:
        return self._status.fileno() if self._alone is None else self._alone

    def look(self) -> bool:
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
        if self.pid is not None and not self._ended:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGKILL)

    def close(self) -> None:
        self._ended = True
        self._status.close()
        if self._alone is not None:
            os.close(self._alone)
            self._alone = None


class Spawned:
    """A new interpreter, which takes a second or two to import everything."""

    doing = ""

    def __init__(self, worker: str, theirs: socket.socket) -> None:
        """worker: module name, as for `ForkServer`."""
        before = {name: os.environ.get(name) for name in one_thread_each()}
        os.environ.update(one_thread_each())
        try:
            self._process = mp.get_context("spawn").Process(target=_run, args=(worker, theirs), daemon=True)
            self._process.start()
        finally:
            for name, value in before.items():
                if value is None:
                    del os.environ[name]
                else:
                    os.environ[name] = value
        self.pid = self._process.pid
        self.exitcode: int | None = None

    def fileno(self) -> int:
        return self._process.sentinel

    def look(self) -> bool:
        self._process.join(1.0)
        self.exitcode = self._process.exitcode
        return True

    def kill(self) -> None:
        with contextlib.suppress(ValueError):  # the process has ended and the handle is closed
            self._process.kill()

    def close(self) -> None:
        with contextlib.suppress(ValueError):  # the process was killed but has not ended yet
            self._process.close()


def one_thread_each() -> dict[str, str]:
    """Environment variables of a child. With matrices of 7 × 7, the threads of a linear algebra library only
    take processor time from the page. The variables are read when numpy is first imported, before any of our
    code runs."""
    return dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def _run(worker: str, theirs: socket.socket) -> None:
    end_with_parent()
    import_module(worker).main(Wire(theirs))
