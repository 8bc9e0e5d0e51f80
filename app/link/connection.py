"""Messages between two processes over a `Connection`. A report that names shared memory brings the open file
along."""

from __future__ import annotations

import socket
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import Any

from app.link.messages import Ready


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
