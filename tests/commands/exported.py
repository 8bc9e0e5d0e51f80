"""Exported controllers for tests: builds what `himpc-lab export` wrote, and calls it from Python."""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.__main__ import main

N_P = np.ctypeslib.ndpointer(np.float64, flags="C")


def needed(*programs: str) -> None:
    """Skips the test if a program is missing here; in CI that is a failure."""
    missing = [each for each in programs if shutil.which(each) is None]
    if missing:
        if os.environ.get("CI") == "true":
            pytest.fail(f"{', '.join(missing)} missing")
        pytest.skip(f"needs {', '.join(missing)}")


def exported(scene: str, target: str, out: Path, *more: str) -> Path:
    """Runs the command; returns the folder."""
    assert main(["export", scene, "--target", target, "--out", str(out), *more]) == 0
    return out


def replayed(folder: Path, *more: str) -> tuple[int, float, str]:
    """Builds and runs the replay by the two lines of the folder's README; returns how many ticks, the largest
    difference (N·m), and the whole answer."""
    build, run = (
        line.strip() for line in (folder / "README.md").read_text().splitlines() if line[:4] == "    "
    )
    subprocess.run(build.split(), cwd=folder, check=True)
    answer = subprocess.run([*run.split(), *more], cwd=folder, capture_output=True, text=True)
    return told(answer.stdout + answer.stderr)


def told(answer: str) -> tuple[int, float, str]:
    """Ticks and largest difference of a replay's answer."""
    words = answer.split()
    return int(words[0]), float(words[words.index("difference") + 1]), answer


class Exported:
    """A controller of an exported folder, called through its C interface."""

    def __init__(self, folder: Path) -> None:
        library = folder / "himpc.so"
        if not library.exists():
            subprocess.run(
                ["cc", "-shared", "-o", library, folder / "himpc.o", "-lm"],
                check=True,
            )
        self._c = ctypes.CDLL(str(library))
        self._c.himpc_tick.argtypes = [ctypes.c_void_p, N_P, N_P, ctypes.c_void_p, N_P]
        self._c.himpc_set.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_int, N_P, ctypes.c_int]
        self._c.himpc_reset.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
        self._c.himpc_check.argtypes = [ctypes.c_void_p, ctypes.c_uint]
        self.manifest: dict[str, Any] = json.loads((folder / "controller.json").read_text())
        self.n = len(self.manifest["joints"])
        image = (folder / "controller.bin").read_bytes()
        self._room = np.zeros(len(image) // 8 + 8)
        start = -self._room.ctypes.data % 64
        self.memory = self._room.view(np.uint8)[start : start + len(image)]
        self.memory[:] = np.frombuffer(image, np.uint8)
        self.at = self.memory.ctypes.data
        assert self._c.himpc_check(self.at, len(image)) == 0
        self._c.himpc_reset(self.at, None)

    def check(self, size: int) -> int:
        """`himpc_check` of its memory."""
        return self._c.himpc_check(self.at, size)

    def tick(self, q: Any, v: Any, applied: Any = None) -> tuple[np.ndarray, int]:
        """One period: the torque, and which fallback acted."""
        given = [np.array(each, float) for each in (q, v)]
        torque = None if applied is None else np.array(applied, float)
        tau = np.full(self.n, np.nan)
        fallback = self._c.himpc_tick(self.at, *given, None if torque is None else torque.ctypes.data, tau)
        return tau, fallback

    def set(self, what: int, index: int, values: Any) -> int:
        """Changes a setting."""
        numbers = np.array(values, float).ravel()
        return self._c.himpc_set(self.at, what, index, numbers, numbers.size)

    def view(self, name: str) -> np.ndarray:
        """An array of the manifest, in its place."""
        (found,) = (each for each in self.manifest["arrays"] if each["name"] == name)
        count = int(np.prod(found["shape"]))
        part = self.memory[found["offset"] : found["offset"] + 8 * count]
        return part.view(found["type"]).reshape(found["shape"])


def rows_of(folder: Path, n: int) -> np.ndarray:
    """The recorded run: q, v, τ applied, τ of every tick, (ticks, 4, n)."""
    data = (folder / "vector.bin").read_bytes()
    ticks, moves = np.frombuffer(data[:16], np.int64)
    return np.frombuffer(data[16 + 88 * int(moves) :], float).reshape(int(ticks), 4, n)
