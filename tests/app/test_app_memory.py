"""Memory: a tick keeps none, nor does a scene that was left, in Python's objects or in the libraries. Free
memory is given back."""

from __future__ import annotations

import ctypes
import gc
import json
import os
import pickle
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

from app.client.recording import Recording
from app.link.choice import SceneChoice
from app.web.malloc_tuning import ARENAS
from app.worker.simulation import SimulationRunner
from lessons.scenes.run_spec import RunSpec

ROOT = Path(__file__).parents[2]


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
    ("run_spec", "ticks"),
    [
        *((RunSpec(scene), 1000) for scene in ("iiwa14-hold", "planar3-circle")),
        *(pytest.param(each, 300, marks=SLOW) for each in (RunSpec("ridgeback-ur10-drag"), PLACO)),
    ],
    ids=str,
)
def test_ticks_keep_nothing(run_spec: RunSpec, ticks: int) -> None:
    """The blocks are Python's small objects: one per tick would be seen. Of what libraries allocate, 8 bytes
    per tick would be seen; at torque level they would be half a megabyte per minute."""
    body = SimulationRunner(SceneChoice(run_spec))

    def run() -> None:
        for _ in range(ticks // 20):
            body.tick(20)
            body.write_poses()
            pickle.dumps(body.status())

    try:
        for _ in range(2):  # after this, the memory for the last seconds is full
            run()
        before, blocks = allocated(), sys.getallocatedblocks()
        run()
        assert allocated() - before < 8000
        assert sys.getallocatedblocks() - blocks < 0.7 * ticks
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


def test_the_newest_row_does_not_keep_all_that_came_with_it() -> None:
    """As a view, the row would keep all rows in memory until the next call, up to 12 MB per robot."""
    body = SimulationRunner(SceneChoice(RunSpec("planar3-hold")))
    recording = Recording(body.block, body.session.layout)
    body.tick(50)
    recording.pull()
    body.close()
    assert recording.latest.base is None and np.isfinite(recording.latest[0])


PROGRAM = """
import ctypes, sys, threading
import numpy as np
import psutil
from app.web.malloc_tuning import few_arenas, large_arrays_apart

if sys.argv[2] == "tuned":
    assert few_arenas() and large_arrays_apart()
gate, kept = threading.Barrier(7), []


def hold():
    kept.append(bytearray(10_000))
    gate.wait()


for _ in range(6):
    threading.Thread(target=hold).start()
gate.wait()
libc = ctypes.CDLL(None)
libc.fopen.restype = ctypes.c_void_p
stream = ctypes.c_void_p(libc.fopen(sys.argv[1].encode(), b"w"))
libc.malloc_info(0, stream)
libc.fclose(stream)
before, scenes = psutil.Process().memory_info().rss, 4 * [None]
for scene in range(40):
    # What a scene keeps of its run, written to, and between two scenes small things that stay.
    scenes[scene % 4] = [np.full(size, 1.0) for size in (300_000 + 20_000 * scene, 700_000)]
    kept.append([bytes(900) for _ in range(200)])
scenes.clear()
print(1e-6 * (psutil.Process().memory_info().rss - before))
"""


@pytest.mark.skipif("CS_GNU_LIBC_VERSION" not in os.confstr_names, reason="the options are glibc's")
@pytest.mark.parametrize("how", ["tuned", "as it is"])
def test_the_options_of_the_allocator_take_effect(how: str, tmp_path: Path) -> None:
    """Six threads hold memory, and the memory of a scene's recording is released although small objects,
    which remain, were created in the meantime: 8 MB of them. glibc alone keeps 85 MB."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith("MALLOC_")}
    report = tmp_path / "report"
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(report), how],
        cwd=ROOT,
        env={**environment, "PYTHONPATH": str(ROOT)},
        check=True,
        capture_output=True,
        text=True,
    )
    found = report.read_text().count("<heap nr=") <= ARENAS, float(done.stdout) < 25.0
    assert found == ((True, True) if how == "tuned" else (False, False))


@pytest.mark.nightly(
    "app/client", "app/link", "app/page", "app/view", "app/web", "benchmarks/soak.py", "benchmarks/client.py"
)
@pytest.mark.parametrize(
    "options",
    [
        pytest.param(
            "--minutes 1.2 --clients 2 --reconnects 50 --scene planar3-hold --speed 4", id="time and reloads"
        ),
        pytest.param("--minutes 0.25 --every 2 --speed 0.5", id="scenes and ghosts"),
    ],
)
def test_nothing_grows(options: str) -> None:
    """Memory of server and simulations, threads and handles stay constant, over time, over reloads, and while
    learners change scenes and ghosts. The benchmark runs in a process of its own, without the memory of other
    tests."""
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.soak", "--clients", "2", *options.split()],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode in (0, 1), done.stderr
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert lines[-1]["faults"] == [], lines
