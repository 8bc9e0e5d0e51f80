"""The processes of a submission.

`serve` runs in a process that imports everything that a solution may need, but no code that simulates or
grades a robot, and nothing of the submission. For every run of the robot it makes a copy of itself. The copy
restricts itself, executes the submission, receives the numbers of `now` and answers with torques. The plant,
the checks and the right answers are in another process, which a submission cannot read, replace or end.
"""

from __future__ import annotations

import ctypes.util  # noqa: F401  # loaded now, because it will be refused later
import json
import os
import signal
import socket
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

import himpc.qp  # noqa: F401  # the only module of the lab that a solution may import
from lessons.exercises.inside import wire
from lessons.exercises.inside.confine import confine, ends_with, hide_the_lab, limited, readable, refuse
from lessons.exercises.inside.now import Ask, Now, rebuilt
from lessons.own.files import Source, execute, sentence
from lessons.own.kinds import law_of, line_of
from robots import InputError

Law = Callable[[Any], Any]
ROOT = str(Path(__file__).parents[3])
"""The folder of the lab; the parent process puts this folder first in `sys.path`."""
_SLOW = ("scipy.linalg", "scipy.optimize")
"""Modules that are imported once and not in every copy, if the text of a submission names their package."""


def serve(parent: int, memory: int, kernel: bool) -> NoReturn:
    """Makes a copy of this process for every run that the lab asks for, until the lab closes the socket,
    which is standard input.

    Args:
        parent: id of the parent process; this process ends when its parent ends.
        memory: largest address space of this process and of each copy, bytes.
        kernel: whether to use the mechanisms of the operating system besides Python's.
    """
    calls = socket.socket(fileno=os.dup(0))
    nowhere = os.open(os.devnull, os.O_RDWR)
    for number in range(3):
        os.dup2(nowhere, number)
    os.close(nowhere)
    ends_with(parent)
    limited(memory)
    sys.path.remove(ROOT)
    sys.dont_write_bytecode = True
    source = Source(*json.loads(wire.read(calls.fileno())[1]))
    np.linalg.inv(np.eye(2))  # libraries load parts of themselves at the first use
    for name in _SLOW:
        if name.partition(".")[0] in source.text:
            with suppress(ImportError):
                import_module(name)
    hide_the_lab()
    paths = readable()
    further = confine(paths) if kernel else tuple
    calls.sendall(wire.packed(wire.READY, b""))
    while True:
        _, pipes, *_ = socket.recv_fds(calls, 1, 3)
        if not pipes:
            os._exit(0)
        lab = os.getpid()
        child = os.fork()
        if child == 0:
            calls.close()
            ends_with(lab)
            _run(source, paths, further, *pipes)
        for pipe in pipes:
            os.close(pipe)
        calls.sendall(wire.packed(wire.READY, wire.of_json(child)))
        calls.recv(1)
        os.kill(child, signal.SIGKILL)
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        calls.sendall(wire.packed(wire.READY, wire.of_json(code)))


def _run(
    source: Source,
    paths: Sequence[Path],
    further: Callable[[], tuple[str, ...]],
    requests: int,
    replies: int,
    refused: int,
) -> NoReturn:
    """Executes a submission and answers ticks until the pipe closes.

    Args:
        source: the submission.
        paths: paths that imports may read.
        further: the result of `confine`.
        requests, replies: pipes from and to the lab.
        refused: pipe to the lab for the name of a refused call, see `refuse`.
    """
    try:
        in_force = further()
        refuse(paths, refused)
        wire.write(replies, wire.READY, wire.of_json(in_force))
        _answer_ticks(source, requests, replies)
    finally:
        os._exit(0)


def _answer_ticks(source: Source, requests: int, replies: int) -> NoReturn:
    """Raises EOFError when the lab closes the pipe."""
    law: Law = _nothing
    shape: Any = None

    def ask(name: str, level: int, arguments: list[Any]) -> Any:
        lists = [argument.tolist() for argument in arguments]
        wire.write(replies, wire.ASK, wire.of_json([name, level, lists]))
        kind, data = wire.read(requests)
        if kind != wire.REPLY:
            raise ValueError(data.decode())
        return wire.array_of(data)

    def loaded() -> tuple[bytes, bytes]:
        nonlocal law
        module = execute(source)
        law = law_of(module)()
        return wire.READY, wire.of_json([str(vars(module).get("EXERCISE", "")), line_of(module)])

    def say(work: Callable[[], tuple[bytes, bytes]]) -> None:
        try:
            answer = work()
        except InputError as error:
            answer = wire.FAULT, str(error).encode(errors="replace")
        except BaseException as error:
            answer = wire.FAULT, sentence(source.path, error).encode(errors="replace")
        wire.write(replies, *answer)

    say(loaded)
    while True:
        kind, data = wire.read(requests)
        if kind == wire.SHAPE:
            shape = json.loads(data)
        else:
            say(partial(_torque, law, shape, data, ask))


def _torque(law: Law, shape: Any, data: bytes, ask: Ask) -> tuple[bytes, bytes]:
    torque = law(rebuilt(shape, data, ask))
    try:
        array = np.array("" if torque is None else torque, float)
        if array.ndim <= 2 and array.size <= 10_000:
            return wire.TORQUE, wire.of_array(array)
        return wire.OTHER, f"an array of shape {array.shape}".encode()
    except (TypeError, ValueError):
        return wire.OTHER, ("nothing" if torque is None else f"a {type(torque).__name__}").encode()


def _nothing(_: Now) -> None:
    """The control law until a file is loaded."""
