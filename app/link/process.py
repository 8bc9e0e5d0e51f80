"""The page's handle of a simulation process, and the messages over its connection. Only `close` waits for the
process."""

from __future__ import annotations

import contextlib
import errno
import multiprocessing as mp
import os
import pickle
import signal
import socket
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from app.link import fork_server
from app.link.fork_server import SERVER
from app.link.messages import Command, Quit, Ready, Report, SimulationFailed
from app.link.threads import on_thread
from robots.processes.orphans import end_with_parent


def send(page: Connection, report: object) -> None:
    """Sends a report; waits while the page does not read. Raises OSError if the page has ended."""
    page.send(report)
    if isinstance(report, Ready):
        with _socket_of(page) as end:
            socket.send_fds(end, [b"\0"], [report.block])


def receive(child: Connection) -> Any:
    """Waits for the next report and returns it. Raises EOFError or OSError if the other end is closed."""
    report = child.recv()
    if isinstance(report, Ready):
        with _socket_of(child) as end:
            _, files, _, _ = socket.recv_fds(end, 1, 1)
        if not files:
            raise OSError("an open file did not arrive: this process cannot open more")
        return replace(report, block=files[0])
    return report


def hang_up(connection: Connection) -> None:
    """Ends sending and receiving on both ends. Threads that wait there then continue."""
    try:
        with _socket_of(connection) as end:
            end.shutdown(socket.SHUT_RDWR)
    except OSError:
        return


def _socket_of(connection: Connection) -> socket.socket:
    return socket.fromfd(connection.fileno(), socket.AF_UNIX, socket.SOCK_STREAM)


_END = 1.0  # s within which a process must end by itself
MOST = 256
"""Largest number of commands that wait for a process."""
MOST_BYTES = 24_000_000
"""Largest number of bytes of these commands. If none waits, a command of any size is accepted."""
_UNKNOWN = 255  # what `multiprocessing` says when the fork server, which knew the exit code, has died


class Process:
    """A child process. A thread of this handle starts it, receives its reports, and passes them to the
    listener, see `listen`."""

    def __init__(self, worker: str) -> None:
        """worker: the module whose function `main(page)` the child runs; `page` is its connection."""
        ends: tuple[Any, Any] = mp.Pipe()
        self._page, theirs = ends
        self._lock = threading.Lock()
        self._listener: Callable[[Report], None] | None = None
        self._early_reports: list[Report] = []
        self._closed = False
        self._ended = threading.Event()
        self._end_lock = threading.Lock()
        self._end: int | None = None  # readable when the child has ended
        self.pid: int | None = None
        """None before the process has started."""
        self.heard_at = time.monotonic()
        """Time of the child's last report or of its start."""
        self._outbox = Outbox(self._page)
        self._hearing = on_thread("hearing", self._hear_on_thread, worker, theirs)

    @property
    def preparing(self) -> str | None:
        """The reason, as a sentence, why the child has not started yet; None afterwards."""
        return SERVER.doing if self.pid is None and not self._ended.is_set() else None

    @property
    def alive(self) -> bool:
        return not self._closed and not self._ended.is_set()

    def listen(self, listener: Callable[[Report], None]) -> None:
        """Calls `listener` with each report, and with `SimulationFailed` last if the child ends by itself."""
        with self._lock:
            early, self._early_reports = self._early_reports, []
            for report in early:
                listener(report)
            self._listener = listener

    def send(self, command: Command) -> bool:
        """Queues a command; returns whether it was accepted. Returns False if too many commands wait, or if
        the process has ended."""
        return not self._closed and self._outbox.put(command)

    def kill(self) -> None:
        """Kills the child without waiting for its end. A child that starts later is killed
        then."""
        self._closed = True
        self._kill()
        hang_up(self._page)

    def _kill(self) -> None:
        with self._end_lock, contextlib.suppress(ProcessLookupError):
            if self._end is not None and self.pid is not None:
                os.kill(self.pid, signal.SIGKILL)

    def close(self, patience: float = _END) -> None:
        """Ends the child. If it does not end by itself within `patience`, s, it is killed."""
        if self.pid is not None and patience and self.send(Quit()):
            self._closed = True
            self._ended.wait(patience)
        self.kill()
        # The last reports of the child must still be read, as they may name shared memory that must be freed.
        if self.pid is not None and self._hearing is not threading.current_thread():
            self._hearing.join(2 * _END)

    # ---------------------------------------------------------------- the thread

    def _hear_on_thread(self, worker: str, theirs: Connection) -> None:
        try:
            child = SERVER.start(_run, worker, theirs)
        except (OSError, RuntimeError) as error:  # RuntimeError: no thread can be started
            failed, why = False, why_not(error)
        else:
            theirs.close()  # from now on, the connection is closed when the child ends
            failed = self._follow(child)
            why = _obituary(child.exitcode)
        self._ended.set()
        self._outbox.close()
        if not self._closed and not failed:
            self._pass_on(SimulationFailed(why, died=True))
        hang_up(self._page)
        self._outbox.join()
        self._page.close()
        theirs.close()

    def _follow(self, child: BaseProcess) -> bool:
        """Reads reports until the child has ended; returns whether the last report was a failure."""
        assert child.pid is not None
        with self._end_lock:
            self.pid, self.heard_at = child.pid, time.monotonic()
            # Unlike the child's sentinel, this is not readable when the fork server dies.
            self._end = _watched(child)
        if self._closed:
            self._kill()
        failed = False
        while self._page in wait([self._page, self._end]):
            try:
                report: Report = receive(self._page)
            except (EOFError, OSError):
                break
            failed = isinstance(report, SimulationFailed)
            self._pass_on(report)
        if not wait([self._end], _END):
            self._kill()
        child.join(_END)
        with self._end_lock:
            end, self._end = self._end, None
        if end != child.sentinel:
            os.close(end)
        return failed

    def _pass_on(self, report: Report) -> None:
        self.heard_at = time.monotonic()
        with self._lock:
            if self._listener is None:
                self._early_reports.append(report)
                return
        self._listener(report)


