"""Runs a submission in a separate process: sends it numbers and receives a torque, within deadlines."""

from __future__ import annotations

import json
import os
import select
import signal
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, final

import numpy as np

from himpc.controllers.answers import OwnFault
from himpc.controllers.view import View
from lessons.exercises.copies import LOOK, STARTING, Copy, Original, ProcessDeadline
from lessons.exercises.inside import wire
from lessons.exercises.inside.now import numbers_of, shape_of
from lessons.own.files import Source
from lessons.session.controllers import LONGEST_TICK
from robots import InputError
from robots.errors import shortened
from robots.processes.family import has_ended, memory_of, spent

LOADING = 10.0
"""Largest time for loading the file, s, without the start of the process."""


class Exhausted(Exception):
    """A submission has exceeded the time or memory allowed for grading it; the message is one sentence."""


class Refused(Exception):
    """A submission has made a call that it may not make; the message is one sentence."""


@final
class Apart:
    """A submission that runs in processes which contain no data of the lab: every run of the robot has a new
    process, so that nothing remains of earlier runs. Use it in a `with` statement.

    Attributes:
        protection: mechanisms of the operating system that block access to files, the network and other
            processes; () if only Python blocks it.
        exercise: the name that the file assigns to EXERCISE.
        line: number of the line at which the function that returns the torque begins.
    """

    def __init__(self, source: Source, seconds: float, memory: int, kernel: bool = True) -> None:
        """Starts a process and loads the file.

        Args:
            source: the file. Its text is sent to the process, which reads no files.
            seconds: largest total time, s, in which the processes may compute or sleep before they answer.
            memory: largest memory, bytes, of a process and all processes that it starts.
            kernel: whether to use the mechanisms of the operating system, see `protection`.

        Raises:
            InputError: the file cannot be loaded, or contains no controller.
        """
        self._source, self._seconds, self._memory, self._kernel = source, seconds, memory, kernel
        self._slept = self._before = 0.0
        self._original: Original | None = None
        self._copy: Copy | None = None
        self._waiting = False
        self._scheduling = _scheduling()
        self.protection: tuple[str, ...] = ()
        self.exercise, self.line = "", 1
        try:
            self.fresh()
        except (OwnFault, Exhausted, Refused) as fault:
            with suppress(Refused):
                self.close()
            raise InputError(str(fault)) from None

    def __enter__(self) -> Apart:
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(Refused):
            self.close()

    @property
    def where(self) -> str:
        """The file and the line, as the beginning of an error message."""
        return f"{self._source.path}, line {self.line}"

    @property
    def pid(self) -> int | None:
        """The id of the process that executes the file; None if no such process runs."""
        return None if self._copy is None else self._copy.pid

    def close(self) -> None:
        """Ends all processes. Raises Refused if the submission has made a refused call."""
        original = self._original
        try:
            self._end()
        finally:
            self._original = None
            if original is not None:
                original.close(alone="seccomp" in self.protection)

    def _end(self) -> int:
        """Ends the process that executes the file, and returns its exit code. Raises Refused."""
        copy, self._copy, original = self._copy, None, self._original
        if copy is None or original is None:
            return 0
        self._before += spent(copy.pid)[0]
        code, refused = original.end(copy)
        if "seccomp" not in self.protection:  # other processes may exist, which would remember this run
            self._original = None
            original.close()
        if code == -signal.SIGSYS:
            refused = refused or "a system call that a computation does not need"
        if _scheduling() != self._scheduling:
            _set_scheduling(*self._scheduling)
            refused = refused or "changing the scheduling of the grader"
        if refused:
            raise Refused(f"{self._source.path}: a submission may not do that ({refused}): leave that out")
        return code

    def fresh(self) -> Callable[[View], Any]:
        """Returns the control law of the file, loaded in a process without memory of earlier runs. Raises
        OwnFault, Exhausted and Refused."""
        if self._copy is None or self._waiting:
            self._end()
            self._start()
            self._waiting = False
        return self.torque

    def _start(self) -> None:
        """Starts a process that loads the file."""
        self._heard, self._marks = b"", []
        try:
            self._original = self._original or Original(self._source, self._memory, self._kernel)
            copy = self._original.copy()
        except OSError as error:
            raise OwnFault(f"{self._source.path}: its process cannot be started ({error})") from None
        self._copy, self._in, self._out = copy, copy.to, copy.of
        self._in_poll, self._out_poll = select.poll(), select.poll()
        self._in_poll.register(self._in, select.POLLOUT)
        self._out_poll.register(self._out, select.POLLIN)
        self._looked = time.monotonic()
        kind, data = self._answered(b"", ProcessDeadline(copy.pid, STARTING, "starting its process"))
        if kind != wire.READY:
            raise self._nonsense()
        self.protection = tuple(json.loads(data))  # sent before the process runs the file
        kind, data = self._answered(b"", ProcessDeadline(copy.pid, LOADING, "loading it"))
        if kind != wire.READY:
            raise self._fault(kind, data)
        try:
            exercise, line = json.loads(data)
            self.exercise, self.line = str(exercise), int(line)
        except (ValueError, TypeError):
            raise self._nonsense() from None

    # ---------------------------------------------------------------- one message and its answer

    def torque(self, now: View) -> Any:
        """Returns the torque of the control law for a tick. Raises OwnFault with a message of one sentence if
        the call fails, takes too long, or the process has ended."""
        if self._copy is None:
            raise OwnFault(f"{self._source.path}: its process has ended")
        self._waiting = True
        message, arrays = b"", numbers_of(now)
        marks = [now.T_s, now.N, now.bounds.approach, now.bounds.paper, len(now.further)]
        marks += [mark for level in now.levels for mark in (level.name, level.horizon)]
        marks += [now.near.names, now.near.reaction, now.near.deceleration]
        marks += [array.shape for array in arrays]
        if marks != self._marks:
            message, self._marks = wire.packed(wire.SHAPE, wire.of_json(shape_of(now))), marks
        message += wire.packed(wire.TICK, b"".join([array.tobytes() for array in arrays]))
        watch = ProcessDeadline(self._copy.pid, LONGEST_TICK, "one call")
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
            arrays = [np.array(argument, float) for argument in arguments]
            knots = name == "jacobian" and arrays[0].shape == (now.N, now.n)  # at all knots at once
            arrays = arrays if knots else [array.reshape(now.n) for array in arrays]
            functions: Mapping[str, Any] = {
                "jacobian": now.levels[int(level)].jacobian,
                "mass_matrix": now.nominal.mass_matrix,
                "bias": now.nominal.bias,
            }
            result = np.asarray(functions[name](*arrays), float)
        except Exception as error:
            text = f"this cannot be computed ({type(error).__name__}: {shortened(str(error), 100)})"
            return wire.packed(wire.FAULT, text.encode())
        return wire.packed(wire.REPLY, wire.of_array(result))

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
            self._end()
            raise OwnFault(f"{self._source.path}: {watch.what} takes longer than {watch.seconds:g} s")
        self._slept += watch.slept - slept
        self._account()

    def _account(self) -> None:
        """Ends the process in two cases. Raises Exhausted if all answers together took too long, and OwnFault
        if the process and the processes that it started use too much memory."""
        copy = self._copy
        assert copy is not None
        if self._before + self._slept + spent(copy.pid)[0] > self._seconds:
            self._end()
            raise Exhausted(f"{self._source.path}: grading it takes longer than {self._seconds:g} s")
        if "seccomp" not in self.protection and memory_of(copy.pid) > self._memory:
            self._end()
            raise OwnFault(f"{self._source.path}: it needs more memory than {self._memory / 1e9:g} GB")

    # ---------------------------------------------------------------- sentences about faults

    def _gone(self) -> OwnFault:
        copy = self._copy
        assert copy is not None
        ended = has_ended(copy.pid, 1.0)
        code = self._end()
        if not ended:
            return OwnFault(f"{self._source.path}: it closes the pipe for its answers: leave that out")
        how = f"signal {-code}" if code < 0 else f"exit code {code}"
        return OwnFault(f"{self._source.path}: it ends its own process ({how}): leave that out")

    def _nonsense(self) -> OwnFault:
        self._end()
        return OwnFault(f"{self._source.path}: it writes into the pipe for its answers: leave that out")

    def _fault(self, kind: bytes, data: bytes, n: int = 0) -> OwnFault:
        text = shortened(" ".join(data.decode(errors="replace").split()), 1000)
        if kind == wire.OTHER and n:
            return OwnFault(
                f"{self.where}: it returned {text} instead of numbers: return a torque of shape ({n},)"
            )
        return OwnFault(text) if kind == wire.FAULT else self._nonsense()


def _scheduling() -> tuple[Any, ...]:
    """Returns the processors, the policy and the priority of this process (Linux), which a submission must
    not change."""
    if not hasattr(os, "sched_getscheduler"):
        return ()
    return os.sched_getaffinity(0), os.sched_getscheduler(0), os.sched_getparam(0)


def _set_scheduling(processors: set[int], policy: int, priority: os.sched_param) -> None:
    with suppress(OSError):
        os.sched_setaffinity(0, processors)
        os.sched_setscheduler(0, policy, priority)
