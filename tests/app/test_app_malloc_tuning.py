"""The server's threads share few arenas of the memory allocator. The tests use a process of its own, because
the option cannot be reset."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from app.web.malloc_tuning import ARENAS

ROOT = Path(__file__).parents[2]
COUNT = """
import ctypes, sys, threading
from app.web.malloc_tuning import few_arenas

if {few} and not few_arenas():
    sys.exit(3)
gate = threading.Barrier(7)
held = []


def hold():
    held.append(bytearray(10_000))
    gate.wait()


threads = [threading.Thread(target=hold) for _ in range(6)]
for each in threads:
    each.start()
gate.wait()
libc = ctypes.CDLL(None)
libc.fopen.restype = ctypes.c_void_p
stream = ctypes.c_void_p(libc.fopen(sys.argv[1].encode(), b"w"))
libc.malloc_info(0, stream)
libc.fclose(stream)
"""


def arenas(few: bool, report: Path) -> int:
    """Returns the number of arenas of a process in which six threads hold memory."""
    environment = {key: value for key, value in os.environ.items() if key != "MALLOC_ARENA_MAX"}
    subprocess.run(
        [sys.executable, "-c", COUNT.format(few=few), str(report)],
        cwd=ROOT,
        env={**environment, "PYTHONPATH": str(ROOT)},
        check=True,
    )
    return report.read_text().count("<heap nr=")


@pytest.mark.skipif("CS_GNU_LIBC_VERSION" not in os.confstr_names, reason="the option is glibc's")
def test_threads_share_few_arenas(tmp_path: Path) -> None:
    assert arenas(False, tmp_path / "as-it-is") > ARENAS
    assert arenas(True, tmp_path / "few") <= ARENAS


HOLES = """
import sys
import numpy as np
import psutil
from app.web.malloc_tuning import few_arenas, large_arrays_apart

few_arenas()
large_arrays_apart()
held, before = [], psutil.Process().memory_info().rss
scenes = 4 * [None]
for scene in range(40):
    # What a scene keeps of its run, written to, and between two scenes small things that stay.
    scenes[scene % 4] = [np.full(size, 1.0) for size in (300_000 + 20_000 * scene, 700_000)]
    held.append([bytes(900) for _ in range(200)])
scenes.clear()
print(1e-6 * (psutil.Process().memory_info().rss - before))
"""


@pytest.mark.skipif("CS_GNU_LIBC_VERSION" not in os.confstr_names, reason="the option is glibc's")
def test_what_a_scene_recorded_is_given_back_when_it_goes() -> None:
    """The memory of a scene's recording is released although small objects, which remain, were created in the
    meantime."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith("MALLOC_")}
    done = subprocess.run(
        [sys.executable, "-c", HOLES],
        cwd=ROOT,
        env={**environment, "PYTHONPATH": str(ROOT)},
        check=True,
        capture_output=True,
        text=True,
    )
    assert float(done.stdout) < 25.0  # MB, 8 of them for small objects; glibc alone keeps 85 MB