class Outbox:
    """A bounded queue of commands, and the only thread that writes from this queue to the connection. Adding
    a command never waits."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._waiting: deque[bytes] = deque()
        self._bytes = 0
        self._closed = False
        self._news = threading.Condition()
        self._writer = on_thread("writing", self._write_on_thread)

    def put(self, command: object) -> bool:
        """Adds a command; returns whether there was room for it. Later changes of the object do not change
        the command."""
        content = pickle.dumps(command, pickle.HIGHEST_PROTOCOL)
        with self._news:
            full = len(self._waiting) >= MOST or self._bytes + len(content) > MOST_BYTES
            if self._closed or (full and self._waiting):
                return False
            self._waiting.append(content)
            self._bytes += len(content)
            self._news.notify()
            return True

    def close(self) -> None:
        """Discards all commands that still wait."""
        with self._news:
            self._closed = True
            self._waiting.clear()
            self._news.notify()

    def join(self) -> None:
        """Waits until the thread has stopped writing. Call this after `close`, when the connection has been
        ended."""
        self._writer.join()

    def _write_on_thread(self) -> None:
        while True:
            with self._news:
                self._news.wait_for(lambda: self._waiting or self._closed)
                if self._closed:
                    return
                content = self._waiting.popleft()
                self._bytes -= len(content)
            try:
                self._connection.send_bytes(content)
            except OSError:
                return  # the receiver has closed its end; the receiving thread handles this


class Spares:
    """Starts one process in advance, for the next browser."""

    def __init__(self, worker: str) -> None:
        """worker: the module that a child runs, see `Process` and `ForkServer`."""
        self._worker = worker
        self._lock = threading.Lock()
        self._spare: Process | None = None
        self._closed = False
        SERVER.enter(worker)

    def refill(self) -> None:
        with self._lock:
            if not self._closed and (self._spare is None or not self._spare.alive):
                self._spare = Process(self._worker)

    def take(self) -> Process:
        with self._lock:
            spare, self._spare = self._spare, None
        return spare if spare is not None and spare.alive else Process(self._worker)

    def close(self) -> None:
        """Ends the spare, and the fork server if nobody else uses it."""
        with self._lock:
            closed, self._closed = self._closed, True
            spare, self._spare = self._spare, None
        if spare is not None:
            spare.close()
        if not closed:
            SERVER.leave()


def _run(worker: str, page: Connection) -> None:
    fork_server.hang_up()
    end_with_parent()
    import_module(worker).main(page)


def _watched(child: BaseProcess) -> int:
    with contextlib.suppress(AttributeError, OSError):  # another system than Linux, or the child has ended
        return os.pidfd_open(child.pid or 0)
    return child.sentinel


def why_not(error: OSError | RuntimeError) -> str:
    """Returns a sentence with the limit because of which a process, or a thread, cannot be started."""
    number = (error.errno or 0) if isinstance(error, OSError) else errno.EAGAIN
    limit = {
        errno.EAGAIN: "the limit of processes is reached (ulimit -u, or that of the container)",
        errno.EMFILE: "the limit of open files is reached (ulimit -n)",
        errno.ENFILE: "the limit of open files of this computer is reached",
        errno.ENOMEM: "there is not enough memory",
    }.get(number, str(error))
    return (
        f"No simulation can be started: {limit}. Close pages or end other programs, then try again; the "
        "person who started himpc-lab can also raise the limit, or lower --max-sessions."
    )


def _obituary(exitcode: int | None) -> str:
    if exitcode is None or exitcode == _UNKNOWN:
        return "The simulation process ended."
    if exitcode < 0:
        return f"The simulation process was ended from outside (signal {-exitcode})."
    return f"The simulation process ended unexpectedly (exit code {exitcode})."


def wait_until(condition: Callable[[], bool], timeout: float, period: float = 0.01) -> bool:
    """Polls until a condition is true; for start-up and tests."""
    end = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(period)
    return True
