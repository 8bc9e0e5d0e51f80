"""The number of the kernel for which a controller's memory was made."""

from __future__ import annotations

from functools import cache
from hashlib import sha256

from himpc.compilation.sources import digest_of
from himpc.export.kernel.loop_arrays import SHAPES
from himpc.export.kernel.whole_tick import control
from himpc.tick.kernel.arrays import NUMBERS, WHOLES
from himpc.tick.kernel.pair_arrays import PAIR_NUMBERS, PAIR_WHOLES


@cache
def layout_number() -> int:
    """Returns a number that is different for every version of the kernel's sources. A kernel refuses a memory
    with another number."""
    tables = repr((NUMBERS, WHOLES, SHAPES, PAIR_NUMBERS, PAIR_WHOLES)).encode()
    return int.from_bytes(sha256(tables + digest_of(control.py_func)).digest()[:7], "little")
