"""Starts a process for every run of a submission, as a copy of a process that has not executed it, and
measures the time in which it computes or sleeps until it answers."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
import uuid
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, final

from lessons.exercises.inside import wire
from lessons.exercises.inside.serve import ROOT
from lessons.own.files import Source
from robots.processes.family import end_family, spent
from robots.processes.isolation import PATIENCE

LOOK = 0.1
"""Time between two checks of a process that has not answered, s."""


@final
class ProcessDeadline:
    """The deadline of one answer of a process. The time in which the process waits for a core of a busy
    machine does not count. Including this time, the answer may take `PATIENCE` times as long.

    Attributes:
        seconds: time that the answer may take, s.
        what: the activity, as the beginning of an error message.
        began: time at which the request was sent.
        slept: time, s, in which the process neither computed nor waited for a core, up to the last check.
    """

    def __init__(self, pid: int, seconds: float, what: str) -> None:
        self.seconds, self.what, self.began = seconds, what, time.monotonic()
        self._pid, self.slept = pid, 0.0
        self._last: float | None = None
        self._computed = 0.0

    @property
    def passed(self) -> float:
        """Time since the request, s."""
        return time.monotonic() - self.began

    def over(self) -> bool:
        """Returns whether the answer has taken too long. Call this every tenth of a second."""
        now = time.monotonic()
        computed, asleep = spent(self._pid)
        if self._last is None:
            self._last, self._computed = now, computed
        elif asleep:
            self.slept += now - self._last
        self._last = now
        own = computed - self._computed + self.slept
        return own > self.seconds or self.passed > PATIENCE * self.seconds


STARTING = 60.0
"""Largest time for the start of a process, s, on a machine with a free core."""
_MARK = "HIMPC_LAB_SUBMISSION"
_BOOT = (
    "import sys; sys.path.insert(0, sys.argv[1]); from lessons.exercises.inside.serve import serve; "
    "serve(int(sys.argv[2]), int(sys.argv[3]), sys.argv[4] == 'kernel')"
)


@dataclass(frozen=True)
class Copy:
    """A process that executes a submission.

    Attributes:
        pid: its process id, which is valid until `Original.end`.
        to, of: pipes to and from the process, which do not block this side.
        refused: pipe into which the process writes the name of a refused call.
    """

    pid: int
    to: int
    of: int
    refused: int


@final
class Original:
    """The process that is copied. It has imported what a submission may need, and executes nothing of it."""

    def __init__(self, source: Source, memory: int, kernel: bool) -> None:
        """Starts the process. memory: largest memory of a copy, bytes; kernel: whether to use the mechanisms
        of the operating system besides Python's. Raises OSError."""
        keep = ("PATH", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "SYSTEMROOT", "LANG", "LC_ALL")
        self._mark = uuid.uuid4().hex
        environment = {
            **{name: os.environ[name] for name in keep if name in os.environ},
            _MARK: self._mark,
            "OPENBLAS_NUM_THREADS": "1",
            "OMP_NUM_THREADS": "1",
        }
        limits = (str(os.getpid()), str(memory), "kernel" if kernel else "python")
        self._calls, theirs = socket.socketpair()
        self._calls.settimeout(PATIENCE * STARTING)
        with theirs:
            self._process = subprocess.Popen(
                (sys.executable, "-I", "-c", _BOOT, ROOT, *limits),
                stdin=theirs.fileno(),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                env=environment,
                cwd=os.path.abspath(os.sep),
                start_new_session=True,
            )
        try:
            self._calls.sendall(wire.packed(wire.LOAD, wire.of_json([source.path, source.text])))
            self._answer()
        except OSError:
            self.close()
            raise

    def _answer(self) -> Any:
        header = self._calls.recv(wire.HEADER.size, socket.MSG_WAITALL)
        if len(header) < wire.HEADER.size:
            raise OSError("the process has ended")
        length = wire.HEADER.unpack(header)[1]
        return json.loads(self._calls.recv(length, socket.MSG_WAITALL)) if length else None

    def copy(self) -> Copy:
        """Starts a copy. Raises OSError."""
        (requests, to), (of, replies), (refused, refuses) = [os.pipe() for _ in range(3)]
        try:
            socket.send_fds(self._calls, [wire.READY], [requests, replies, refuses])
            pid = self._answer()
        except OSError:
            for pipe in (to, of, refused):
                os.close(pipe)
            raise
        finally:
            for pipe in (requests, replies, refuses):
                os.close(pipe)
        for pipe in (to, of, refused):
            os.set_blocking(pipe, False)
        return Copy(pid, to, of, refused)

    def end(self, copy: Copy) -> tuple[int, str]:
        """Ends a copy. Returns its exit code, negative for a signal, and the refused call that it made; ""
        if there was none."""
        code = -9
        with suppress(OSError, ValueError):
            self._calls.sendall(wire.READY)
            code = int(self._answer())
        refused = b""
        with suppress(OSError):  # there is nothing to read
            refused = os.read(copy.refused, 200)
        for pipe in (copy.to, copy.of, copy.refused):
            os.close(pipe)
        return code, refused.decode(errors="replace")

    def close(self, alone: bool = False) -> None:
        """Ends the process and all processes that it or a copy started. alone: whether these cannot exist."""
        if alone:
            self._process.kill()
        else:
            end_family(self._process.pid, (_MARK, self._mark))
        self._calls.close()
        self._process.wait()
