"""The process of a submission: it receives the numbers of `now` and answers with a torque.

It imports everything that a solution may need, but no code that simulates or grades a robot. The plant, the
checks and the right answers are in another process, which a submission cannot read, replace or end.
"""

from __future__ import annotations

import ctypes.util  # noqa: F401  # loaded now, because it will be refused later
import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import himpc.qp  # noqa: F401  # the only module of the lab that a solution may import
from lessons.exercises.inside import wire
from lessons.exercises.inside.confine import RefusedCalls, confine, hide_the_lab, limited, readable, refuse
from lessons.exercises.inside.now import Now, rebuilt
from lessons.own.files import Source, execute, sentence
from lessons.own.kinds import law_of, line_of
from robots import InputError

Law = Callable[[Any], Any]
ROOT = str(Path(__file__).parents[3])
"""The folder of the lab; the parent process puts this folder first in `sys.path`."""


def serve(parent: int, memory: int, kernel: bool) -> None:
    """Answers messages until the pipe closes.

    Args:
        parent: id of the parent process; this process ends when its parent ends.
        memory: largest address space of this process, bytes.
        kernel: whether to use the mechanisms of the operating system besides Python's.
    """
    heard, told = os.dup(0), os.dup(1)
    nowhere = os.open(os.devnull, os.O_RDWR)
    for number in range(3):
        os.dup2(nowhere, number)
    limited(memory, parent)
    sys.path.remove(ROOT)
    sys.dont_write_bytecode = True
    _, data = wire.read(heard)
    source = Source(*json.loads(data))
    refused = RefusedCalls()
    np.linalg.inv(np.eye(2))  # libraries load parts of themselves at the first use
    hide_the_lab()
    places = readable()
    in_force = confine(places) if kernel else ()
    refuse(places, refused)
    wire.write(told, wire.READY, wire.of_json(in_force))
    law: Law = _nothing
    shape: Any = None

    def ask(name: str, level: int, arguments: list[Any]) -> Any:
        lists = [each.tolist() for each in arguments]
        wire.write(told, wire.ASK, wire.of_json([name, level, lists]))
        kind, data = wire.read(heard)
        if kind != wire.REPLY:
            raise ValueError(data.decode())
        return wire.array_of(data)

    while True:
        try:
            kind, data = wire.read(heard)
        except EOFError:
            os._exit(0)
        if kind == wire.SHAPE:
            shape = json.loads(data)
            continue
        try:
            if kind == wire.LOAD:
                module = execute(source)
                law = law_of(module)()
                said = [str(vars(module).get("EXERCISE", "")), line_of(module)]
                answer = wire.READY, wire.of_json(said)
            else:
                answer = _answered(law(rebuilt(shape, data, ask)))
        except InputError as error:
            answer = wire.FAULT, str(error).encode(errors="replace")
        except BaseException as error:
            answer = wire.FAULT, sentence(source.path, error).encode(errors="replace")
        if refused:
            answer = (
                wire.FAULT,
                f"{source.path}: a submission may not do that ({refused[0]})".encode(errors="replace"),
            )
        wire.write(told, *answer)


def _answered(found: Any) -> tuple[bytes, bytes]:
    try:
        array = np.array("" if found is None else found, float)
        if array.ndim <= 2 and array.size <= 10_000:
            return wire.TORQUE, wire.of_array(array)
        return wire.OTHER, f"an array of shape {array.shape}".encode()
    except (TypeError, ValueError):
        return wire.OTHER, ("nothing" if found is None else f"a {type(found).__name__}").encode()


def _nothing(_: Now) -> None:
    """The control law until a file is loaded."""
