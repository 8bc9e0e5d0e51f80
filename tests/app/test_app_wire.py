"""Messages between the page and its processes, over a socket."""

from __future__ import annotations

import os
import socket
from concurrent.futures import ThreadPoolExecutor

import pytest

from app.link.wire import Handle, Wire, packed


def test_a_message_brings_open_files_along() -> None:
    ours, theirs = map(Wire, socket.socketpair())
    end, start = os.pipe()
    ours.send({"start": Handle(start)})
    ours.send("next")
    came = theirs.recv()["start"].number
    os.write(came, b"!")
    assert came != start and os.read(end, 1) == b"!" and theirs.recv() == "next"
    for number in (came, start, end):
        os.close(number)
    ours.close()
    with pytest.raises(EOFError):
        theirs.recv()
    theirs.close()


def test_files_are_closed_if_the_connection_ends_inside_a_message() -> None:
    """The head of a message has nine bytes; the files come with the first one."""
    for sent in (b"\0", b"\0" * 8, b"\0" * 8 + b"\1", b"\0" * 7 + b"\5\1abc"):
        ours, theirs = socket.socketpair()
        end, start = os.pipe()
        socket.send_fds(ours, [sent], [start])
        os.close(start)
        ours.close()
        with pytest.raises(EOFError if sent != b"\0" * 8 + b"\1" else Exception):
            Wire(theirs).recv()
        assert os.read(end, 1) == b"", "nobody has the other end of the pipe any more"
        os.close(end)
        theirs.close()


def test_a_message_with_files_does_not_wait_for_who_does_not_read() -> None:
    """If the message waited, a page would block while its fork server is stopped."""
    ours, theirs = map(Wire, socket.socketpair())
    request = packed(Handle(theirs.fileno()))

    def fill() -> int:
        for count in range(10_000):
            try:
                ours.post(request, wait=False)
            except BlockingIOError:
                return count
        return 10_000

    with ThreadPoolExecutor(1) as page:
        filled = page.submit(fill)
        try:
            assert 50 < filled.result(10.0) < 10_000
        finally:
            ours.hang_up()
            theirs.close()
