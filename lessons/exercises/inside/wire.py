"""Messages between the lab and the process of a submission: kind, length and bytes. Nothing is unpickled."""

from __future__ import annotations

import json
import os
from struct import Struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LOAD = b"L"
"""To the process that is copied: JSON with the path and the text of the submission. The answer is READY."""
SHAPE = b"S"
"""To the submission: the description of the numbers of the next ticks, see `now.shape_of`. There is no
answer."""
TICK = b"T"
"""To the submission: the numbers of a tick. The answer is TORQUE, OTHER or FAULT; ASK may come first."""
REPLY = b"R"
"""To the submission: the requested matrix."""
READY = b"Y"
"""From the submission: JSON with the mechanisms that are in force, before the file is executed, and then with
the data of the file, such as its exercise."""
TORQUE = b"U"
"""From the submission: an array."""
OTHER = b"O"
"""From the submission: the type of a returned value that is not an array of numbers."""
FAULT = b"F"
"""From the submission: one sentence about its fault."""
ASK = b"A"
"""From the submission: a call of a function of the model, in JSON. The answer is REPLY or FAULT."""

HEADER = Struct("<cI")
LARGEST = 1 << 20  # bytes of a message, far more than the torques of any robot need
_RANK = Struct("<B")
_SIDE = Struct("<I")


def packed(kind: bytes, data: bytes) -> bytes:
    """Returns a message as bytes for a pipe."""
    return HEADER.pack(kind, len(data)) + data


def of_json(value: Any) -> bytes:
    return json.dumps(value).encode()


def of_array(values: Array) -> bytes:
    """Returns an array and its shape as bytes."""
    sides = b"".join(_SIDE.pack(side) for side in values.shape)
    return _RANK.pack(values.ndim) + sides + np.ascontiguousarray(values, float).tobytes()


def array_of(data: bytes) -> Array:
    """Returns the array, read-only. Raises ValueError for bytes that do not contain an array."""
    if not data or len(data) < 1 + 4 * data[0]:
        raise ValueError("no shape")
    begin = 1 + 4 * data[0]
    shape = tuple(side for (side,) in _SIDE.iter_unpack(data[1:begin]))
    return np.frombuffer(data, float, offset=begin).reshape(shape)


def write(pipe: int, kind: bytes, data: bytes) -> None:
    """Writes a message, without a deadline. Raises OSError."""
    left = memoryview(packed(kind, data))
    while left:
        left = left[os.write(pipe, left) :]


def read(pipe: int) -> tuple[bytes, bytes]:
    """Returns the next message, without a deadline. Raises EOFError if the other side has closed the pipe."""
    kind, length = HEADER.unpack(_exactly(pipe, HEADER.size))
    return kind, _exactly(pipe, length)


def _exactly(pipe: int, count: int) -> bytes:
    data = b""
    while len(data) < count:
        more = os.read(pipe, count - len(data))
        if not more:
            raise EOFError
        data += more
    return data
