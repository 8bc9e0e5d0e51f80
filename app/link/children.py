"""A child process as the page holds it: forked by the fork server, or spawned where that is not to be had."""

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
    """One process."""

    @property
    def pid(self) -> int | None:
        """Its number; None if it is not yet born."""
        ...

    @property
    def exitcode(self) -> int | None:
        """How it ended: minus the signal's number if by one; None if that is not known."""
        ...

    @property
    def doing(self) -> str:
        """What must be done before it can be born."""
        ...

    def fileno(self) -> int:
        """Readable when `look` has news; another one after it had."""
        ...

    def look(self) -> bool:
        """Takes news in; whether the process has ended."""
        ...

    def kill(self) -> None:
        """Ends it by force, if it is born."""
        ...

    def close(self) -> None:
        """Lets go of the handle, once it has ended."""
        ...


class Preparation(Protocol):
    """What an unborn child waits for."""

    doing: str


class Forked:
    """A child of the fork server. Two numbers come over `status`: its own, and its exit code."""

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
            # The server has died. Its children go on, but nobody is left to tell how they end.
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
        """worker: as of `ForkServer`."""
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
        with contextlib.suppress(ValueError):  # closed, because it has ended
            self._process.kill()

    def close(self) -> None:
        with contextlib.suppress(ValueError):  # killed, but not yet gone
            self._process.close()


def one_thread_each() -> dict[str, str]:
    """Environment of a child. Threads of linear algebra on 7 × 7 matrices only fight for the page's core; the
    variables count when numpy is first imported, which is before any code of ours runs."""
    return dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def _run(worker: str, theirs: socket.socket) -> None:
    end_with_parent()
    import_module(worker).main(Wire(theirs))
