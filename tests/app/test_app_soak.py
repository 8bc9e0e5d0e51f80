"""Two minutes of what `python -m benchmarks.soak` does for an hour: the server stays as it is."""

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
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.soak", *options, "--json", "-"],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode in (0, 1), done.stderr
    found = json.loads(done.stdout)
    assert found["faults"] == [], found
