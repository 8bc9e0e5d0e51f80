"""Functions for tests of exported controllers: they build what `himpc-lab export` wrote, and call it from
Python."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.__main__ import main
from himpc.export.native import NativeController, link


def needed(*programs: str) -> None:
    """Skips the test if a program is missing here. In CI the test fails instead."""
    missing = [each for each in programs if shutil.which(each) is None]
    if missing:
        if os.environ.get("CI") == "true":
            pytest.fail(f"{', '.join(missing)} missing")
        pytest.skip(f"needs {', '.join(missing)}")


def exported(scene: str, target: str, out: Path, *more: str) -> Path:
    """Runs `himpc-lab export` and returns the folder."""
    assert main(["export", scene, "--target", target, "--out", str(out), *more]) == 0
    return out


def replayed(folder: Path, *more: str) -> tuple[int, float, str]:
    """Builds and runs the replay by the two lines of the folder's README. Returns the number of ticks, the
    largest difference (N·m), and the whole answer."""
    build, run = (
        line.strip() for line in (folder / "README.md").read_text().splitlines() if line[:4] == "    "
    )
    subprocess.run(build.split(), cwd=folder, check=True)
    answer = subprocess.run([*run.split(), *more], cwd=folder, capture_output=True, text=True)
    return told(answer.stdout + answer.stderr)


def told(answer: str) -> tuple[int, float, str]:
    """Returns the number of ticks and the largest difference in a replay's answer, and the answer."""
    words = answer.split()
    return int(words[0]), float(words[words.index("difference") + 1]), answer


def controller_in(folder: Path) -> NativeController:
    """Returns the controller of an exported folder, called through its C interface."""
    library = folder / "himpc.so"
    if not library.exists():
        link(folder / "himpc.o", library)
    manifest: dict[str, Any] = json.loads((folder / "controller.json").read_text())
    return NativeController(library, (folder / "controller.bin").read_bytes(), manifest)


def rows_of(folder: Path, n: int) -> np.ndarray:
    """Returns the recorded run: q, v, τ applied, τ of every tick, (ticks, 4, n)."""
    data = (folder / "vector.bin").read_bytes()
    ticks, moves = np.frombuffer(data[:16], np.int64)
    return np.frombuffer(data[16 + 88 * int(moves) :], float).reshape(int(ticks), 4, n)
