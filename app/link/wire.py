"""Whole messages over a socket between two processes of one machine, open files among them."""

from __future__ import annotations

import io
import os
import pickle
import select
import socket
import struct
from dataclasses import dataclass
from typing import Any

_HEAD = struct.Struct("!QB")  # bytes that follow, open files that come along
_MOST_FILES = 8


@dataclass(frozen=True)
class Handle:
    """An open file, by its number in this process. In a message it arrives as a file of the receiver's own,
    who closes it."""

    number: int


@dataclass(frozen=True, eq=False)
class Parcel:
    """A message as it is sent."""

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
    """A message ready to be sent: what it says cannot change any more."""
    target, files = io.BytesIO(), list[int]()
    _Pickler(target, files).dump(message)
    return Parcel(target.getvalue(), tuple(files))


class Wire:
    """One end of a socket. One thread may send and one other may receive."""

    def __init__(self, end: socket.socket) -> None:
        self._end = end
        self._poll = select.poll()
        self._poll.register(end, select.POLLIN)

    def fileno(self) -> int:
        return self._end.fileno()

    def send(self, message: object) -> None:
        """Waits while the other end does not read. Raises OSError if there is no other end."""
        self.post(packed(message))

    def post(self, parcel: Parcel, wait: bool = True) -> None:
        """As `send`. Without `wait`, for small messages only, raises BlockingIOError when nobody reads."""
        head = _HEAD.pack(len(parcel.content), len(parcel.files))
        flags = 0 if wait else socket.MSG_DONTWAIT
        if parcel.files:
            # Files travel with the first byte.
            sent = socket.send_fds(self._end, [head, parcel.content], list(parcel.files), flags)
        else:
            sent = self._end.sendmsg([head, parcel.content], [], flags)
        if sent < len(head) + len(parcel.content):
            self._end.sendall((head + parcel.content)[sent:])

    def poll(self, timeout: float | None = 0.0) -> bool:
        """Whether a message, or the end, can be received within so many seconds; None: wait for it."""
        return bool(self._poll.poll(None if timeout is None else 1e3 * timeout))

    def recv(self) -> Any:
        """The next message; waits for it. Raises EOFError or OSError if there is no other end."""
        head, files = self._head()
        try:
            size, count = _HEAD.unpack(head)
            if count != len(files):
                raise OSError(f"{len(files)} of {count} open files arrived: this process may open no more")
            content = bytearray(size)
            self._fill(memoryview(content))
            return _Unpickler(io.BytesIO(content), files).load()
        except BaseException:
            for number in files:
                os.close(number)
            raise

    def _head(self) -> tuple[bytes, list[int]]:
        if not hasattr(socket, "recv_fds"):  # Windows
            head = bytearray(_HEAD.size)
            self._fill(memoryview(head))
            return bytes(head), []
        head, files, _, _ = socket.recv_fds(self._end, _HEAD.size, _MOST_FILES)
        rest = bytearray(_HEAD.size - len(head))
        if not head:
            raise EOFError
        self._fill(memoryview(rest))
        return head + rest, files

    def _fill(self, view: memoryview) -> None:
        while view:
            count = self._end.recv_into(view)
            if not count:
                raise EOFError
            view = view[count:]

    def hang_up(self) -> None:
        """Wakes whoever sends or receives here, and tells the other end that this was all."""
        try:
            self._end.shutdown(socket.SHUT_RDWR)
        except OSError:
            return

    def close(self) -> None:
        self._end.close()
