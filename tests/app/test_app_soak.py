"""A moment of what `benchmarks.soak` and `benchmarks.switches` do for an hour: the server stays as it is."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_nothing_grows() -> None:
    """Memory of server and simulations, threads, handles; and over reloads. In a process of its own, which
    holds nothing of other tests."""
    options = ["--minutes", "2", "--clients", "2", "--reconnects", "50", "--scene", "planar3-hold"]
    found = json.loads(run("soak", *options, "--json", "-"))
    assert found["faults"] == [], found


def test_scenes_and_ghosts_that_are_left_are_given_back() -> None:
    """Two learners change them every two seconds."""
    options = ["--minutes", "0.25", "--clients", "2", "--every", "2", "--speed", "0.5"]
    lines = [json.loads(line) for line in run("switches", *options).splitlines()]
    assert lines[-1]["faults"] == [], lines


def run(benchmark: str, *options: str) -> str:
    """What it prints."""
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
