"""The fork server of `multiprocessing`: it imports and rehearses everything once, and each simulation is
forked from it, so that it starts at once and shares the server's memory.

A connection joins the server and this process: the server says what it is doing, and ends with this process.
Where processes cannot be forked, each simulation is a new interpreter instead.
"""

from __future__ import annotations

import contextlib
import gc
import multiprocessing as mp
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.machinery import ModuleSpec
from multiprocessing import forkserver, resource_tracker, spawn
from multiprocessing.connection import Client, Connection, Listener
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from typing import Any, final

from app.link.threads import on_thread
from robots.processes.environment import environment
from robots.processes.isolation import is_stopped, threads, waited
from robots.processes.orphans import end_with

PATIENCE = 3.0
"""Time, s, after which a server counts as stuck if it is ready but does not fork, or if it was stopped
(SIGSTOP). Time in which it waits for a core of a busy machine does not count."""
FIRST_PATIENCE = 120.0
"""Time without a message, s, after which a server that still imports and compiles counts as stuck."""
_LOOK = 0.25  # s between two checks whether the server is stuck
_LINE = "HIMPC_LAB_FORK_SERVER"  # the address of the line, in the server's environment
_PRELOADED = "app.link.preloaded"


@final
class ForkServer:
    """The fork server as the page's process sees it. `multiprocessing` has one, and so each process has one.

    Attributes:
        worker: name of the module that the server prepares; its function `warm(say)` loads everything that a
            simulation needs and may report its progress with `say`.
        pid: process id; None if there is no server, or before its first message.
        ready: whether the present or the last server could fork.
        doing: a sentence about its work before it can fork.
    """

    def __init__(self) -> None:
        self.worker = ""
        self.pid: int | None = None
        self.ready = False
        self.doing = ""
        self._last: int | None = None  # the last process id
        self._forks = sys.platform == "linux"  # other systems have libraries that fail after a fork
        self._stopped = False  # whether the last server was ended because it had been stopped (SIGSTOP)
        self._users = 0
        self._path = os.environ.get("PYTHONPATH")
        self._heard_at = 0.0
        self._waiting: list[tuple[float, float]] = []  # (time, time waited for a core) of each request
        self._lock = threading.Lock()
        self._listener: Listener | None = None

    def enter(self, worker: str) -> None:
        """Says that processes of this worker will be started, until `leave` is called."""
        with self._lock:
            self._users += 1
            self.worker = self.worker or worker

    def leave(self) -> None:
        """Ends the server when all who called `enter` have left; its children continue."""
        with self._lock:
            self._users -= 1
            last = not self._users
        if last:
            self.end()

    def end(self) -> None:
        """Ends the server; its children continue. The next start makes another one."""
        with self._lock:
            self.worker, self._forks = "", sys.platform == "linux"
            self._kill()

    def start(self, function: Callable[..., None], *args: object) -> BaseProcess:
        """Starts a process that calls `function(*args)`. Waits until the server is ready. If a server dies
        or hangs meanwhile, another one is made. Raises OSError if the system refuses a process."""
        for _ in range(2):
            if not self._forks:
                break
            with contextlib.suppress(OSError, EOFError), self._request():
                return _started(mp.get_context("forkserver"), function, args)
            with self._lock:
                self._forget_ended(0.5)
            # A server that failed before it was ready is not replaced: the next one would fail as well.
            self._forks = self.ready or self._stopped or not self.worker
        return _started(mp.get_context("spawn"), function, args)

    @contextlib.contextmanager
    def _request(self) -> Iterator[None]:
        with self._lock:
            self._ensure_running()
            request = (time.monotonic(), 0.0 if self.pid is None else waited(self.pid))
            self._waiting.append(request)
        try:
            yield
        finally:
            with self._lock:
                self._waiting.remove(request)

    def _ensure_running(self) -> None:
        if self._listener is None:
            self._listener = Listener(family="AF_UNIX")
            on_thread("fork servers", self._accept_on_thread, self._listener)
        if self.pid is not None:
            return
        self._forget_ended(5.0)
        path = os.pathsep.join(filter(None, sys.path))
        forkserver.set_forkserver_preload([_PRELOADED])
        resource_tracker.ensure_running()  # otherwise the next call starts it, and lets Ctrl-C through
        with environment({_LINE: str(self._listener.address), "PYTHONPATH": path}):
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                forkserver.ensure_running()
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def _kill(self) -> None:
        pid = self.pid
        if pid is not None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
            self._forget_ended(5.0)

    def _forget_ended(self, seconds: float) -> None:
        """Waits, at most for some seconds, until a server that is about to end has ended, and forgets it. Its
        line may end earlier or later. `multiprocessing` would replace a server that it finds dead afterwards,
        without the address of the line."""
        if _has_ended(self._last, seconds) and self.pid == self._last:
            self.pid = None

    # ---------------------------------------------------------------- the line to the server

    def _accept_on_thread(self, listener: Listener) -> None:
        while True:
            with contextlib.suppress(OSError, EOFError):  # a server that has ended at once
                on_thread("fork server", self._hear_on_thread, listener.accept())

    def _hear_on_thread(self, line: Connection) -> None:
        pid = None
        with contextlib.suppress(OSError, EOFError), line:
            data = spawn.get_preparation_data("")
            main = data.get("init_main_from_name"), data.get("init_main_from_path")
            line.send((self.worker, main, self._path))
            pid = self._last = line.recv()
            self.ready, self.doing, self._stopped = False, "", False
            self.pid, self._heard_at = pid, time.monotonic()
            while True:
                if not line.poll(_LOOK):
                    self._end_if_stuck()
                    continue
                self.doing = line.recv()
                self.ready = not self.doing
                self._heard_at = time.monotonic()
        if self.pid == pid:
            self.pid = None

    def _end_if_stuck(self) -> None:
        """Ends a stuck server, so that every start that waits for it fails at once."""
        with self._lock:
            pid = self.pid
            if pid is None or not self._waiting:
                return
            now, starved, stopped = time.monotonic(), waited(pid), is_stopped(pid)
            patience = PATIENCE if self.ready or stopped else FIRST_PATIENCE
            if any(
                now - max(since, self._heard_at) - (starved - before) > patience
                for since, before in self._waiting
            ):
                self._stopped = stopped
                self._kill()


