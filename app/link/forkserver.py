"""A server process that has imported all modules and forks simulations. Each simulation starts at once and
shares the server's memory.

The page sends requests over a socket and never waits. The server and all its children are one process group.
The group is tied to a pipe to which only the page can write: if the page's process ends for any reason, the
kernel also ends the group.
"""

from __future__ import annotations

import contextlib
import gc
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import NoReturn

from app.link.children import Forked
from app.link.wire import Handle, Wire, packed
from robots.processes.isolation import is_stopped, threads, waited
from robots.processes.orphans import end_with

PATIENCE = 3.0
"""Time, s, after which a server counts as stuck if it is ready but does not fork, or if it was stopped
(SIGSTOP). Time in which it waits for a core of a busy machine does not count."""
FIRST_PATIENCE = 120.0
"""Time without a message, s, after which a server that still imports and compiles counts as stuck."""
_LOOK = 0.25  # s between two checks whether the server is stuck


@dataclass(frozen=True)
class Fork:
    """A request for a child. wire: the child's end of its socket; status: the socket for its process id and
    exit code."""

    wire: Handle
    status: Handle


@dataclass(frozen=True)
class Preparing:
    """The server's work before it can fork. The page shows the sentence."""

    sentence: str


@dataclass(frozen=True)
class ForkReady:
    """The server can fork now."""


class ForkServer:
    """The page's handle of the fork server. Raises OSError on systems where processes cannot be forked."""

    def __init__(self, worker: str) -> None:
        """worker: a module with two functions. `warm(say)` loads everything that a simulation needs and may
        report its progress with `say`. `main(wire)` is run by each child."""
        if sys.platform != "linux":
            raise OSError("only Linux has libraries that still work after a fork")
        ours, theirs = socket.socketpair()
        life, self._life = os.pipe()
        code = (
            f"import sys; sys.path[:] = {sys.path!r}; from app.link.forkserver import serve; "
            f"serve({theirs.fileno()}, {life}, {worker!r})"
        )
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-c", code],
                pass_fds=(theirs.fileno(), life),
                stdin=subprocess.DEVNULL,
                process_group=0,
            )
        except OSError:
            ours.close()
            os.close(self._life)
            raise
        finally:
            theirs.close()
            os.close(life)
        self.ready = False
        self.stopped = False
        """Whether the server was ended because it had been stopped (SIGSTOP)."""
        self.doing = ""
        self._heard_at = time.monotonic()
        self._ended = False
        self._asked: list[tuple[float, float, Forked]] = []  # (time, time waited for a core, child)
        self._wire = Wire(ours)
        self._lock = threading.Lock()
        self._listening = threading.Thread(target=self._hear, daemon=True)
        self._listening.start()

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def alive(self) -> bool:
        return not self._ended

    def _hear(self) -> None:
        with contextlib.suppress(EOFError, OSError):
            while True:
                if not self._wire.poll(_LOOK):
                    self._end_if_stuck()
                    continue
                word = self._wire.recv()
                self._heard_at = time.monotonic()
                match word:
                    case Preparing(sentence):
                        self.doing = sentence
                    case ForkReady():
                        self.ready, self.doing = True, ""
        self._ended = True
        self._process.wait()

    @property
    def stuck(self) -> bool:
        """Whether the server has not answered a request for a child for too long."""
        with self._lock:
            self._asked = [each for each in self._asked if each[2].unborn]
            if not self._asked:
                return False
            now, starved = time.monotonic(), waited(self.pid)
            # A server that was stopped during its preparation sends no message.
            patience = PATIENCE if self.ready or is_stopped(self.pid) else FIRST_PATIENCE
            return any(
                now - max(since, self._heard_at) - (starved - before) > patience
                for since, before, _ in self._asked
            )

    def _end_if_stuck(self) -> None:
        """Ends a stuck server, so that every pending request for a child fails at once."""
        if self.stuck:
            self.stopped = is_stopped(self.pid)
            self.give_up()

    def fork(self, theirs: socket.socket) -> Forked:
        """Requests a child, which gets the end `theirs` of a socket. Raises OSError if the server has ended
        or does not read."""
        status, other = socket.socketpair()
        child = Forked(status, lambda: self.doing)
        try:
            with self._lock:
                self._wire.post(packed(Fork(Handle(theirs.fileno()), Handle(other.fileno()))), wait=False)
                self._asked.append((time.monotonic(), waited(self.pid), child))
        except OSError:
            child.close()
            raise
        finally:
            other.close()
        return child

    def give_up(self) -> None:
        """Ends the server only; its children continue."""
        self._ended = True
        self._process.kill()

    def close(self) -> None:
        """Ends the server and all its remaining children."""
        self._process.kill()
        self._listening.join()
        self._wire.close()
        os.close(self._life)


