"""Provides simulation processes: from the fork server, or a spare process that is ready for the next
browser."""

from __future__ import annotations

import contextlib
import socket
import threading

from app.link.children import Child, spawned
from app.link.forkserver import ForkServer
from app.link.process import Process


class Spares:
    """Starts one child process in advance, for the next browser."""

    def __init__(self, worker: str, lent: ForkServer | None = None) -> None:
        """
        Args:
            worker: the module that a child runs, see `ForkServer`.
            lent: a fork server of this worker that is shared with other objects; its creator ends it.
        """
        self._worker = worker
        self._lent = lent
        self._lock = threading.Lock()
        self._server = lent
        self._given_up: list[ForkServer] = []
        self._forks = True
        self._spare: Process | None = None
        self._closed = False

    @property
    def server(self) -> ForkServer | None:
        """The present fork server; None if there is none."""
        return self._server

    def refill(self) -> None:
        """Starts a spare if there is none."""
        with self._lock:
            if not self._closed and (self._spare is None or not self._spare.alive):
                self._spare = self._make()

    def take(self) -> Process:
        """Returns the spare, or a new child."""
        with self._lock:
            spare, self._spare = self._spare, None
            return spare if spare is not None and spare.alive else self._make()

    def _make(self) -> Process:
        return Process(self._start, self._start_again, self._spawn)

    def _start_again(self, theirs: socket.socket) -> Child:
        """Starts another fork server and a child. Used if a fork server ended before its child had
        started."""
        with self._lock:
            return self._start(theirs)

    def _start(self, theirs: socket.socket) -> Child:
        self._mind_the_server()
        if self._server is not None:
            with contextlib.suppress(OSError):
                return self._server.fork(theirs)
        return self._spawn(theirs)

    def _mind_the_server(self) -> None:
        """Replaces a fork server that died or hangs. A server that was never ready is not replaced."""
        server = self._server
        if server is not None and (not server.alive or server.stuck):
            self._forks = server.ready or server.stopped
            server.give_up()
            self._given_up.append(server)
            self._server = None
        if self._server is None and self._forks and not self._closed:
            try:
                self._server = ForkServer(self._worker)
            except OSError:
                self._forks = False

    def _spawn(self, theirs: socket.socket) -> Child:
        return spawned(self._worker, theirs)

    def close(self) -> None:
        """Ends the spare. Also ends the fork server and all its remaining children, unless this server is
        lent."""
        with self._lock:
            self._closed = True
            spare, self._spare = self._spare, None
            servers, self._given_up = [*self._given_up, self._server], []
            self._server = None
        if spare is not None:
            spare.close()
        for server in servers:
            if server is not None and server is not self._lent:
                server.close()
