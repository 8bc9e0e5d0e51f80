"""The page's handle of a simulation process, and the spare that waits warm for the next browser."""

from __future__ import annotations

import contextlib
import multiprocessing as mp
import os
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess

from app.link.messages import Command, Failed, Quit, Report

_END = 1.0  # s a process gets to end by itself
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
# Children inherit these. Threads of linear algebra on 7 × 7 matrices only fight for the page's core; the
# variables count when numpy is first imported, which in a spawned child is before any code of ours runs.


Entry = Callable[[Connection], None]
"""What a simulation process runs, with its end of the pipe; handed in, so that no page imports it."""


class Process:
    """A spawned child. Reports arrive on a thread of this handle and go to the `listen`er."""

    def __init__(self, entry: Entry) -> None:
        for name in _THREADS:
            os.environ[name] = "1"
        context = mp.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._child: SpawnProcess = context.Process(target=entry, args=(theirs,), daemon=True)
        self._child.start()
        theirs.close()
        self._sending = threading.Lock()
        self._closed = False
        self._listening: threading.Thread | None = None

    @property
    def pid(self) -> int | None:
        return self._child.pid

    @property
    def alive(self) -> bool:
        return not self._closed and self._child.is_alive()

    def listen(self, listener: Callable[[Report], None]) -> None:
        """Calls `listener` with every report, and with a last `Failed` if the child dies unasked."""
        self._listening = threading.Thread(target=self._hear, args=(self._pipe, listener), daemon=True)
        self._listening.start()

    def _hear(self, pipe: Connection, listener: Callable[[Report], None]) -> None:
        failed = False
        while True:
            try:
                report: Report = pipe.recv()
            except (EOFError, OSError):
                break
            failed = isinstance(report, Failed)
            listener(report)
        if not self._closed and not failed:
            self._child.join(_END)
            listener(Failed(_obituary(self._child.exitcode)))

    def send(self, command: Command) -> None:
        """A command to a dead child is dropped: its death is reported by `listen`."""
        with self._sending, contextlib.suppress(OSError):
            self._pipe.send(command)

    def close(self) -> None:
        """Ends the child, by force if need be."""
        self.send(Quit())
        self._closed = True
        self._child.join(_END)
        if self._child.is_alive():
            self._child.kill()
            self._child.join()
        # What the child said last is still heard: it may name memory that must be freed.
        if self._listening is not None and self._listening is not threading.current_thread():
            self._listening.join(_END)
        self._pipe.close()


def _obituary(exitcode: int | None) -> str:
    if exitcode is not None and exitcode < 0:
        return f"The simulation process was ended from outside (signal {-exitcode})."
    return f"The simulation process ended unexpectedly (exit code {exitcode})."


class Spares:
    """Keeps one child started ahead: importing everything takes it a second or two."""

    def __init__(self, entry: Entry) -> None:
        self._entry = entry
        self._lock = threading.Lock()
        self._spare: Process | None = None
        self._closed = False

    def refill(self) -> None:
        """Starts a spare unless there is one."""
        with self._lock:
            if not self._closed and (self._spare is None or not self._spare.alive):
                self._spare = Process(self._entry)

    def take(self) -> Process:
        """The spare, or a new child."""
        with self._lock:
            spare, self._spare = self._spare, None
        return spare if spare is not None and spare.alive else Process(self._entry)

    def close(self) -> None:
        with self._lock:
            self._closed = True
            spare, self._spare = self._spare, None
        if spare is not None:
            spare.close()


def wait_until(condition: Callable[[], bool], timeout: float, period: float = 0.01) -> bool:
    """Polls; for start-up and tests."""
    end = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(period)
    return True
