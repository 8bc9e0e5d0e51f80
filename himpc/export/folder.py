"""The files of an exported controller."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from himpc.export.entries import PREFIX
from himpc.export.header import header, renamed
from himpc.export.image import Image
from himpc.export.link import linked
from himpc.export.objects import Target, object_code
from himpc.tick.kernel.arrays import Array

FILES = Path(__file__).parent / "files"
MOVE = 8
"""Largest number of values of a move in a recorded run."""


_MATHEMATICS = "`sin`, `cos`, `tan`, `atan2`, `hypot`, `exp` and `expm1`"
_ALSO = {
    "linux": ", and `sincos`, a GNU extension",
    "macos": ", and `__sincos_stret` and `bzero` of macOS",
}
"""Functions that a code generator calls in place of others, by system."""
_LOOP = """\
| `loop.cpp` | a loop in real time, with MuJoCo's C library as the robot. To build it, \
set MUJOCO to the folder of the Python package mujoco: \
`g++ -O2 -I$MUJOCO/include loop.cpp {object} $MUJOCO/libmujoco.so.* -Wl,-rpath,$MUJOCO -o loop` |
"""


class Move(NamedTuple):
    """A target that is dragged before a period: the period, the index of the task, and the values."""

    tick: int
    task: int
    values: Sequence[float]


class Recorded(NamedTuple):
    """A recorded run: the moves of targets, and the rows (ticks, 4, n) with q, v, the applied τ and the
    computed τ of every period."""

    moves: Sequence[Move]
    rows: Array


def files_of(
    image: Image,
    target: Target,
    torques: Sequence[float],
    recorded: Recorded,
    name: str,
    plant: bytes,
    prefix: str = PREFIX,
) -> Mapping[str, bytes]:
    """Returns the files of a controller for a target by their names.

    Args:
        image: the controller.
        target: the target of the code.
        torques: N·m, the largest torque of each joint.
        recorded: a run to replay.
        name: the name of the target.
        plant: the simulated robot, for MuJoCo's C library.
        prefix: the beginning of all names in C, and of the names of header and object file.
    """
    code = object_code(target, prefix)
    wasm = target.ending == "wasm"
    object_name = f"{prefix}.{target.ending}"
    own = ("himpc.mjs", "replay.mjs") if wasm else ("replay.c", "loop.cpp")
    manifest = {"target": name, "object": object_name, **image.manifest}
    return {
        object_name: linked(code) if wasm else code,
        "controller.bin": image.memory,
        "controller.json": (json.dumps(manifest, indent=1, allow_nan=False) + "\n").encode(),
        f"{prefix}.h": header(image.manifest, torques, prefix).encode(),
        **{name: renamed((FILES / name).read_text("utf-8"), prefix).encode() for name in own},
        "vector.bin": vector_of(recorded),
        "plant.mjb": plant,
        "README.md": _readme(image, target, name, object_name, len(recorded.rows), prefix).encode(),
    }


def vector_of(recorded: Recorded) -> bytes:
    """Returns a recorded run as bytes: the numbers of periods and of moves (int64), the moves, then the
    rows."""
    moves = np.zeros((len(recorded.moves), 3 + MOVE))
    for row, move in zip(moves, recorded.moves, strict=True):
        row[:3], row[3 : 3 + len(move.values)] = (move.tick, move.task, len(move.values)), move.values
    counts = np.array([len(recorded.rows), len(moves)], "<i8")
    return counts.tobytes() + moves.astype("<f8").tobytes() + recorded.rows.astype("<f8").tobytes()


def _readme(image: Image, target: Target, name: str, object_name: str, ticks: int, prefix: str) -> str:
    wasm = target.ending == "wasm"
    if wasm:
        commands, needs = "    node replay.mjs", "`sin`, `cos` and similar functions of JavaScript"
        extra = "| `himpc.mjs` | the JavaScript interface |\n| `replay.mjs` | replays `vector.bin` |\n"
    else:
        commands = f"    {target.compiler} -O2 replay.c {object_name} -lm -o replay\n    ./replay"
        needs = f"{_MATHEMATICS} of libm, `memcpy` and `memset`{_ALSO.get(name.rpartition('-')[2], '')}"
        extra = "| `replay.c` | replays `vector.bin` |\n" + _LOOP.format(object=object_name)
    return renamed((FILES / "README.md").read_text("utf-8"), prefix).format(
        controller=image.manifest["controller"],
        robot=image.manifest["robot"],
        period=image.manifest["period_s"],
        budget=f"{image.manifest['budget']:,.0f}",
        object=f"`{object_name}`",
        ticks=ticks,
        commands=commands,
        needs=needs,
        extra=extra,
    )