# ---------------------------------------------------------------- in the server's process


def serve(control: int, life: int, worker: str) -> NoReturn:
    """Runs in the server's process: imports all modules, then forks on request until the page ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the page handles Ctrl-C
    end_with(life, group=True)
    wire = Wire(socket.socket(fileno=control))
    module = import_module(worker)
    module.warm(lambda sentence: wire.send(Preparing(sentence)))
    # Children share the present memory as long as no process writes to it. Therefore the garbage collector
    # must not touch this memory.
    gc.collect()
    gc.freeze()
    gc.disable()
    wire.send(ForkReady())
    _Nest(wire, module.main).run()


class _Nest:
    def __init__(self, wire: Wire, entry: Callable[[Wire], None]) -> None:
        self._wire, self._entry = wire, entry
        self._children: dict[int, socket.socket] = {}
        self._woken, wake = socket.socketpair()
        self._woken.setblocking(False)
        wake.setblocking(False)
        self._wake = wake
        signal.signal(signal.SIGCHLD, lambda *_: None)
        signal.set_wakeup_fd(wake.fileno(), warn_on_full_buffer=False)

    def run(self) -> NoReturn:
        watched = select.poll()
        watched.register(self._wire, select.POLLIN)
        watched.register(self._woken, select.POLLIN)
        while True:
            watched.poll()
            with contextlib.suppress(BlockingIOError):
                self._woken.recv(4096)
            self._reap()
            if self._wire.poll():
                try:
                    request: Fork = self._wire.recv()
                except (EOFError, OSError):
                    self._end()
                self._fork(socket.socket(fileno=request.wire.number), request.status.number)

    def _fork(self, theirs: socket.socket, status: int) -> None:
        if threads() != 1:
            # A lock that another thread holds at this moment would stay locked in the child forever.
            print("himpc-lab: a second thread runs in the fork server, which ends now", file=sys.stderr)
            self._end()
        report = socket.socket(fileno=status)
        try:
            pid = os.fork()
        except OSError:  # a limit is reached; the page hears the end of both sockets
            theirs.close()
            report.close()
            return
        if pid == 0:
            self._be_a_child(theirs, report)
        theirs.close()
        self._children[pid] = report
        _tell(report, pid)

    def _be_a_child(self, theirs: socket.socket, report: socket.socket) -> NoReturn:
        code = 1
        try:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            for each in (self._woken, self._wake, report, *self._children.values()):
                each.close()
            self._wire.close()
            gc.enable()
            self._entry(Wire(theirs))
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            with contextlib.suppress(Exception):
                sys.stdout.flush()
                sys.stderr.flush()
            os._exit(code)

    def _reap(self) -> None:
        while self._children:
            pid, status = os.waitpid(-1, os.WNOHANG)
            if pid == 0:
                return
            report = self._children.pop(pid, None)
            if report is not None:
                _tell(report, os.waitstatus_to_exitcode(status))
                report.close()

    def _end(self) -> NoReturn:
        for pid in self._children:
            os.kill(pid, signal.SIGKILL)
        os._exit(0)


def _tell(report: socket.socket, number: int) -> None:
    with contextlib.suppress(OSError):  # the page has closed this child's handle
        report.sendall(number.to_bytes(8, "big", signed=True))