SERVER = ForkServer()
"""The fork server of this process."""


def _started(context: BaseContext, function: Callable[..., None], args: tuple[object, ...]) -> BaseProcess:
    child: BaseProcess = context.Process(target=function, args=args, daemon=True)  # pyright: ignore
    child.start()
    return child


def _has_ended(pid: int | None, seconds: float) -> bool:
    """Waits, at most for some seconds, until a child has ended; returns whether it has."""
    for _ in range(round(seconds / 0.01)):
        try:
            if pid is None or os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT | os.WNOHANG) is not None:
                return True
        except ChildProcessError:
            return True
        time.sleep(0.01)
    return False


# ---------------------------------------------------------------- in the server's process

_line: Any = None


def prepare() -> None:
    """Runs in the server's process before all else: loads what the page's worker needs."""
    global _line
    address = os.environ.pop(_LINE)  # absent if `multiprocessing` has replaced a server by itself: it ends
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the page handles Ctrl-C
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    try:
        _line = line = Client(address)
        worker, main, path = line.recv()
    except (OSError, EOFError):
        os._exit(0)  # the page has ended already
    if not worker:
        os._exit(0)  # nobody needs this server any more
    if path is None:
        del os.environ["PYTHONPATH"]  # the page's, see `_ensure_running`
    else:
        os.environ["PYTHONPATH"] = path
    # The page writes nothing any more, and so the line becomes readable only when the page has ended. The
    # server and its children are one group, which ends then.
    os.setpgid(0, 0)
    end_with(line.fileno(), group=True)
    line.send(os.getpid())
    _be_main(*main)
    try:
        import_module(worker).warm(line.send)
    except ImportError as error:  # the server would ignore it, and each child would be slow
        raise RuntimeError(f"{worker} cannot be imported") from error
    if threads() != 1:
        # A lock that another thread holds at a fork would stay locked in the child for ever.
        raise RuntimeError("himpc-lab: a second thread runs in the fork server")
    # Children share the present memory as long as no process writes to it. Therefore the garbage collector
    # must not touch this memory.
    gc.collect()
    gc.freeze()
    line.send("")


def _be_main(name: str | None, file: str | None) -> None:
    """Names the page's main module as that of this process. Children would otherwise run it once more, and a
    user's program may have no `if __name__ == "__main__"`."""
    own = sys.modules["__main__"]
    own.__file__ = file
    own.__spec__ = None if name is None else ModuleSpec(name, None)


def hang_up() -> None:
    """Closes the line in a child of the server. It belongs to the server alone."""
    global _line
    if _line is not None:
        _line.close()
        _line = None
