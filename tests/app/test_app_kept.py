"""Ticks of a simulation, and scenes that a learner has left, keep no memory, neither in Python's objects nor
in the libraries."""

from __future__ import annotations

import ctypes
import gc
import pickle
import re
import tempfile

import pytest

from app.link.choice import SceneChoice
from app.worker.simulation import SimulationRunner
from lessons.scenes.run_spec import RunSpec

TICKS = 1000


def allocated() -> int:
    """Returns the bytes that this process has allocated from the system, in all arenas."""
    gc.collect()
    library = ctypes.CDLL(None)
    if not hasattr(library, "malloc_info"):
        pytest.skip("only glibc tells what is allocated")
    library.fopen.restype = ctypes.c_void_p
    with tempfile.NamedTemporaryFile("r") as report:
        file = ctypes.c_void_p(library.fopen(report.name.encode(), b"w"))
        library.malloc_info(0, file)
        library.fclose(file)
        text = report.read()
    text = text[text.rindex("</heap>") :]  # the sums of all arenas come last
    size = {kind: int(found) for kind, found in re.findall(r'type="(\w+)"[^/]*size="(\d+)"', text)}
    return size["current"] + size["mmap"] - size["fast"] - size["rest"]


PLACO = RunSpec("iiwa14-htmpc", controller="placo")


SLOW = pytest.mark.nightly("app/client", "app/worker", "himpc/htmpc", "lessons/session")


@pytest.mark.parametrize(
    "run_spec",
    [
        *map(RunSpec, ("iiwa14-hold", "planar3-circle")),
        *(pytest.param(each, marks=SLOW) for each in (RunSpec("ridgeback-ur10-drag"), PLACO)),
    ],
    ids=str,
)
def test_ticks_keep_nothing(run_spec: RunSpec) -> None:
    """A leak of 80 bytes per tick would be 5 MB per minute."""
    body = SimulationRunner(SceneChoice(run_spec))

    def run() -> None:
        for _ in range(TICKS // 20):
            body.tick(20)
            body.write_poses()
            pickle.dumps(body.status())

    try:
        for _ in range(2):  # after this, the memory for the last seconds is full
            run()
        before = allocated()
        run()
        assert allocated() - before < 8 * TICKS
    finally:
        body.close()


def test_ten_changes_of_the_scene_make_one_robot_of_placo() -> None:
    """placo never frees a robot, of which each has 0.2 MB: ten scenes with placo must not have ten."""

    def visit(times: int) -> int:
        for _ in range(times):
            body = SimulationRunner(SceneChoice(PLACO))
            body.tick(20)
            body.close()
        return allocated()

    visit(3)
    before = visit(1)
    assert visit(10) - before < 500_000
