"""Short versions of `benchmarks.soak` and `benchmarks.switches`: the server's memory and handles stay
constant."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.nightly("app/link", "app/web", "benchmarks/soak.py", "benchmarks/switches.py")

ROOT = Path(__file__).parents[2]


def test_nothing_grows() -> None:
    """Memory of server and simulations, threads and handles stay constant, also over reloads. The benchmark
    runs in a process of its own, without the memory of other tests."""
    options = ["--minutes", "2", "--clients", "2", "--reconnects", "50", "--scene", "planar3-hold"]
    found = json.loads(run("soak", *options, "--json", "-"))
    assert found["faults"] == [], found


def test_scenes_and_ghosts_that_are_left_are_given_back() -> None:
    """Two learners change scenes and ghosts every two seconds; all memory and processes are released."""
    options = ["--minutes", "0.25", "--clients", "2", "--every", "2", "--speed", "0.5"]
    lines = [json.loads(line) for line in run("switches", *options).splitlines()]
    assert lines[-1]["faults"] == [], lines


def run(benchmark: str, *options: str) -> str:
    """Returns the output of a benchmark."""
    done = subprocess.run(
        [sys.executable, "-m", f"benchmarks.{benchmark}", *options],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode in (0, 1), done.stderr
    return done.stdout
