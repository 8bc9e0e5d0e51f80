"""Runs a submission in a separate process: sends it numbers and receives a torque, within deadlines."""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, final

import numpy as np

from himpc.controllers.answers import OwnFault
from himpc.controllers.view import View
from lessons.exercises.inside import wire
from lessons.exercises.inside.now import numbers_of, shape_of
from lessons.exercises.inside.serve import ROOT
from lessons.exercises.watch import LOOK, ProcessDeadline
from lessons.own.files import Source
from lessons.session.controllers import LONGEST_TICK
from robots import InputError
from robots.errors import shortened
from robots.processes.family import end_family, has_ended, memory_of, spent

LOADING = 10.0
"""Largest time for loading the file, s, without the start of the process."""
STARTING = 60.0
"""Largest time for the start of the process, s."""
_MARK = "HIMPC_LAB_SUBMISSION"
_BOOT = (
    "import sys; sys.path.insert(0, sys.argv[1]); from lessons.exercises.inside.serve import serve; "
    "serve(int(sys.argv[2]), int(sys.argv[3]), sys.argv[4] == 'kernel')"
)


class Exhausted(Exception):
    """A submission has exceeded the time or memory allowed for grading it; the message is one sentence."""


@final
class Apart:
    """A process that runs a submission and contains no data of the lab. Use it in a `with` statement.

    Attributes:
        protection: mechanisms of the operating system that block access to files, the network and other
            processes; () if only Python blocks it.
        exercise: the name that the file assigns to EXERCISE.
        line: number of the line at which the function that returns the torque begins.
    """

    def __init__(self, source: Source, seconds: float, memory: int, kernel: bool = True) -> None:
        """Starts the process and loads the file.

        Args:
            source: the file. Its text is sent to the process, which reads no files.
            seconds: largest total time, s, in which the process may compute or sleep before it answers.
            memory: largest memory, bytes, of the process and all processes that it starts.
            kernel: whether to use the mechanisms of the operating system, see `protection`.

        Raises:
            InputError: the file cannot be loaded, or contains no controller.
        """
        self._source, self._seconds, self._memory, self._kernel = source, seconds, memory, kernel
        self._slept = self._before = 0.0
        self._child: subprocess.Popen[bytes] | None = None
        self.protection: tuple[str, ...] = ()
        self.exercise, self.line = "", 1
        try:
            self.fresh()
        except (OwnFault, Exhausted) as fault:
            self.close()
            raise InputError(str(fault)) from None

    def __enter__(self) -> Apart:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def where(self) -> str:
        """The file and the line, as the beginning of an error message."""
        return f"{self._source.path}, line {self.line}"

    @property
    def pid(self) -> int | None:
        """The id of the process; None if no process runs."""
        return None if self._child is None else self._child.pid

    def close(self) -> None:
        """Ends the process and all processes that it started."""
        child, self._child = self._child, None
        if child is None:
            return
        self._before += spent(child.pid)[0]
        # Seccomp has prevented the process from starting other processes.
        if "seccomp" in self.protection:
            child.kill()
        else:
            end_family(child.pid, (_MARK, self._mark))
        for pipe in (child.stdin, child.stdout):
            with suppress(OSError):
                if pipe is not None:
                    pipe.close()
        child.wait()

    def fresh(self) -> Callable[[View], Any]:
        """Loads the file again and returns its control law. Raises OwnFault."""
        if self._child is None:
            self._start()
        kind, data = self._exchanged(wire.LOAD, b"", LOADING, "loading it")
        if kind != wire.READY:
            raise self._fault(kind, data)
        try:
            exercise, line = json.loads(data)
            self.exercise, self.line = str(exercise), int(line)
        except (ValueError, TypeError):
            raise self._nonsense() from None
        return self.torque

    def _start(self) -> None:
        self._mark, self._heard, self._marks = uuid.uuid4().hex, b"", []
        keep = ("PATH", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "SYSTEMROOT", "LANG", "LC_ALL")
        environment = {
            **{name: os.environ[name] for name in keep if name in os.environ},
            _MARK: self._mark,
            "OPENBLAS_NUM_THREADS": "1",
            "OMP_NUM_THREADS": "1",
        }
        limits = (str(os.getpid()), str(self._memory), "kernel" if self._kernel else "python")
        self._child = subprocess.Popen(
            (sys.executable, "-I", "-c", _BOOT, ROOT, *limits),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=environment,
            cwd=os.path.abspath(os.sep),
            start_new_session=True,
        )
        self._in, self._out = _pipes(self._child)
        self._in_poll, self._out_poll = select.poll(), select.poll()
        self._in_poll.register(self._in, select.POLLOUT)
        self._out_poll.register(self._out, select.POLLIN)
        self._looked = time.monotonic()
        text = wire.of_json([self._source.path, self._source.text])
        kind, data = self._exchanged(wire.LOAD, text, STARTING, "starting its process")
        if kind != wire.READY:
            raise self._nonsense()
        self.protection = tuple(json.loads(data))  # sent before the process runs the file

    # ---------------------------------------------------------------- one message and its answer

    def torque(self, now: View) -> Any:
        """Returns the torque of the control law for a tick. Raises OwnFault with a message of one sentence if
        the call fails, takes too long, or the process has ended."""
        if self._child is None:
            raise OwnFault(f"{self._source.path}: its process has ended")
        message, arrays = b"", numbers_of(now)
        marks = [now.T_s, now.N, now.bounds.approach, *(level.name for level in now.levels)]
        marks += [now.near.names, now.near.reaction, now.near.deceleration]
        marks += [each.shape for each in arrays]
        if marks != self._marks:
            message, self._marks = wire.packed(wire.SHAPE, wire.of_json(shape_of(now))), marks
        message += wire.packed(wire.TICK, b"".join([each.tobytes() for each in arrays]))
        watch = ProcessDeadline(self._child.pid, LONGEST_TICK, "one call")
        if watch.began - self._looked > LOOK:
            self._looked = watch.began
            self._account()
        while True:
            kind, data = self._answered(message, watch)
            if kind != wire.ASK:
                break
            if watch.passed > LOOK:
                self._look(watch)
            message = self._reply(now, data)
        if kind == wire.TORQUE:
            try:
                return wire.array_of(data)
            except (ValueError, IndexError):
                raise self._nonsense() from None
        raise self._fault(kind, data, now.n)

    def _reply(self, now: View, data: bytes) -> bytes:
        """Calls a function of the model for the submission, and returns the message with the result."""
        try:
            name, level, arguments = json.loads(data)
            given = [np.array(each, float).reshape(now.n) for each in arguments]
            functions: Mapping[str, Any] = {
                "jacobian": now.levels[int(level)].jacobian,
                "mass_matrix": now.nominal.mass_matrix,
                "bias": now.nominal.bias,
            }
            found = np.asarray(functions[name](*given), float)
        except Exception as error:
            said = f"this cannot be computed ({type(error).__name__}: {shortened(str(error), 100)})"
            return wire.packed(wire.FAULT, said.encode())
        return wire.packed(wire.REPLY, wire.of_array(found))

    def _exchanged(self, kind: bytes, data: bytes, seconds: float, what: str) -> tuple[bytes, bytes]:
        child = self._child
        assert child is not None
        return self._answered(wire.packed(kind, data), ProcessDeadline(child.pid, seconds, what))

    def _answered(self, message: bytes, watch: ProcessDeadline) -> tuple[bytes, bytes]:
        """Sends one message and returns the answer. If this takes too long, ends the process and raises
        OwnFault.
        """
        left = memoryview(message)
        while left:
            if self._in_poll.poll(1e3 * LOOK):
                try:
                    left = left[os.write(self._in, left) :]
                except OSError:
                    raise self._gone() from None
            else:
                self._look(watch)
        while True:
            if len(self._heard) >= wire.HEADER.size:
                kind, length = wire.HEADER.unpack_from(self._heard)
                if length > wire.LARGEST:
                    raise self._nonsense()
                end = wire.HEADER.size + length
                if len(self._heard) >= end:
                    data, self._heard = self._heard[wire.HEADER.size : end], self._heard[end:]
                    return kind, data
            if self._out_poll.poll(1e3 * LOOK):
                more = os.read(self._out, 1 << 16)
                if not more:
                    raise self._gone()
                self._heard += more
                if watch.passed < LOOK:
                    continue
            self._look(watch)

    def _look(self, watch: ProcessDeadline) -> None:
        """Ends the process and raises OwnFault if the process is too slow or needs too much memory."""
        slept = watch.slept
        if watch.over():
            self.close()
            raise OwnFault(f"{self._source.path}: {watch.what} takes longer than {watch.seconds:g} s")
        self._slept += watch.slept - slept
        self._account()

    def _account(self) -> None:
        """Ends the process in two cases. Raises Exhausted if all answers together took too long, and OwnFault
        if the process and the processes that it started use too much memory."""
        child = self._child
        assert child is not None
        if self._before + self._slept + spent(child.pid)[0] > self._seconds:
            self.close()
            raise Exhausted(f"{self._source.path}: grading it takes longer than {self._seconds:g} s")
        if "seccomp" not in self.protection and memory_of(child.pid) > self._memory:
            self.close()
            raise OwnFault(f"{self._source.path}: it needs more memory than {self._memory / 1e9:g} GB")

    # ---------------------------------------------------------------- sentences about faults

    def _gone(self) -> OwnFault:
        child = self._child
        assert child is not None
        ended = has_ended(child.pid, 1.0)
        self.close()
        code = child.returncode
        if not ended:
            return OwnFault(f"{self._source.path}: it closes the pipe for its answers: leave that out")
        how = f"signal {-code}" if code < 0 else f"exit code {code}"
        return OwnFault(f"{self._source.path}: it ends its own process ({how}): leave that out")

    def _nonsense(self) -> OwnFault:
        self.close()
        return OwnFault(f"{self._source.path}: it writes into the pipe for its answers: leave that out")

    def _fault(self, kind: bytes, data: bytes, n: int = 0) -> OwnFault:
        said = shortened(" ".join(data.decode(errors="replace").split()), 1000)
        if kind == wire.OTHER and n:
            return OwnFault(
                f"{self.where}: it returned {said} instead of numbers: return a torque of shape ({n},)"
            )
        return OwnFault(said) if kind == wire.FAULT else self._nonsense()


def _pipes(child: subprocess.Popen[bytes]) -> tuple[int, int]:
    """Returns the pipes to and from the process. Neither pipe blocks this side."""
    assert child.stdin is not None and child.stdout is not None
    for pipe in (child.stdin, child.stdout):
        os.set_blocking(pipe.fileno(), False)
    return child.stdin.fileno(), child.stdout.fileno()
