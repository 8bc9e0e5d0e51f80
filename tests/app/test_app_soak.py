"""Short versions of `benchmarks.soak`: the server's memory and handles stay constant."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.nightly(
    "app/client", "app/link", "app/page", "app/view", "app/web", "benchmarks/soak.py", "benchmarks/client.py"
)

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    "options",
    [
        pytest.param("--minutes 2 --clients 2 --reconnects 50 --scene planar3-hold", id="time and reloads"),
        pytest.param("--minutes 0.25 --clients 2 --every 2 --speed 0.5", id="scenes and ghosts"),
    ],
)
def test_nothing_grows(options: str) -> None:
    """Memory of server and simulations, threads and handles stay constant, over time, over reloads, and while
    learners change scenes and ghosts. The benchmark runs in a process of its own, without the memory of other
    tests."""
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.soak", *options.split()],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode in (0, 1), done.stderr
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert lines[-1]["faults"] == [], lines
