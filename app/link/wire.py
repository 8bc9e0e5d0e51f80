"""Sends whole messages, with open files, over a socket between two processes of one machine."""

from __future__ import annotations

import io
import os
import pickle
import select
import socket
import struct
from array import array
from dataclasses import dataclass
from typing import Any

_HEAD = struct.Struct("!QB")  # number of bytes and of open files that follow
_MOST_FILES = 8


@dataclass(frozen=True)
class Handle:
    """An open file, identified by its descriptor in this process. The receiver of a message gets another
    descriptor, which it must close."""

    number: int


@dataclass(frozen=True, eq=False)
class Parcel:
    """A serialised message."""

    content: bytes
    files: tuple[int, ...]


class _Pickler(pickle.Pickler):
    def __init__(self, target: io.BytesIO, files: list[int]) -> None:
        super().__init__(target, pickle.HIGHEST_PROTOCOL)
        self._files = files

    def persistent_id(self, obj: Any) -> int | None:
        if not isinstance(obj, Handle):
            return None
        self._files.append(obj.number)
        return len(self._files) - 1


class _Unpickler(pickle.Unpickler):
    def __init__(self, source: io.BytesIO, files: list[int]) -> None:
        super().__init__(source)
        self._files = files

    def persistent_load(self, pid: int) -> Handle:
        return Handle(self._files[pid])


def packed(message: object) -> Parcel:
    """Serialises a message. Later changes of the object do not change the message."""
    target, files = io.BytesIO(), list[int]()
    _Pickler(target, files).dump(message)
    return Parcel(target.getvalue(), tuple(files))


class Wire:
    """One end of a socket. One thread may send while another one receives."""

    def __init__(self, end: socket.socket) -> None:
        self._end = end
        self._poll = select.poll()
        self._poll.register(end, select.POLLIN)
        self._room = select.poll()
        self._room.register(end, select.POLLOUT)

    def fileno(self) -> int:
        return self._end.fileno()

    def send(self, message: object) -> None:
        """Sends a message; waits while the other end does not read. Raises OSError if the other end is
        closed."""
        self.post(packed(message))

    def post(self, parcel: Parcel, wait: bool = True) -> None:
        """As `send`, for a serialised message. If `wait` is False (for small messages only), raises
        BlockingIOError when the socket is full."""
        head = _HEAD.pack(len(parcel.content), len(parcel.files))
        flags = 0 if wait else socket.MSG_DONTWAIT
        # The files are sent with the first byte. `socket.send_fds` ignores its flags.
        rights = (socket.SOL_SOCKET, socket.SCM_RIGHTS, array("i", parcel.files))
        sent = self._end.sendmsg([head, parcel.content], [rights] if parcel.files else [], flags)
        if sent < len(head) + len(parcel.content):
            self._end.sendall((head + parcel.content)[sent:])

    def poll(self, timeout: float | None = 0.0) -> bool:
        """Returns whether a message, or the end of the connection, can be received within `timeout` seconds;
        None: no limit."""
        return bool(self._poll.poll(None if timeout is None else 1e3 * timeout))

    def takes(self) -> bool:
        """Returns whether a message of up to 50 kB can be sent without waiting, as most of the socket's
        buffer is free."""
        return bool(self._room.poll(0))

    def recv(self) -> Any:
        """Waits for the next message and returns it. Raises EOFError or OSError if the other end is
        closed."""
        head, files, _, _ = socket.recv_fds(self._end, _HEAD.size, _MOST_FILES)
        try:
            if not head:
                raise EOFError
            rest = bytearray(_HEAD.size - len(head))
            self._fill(memoryview(rest))
            size, count = _HEAD.unpack(head + rest)
            if count != len(files):
                raise OSError(f"{len(files)} of {count} open files arrived: this process cannot open more")
            content = bytearray(size)
            self._fill(memoryview(content))
            return _Unpickler(io.BytesIO(content), files).load()
        except BaseException:
            for number in files:
                os.close(number)
            raise

    def _fill(self, view: memoryview) -> None:
        while view:
            count = self._end.recv_into(view)
            if not count:
                raise EOFError
            view = view[count:]

    def hang_up(self) -> None:
        """Ends sending and receiving on both ends. Threads that wait there then continue."""
        try:
            self._end.shutdown(socket.SHUT_RDWR)
        except OSError:
            return

    def close(self) -> None:
        self._end.close()
