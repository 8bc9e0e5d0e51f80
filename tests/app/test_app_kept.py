"""A running simulation keeps no memory per tick, neither Python objects nor memory of libraries."""

from __future__ import annotations

import ctypes
import gc

import pytest

from app.link.choice import SceneChoice
from app.link.wire import packed
from app.worker.simulation import SimulationRunner
from lessons.scenes.run_spec import RunSpec

TICKS = 1000


class Allocated(ctypes.Structure):
    """`mallinfo2` of glibc: ten numbers, of which two are used."""

    _fields_ = [(name, ctypes.c_size_t) for name in (*"abcd", "mapped", *"fg", "used", *"ij")]


def allocated() -> int:
    """Returns the bytes that this process has allocated from the system."""
    gc.collect()
    library = ctypes.CDLL(None)
    if not hasattr(library, "mallinfo2"):
        pytest.skip("only glibc tells what is allocated")
    library.mallinfo2.restype = Allocated
    found = library.mallinfo2()
    return found.used + found.mapped


@pytest.mark.parametrize("scene", ["iiwa14-hold", "planar3-circle", "ridgeback-ur10-drag"])
def test_ticks_keep_nothing(scene: str) -> None:
    """A leak of 80 bytes per tick would be 5 MB per minute."""
    body = SimulationRunner(SceneChoice(RunSpec(scene)))

    def run() -> None:
        for _ in range(TICKS // 20):
            body.tick(20)
            body.write_poses()
            packed(body.status())

    try:
        for _ in range(2):  # afterwards the history of the last seconds is full
            run()
        before = allocated()
        run()
        assert allocated() - before < 8 * TICKS
    finally:
        body.close()
