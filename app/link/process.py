"""The page's handle of a simulation process. Only `close` waits for the process."""

from __future__ import annotations

import select
import socket
import threading
import time
from collections.abc import Callable

from app.link.children import Child, NotStarted, why_not
from app.link.messages import Command, Quit, Report, SimulationFailed
from app.link.outbox import Outbox
from app.link.wire import Wire

_END = 1.0  # s within which a process must end by itself

Start = Callable[[socket.socket], Child]
"""A function that starts a child. Its argument is the child's end of the connection, a socket."""


class Process:
    """A child process. A thread of this handle receives the reports and passes them to the listener, see
    `listen`."""

    def __init__(self, start: Start, *instead: Start) -> None:
        """instead: other ways to start the child. They are tried in order if the child's fork server ends
        before the child has started."""
        ours, self._theirs = socket.socketpair()
        self._wire = Wire(ours)
        self._instead = list(instead)
        self._failure = ""  # the reason why no child could be started
        self._child: Child = self._started(start)
        self._outbox = Outbox(self._wire)
        self._lock = threading.Lock()
        self._listener: Callable[[Report], None] | None = None
        self._unheard: list[Report] = []
        self._closed = False
        self._ended = threading.Event()
        self.heard_at = time.monotonic()
        """Time of the child's last report or of its start."""
        self._hearing = threading.Thread(target=self._hear, daemon=True)
        self._hearing.start()

    @property
    def pid(self) -> int | None:
        return self._child.pid

    @property
    def preparing(self) -> str | None:
        """The reason, as a sentence, why the child has not started yet; None afterwards."""
        child = self._child
        return child.doing if child.pid is None and not self._ended.is_set() else None

    @property
    def alive(self) -> bool:
        return not self._closed and not self._ended.is_set()

    def listen(self, listener: Callable[[Report], None]) -> None:
        """Calls `listener` with each report, and with `SimulationFailed` last if the child ends by itself."""
        with self._lock:
            unheard, self._unheard = self._unheard, []
            for report in unheard:
                listener(report)
            self._listener = listener

    def send(self, command: Command) -> bool:
        """Queues a command; returns whether it was accepted. Returns False if too many commands wait, or if
        the process has ended."""
        return not self._closed and self._outbox.put(command)

    def kill(self) -> None:
        """Kills the child without waiting for its end."""
        self._closed = True
        self._child.kill()
        self._wire.hang_up()  # a child that starts later finds the socket closed

    def close(self, patience: float = _END) -> None:
        """Ends the child. If it does not end by itself within `patience`, s, it is killed."""
        if self._child.pid is not None and patience and self.send(Quit()):
            self._closed = True
            self._ended.wait(patience)
        self.kill()
        # The last reports of the child must still be read, as they may name shared memory that must be freed.
        if self._hearing is not threading.current_thread():
            self._hearing.join(2 * _END)

    # ---------------------------------------------------------------- the thread

    def _hear(self) -> None:
        failed = self._follow()
        self._ended.set()
        self._outbox.close()
        if not self._closed and not failed:
            self._pass_on(SimulationFailed(self._failure or _obituary(self._child.exitcode), died=True))
        self._wire.hang_up()
        self._outbox.join()
        self._wire.close()
        self._theirs.close()
        self._child.close()

    def _started(self, start: Start) -> Child:
        try:
            return start(self._theirs)
        except OSError as error:
            self._failure = why_not(error)
            return NotStarted()

    def _follow(self) -> bool:
        """Reads reports until the child has ended; returns whether the last report was a failure."""
        failed, over = False, 0.0
        while not self._failure:
            there, news = self._wait(None if not over else over - time.monotonic())
            if there and not over:
                try:
                    report: Report = self._wire.recv()
                except (EOFError, OSError):
                    over = time.monotonic() + _END  # the exit code will arrive shortly
                else:
                    failed = isinstance(report, SimulationFailed)
                    self._pass_on(report)
                continue
            if news:
                if self._look():
                    return failed
            elif over and time.monotonic() >= over:
                self._child.kill()
                return failed
        return False

    def _wait(self, timeout: float | None) -> tuple[bool, bool]:
        """Waits; returns (whether the wire can be read, whether the child has news)."""
        watched = select.poll()
        if timeout is None:
            watched.register(self._wire, select.POLLIN)
        watched.register(self._child, select.POLLIN)
        ready = {number for number, _ in watched.poll(None if timeout is None else max(0.0, 1e3 * timeout))}
        return self._wire.fileno() in ready, self._child.fileno() in ready

    def _look(self) -> bool:
        ended = self._child.look()
        if self._child.pid is not None:
            self._theirs.close()  # from now on, the socket is closed when the child ends
        elif ended and self._instead and not self._closed:
            self._child.close()
            self._child = self._started(self._instead.pop(0))
            ended = False
        self.heard_at = time.monotonic()
        return ended

    def _pass_on(self, report: Report) -> None:
        self.heard_at = time.monotonic()
        with self._lock:
            if self._listener is None:
                self._unheard.append(report)
                return
        self._listener(report)


def _obituary(exitcode: int | None) -> str:
    if exitcode is None:
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
