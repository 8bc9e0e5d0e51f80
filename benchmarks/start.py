"""Measures the cost of a start: CPU and wall time until the page listens, and CPU time of lists, help and
compiling.

    python -m benchmarks.start [--runs 5] [--cold]

CPU time is the sum of user and system time. It is measured for the server's process alone, and for a command
with its children. The program prints medians of several runs. With `--cold` it also compiles everything once,
into a temporary folder.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from statistics import median

import tyro

LISTS = (["--help"], ["scenes"], ["controllers"], ["robots"], ["lessons"])
PAGES = ([], ["--lesson", "one-task"], ["--scene", "hold", "--urdf", "planar3"])
COMPILE = "from himpc.compilation.compiling import compile_all; compile_all(lambda *_: None)"


def cost(command: list[str], **environment: str) -> float:
    """Returns the CPU time of a command and its children, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, env={**os.environ, **environment}, capture_output=True, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def listening(arguments: list[str]) -> tuple[float, float]:
    """Returns (CPU time of the server, wall time), s, until the server prints that it is ready."""
    began = time.perf_counter()
    command = [sys.executable, "-m", "app", "--no-browser", "--port", "0", *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as server:
        assert server.stdout is not None and "ready at" in server.stdout.readline()
        wall = time.perf_counter() - began
        with open(f"/proc/{server.pid}/stat") as stat:
            fields = stat.read().rsplit(")", 1)[1].split()
        server.send_signal(signal.SIGINT)
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK"), wall


def main(runs: int = 5, cold: bool = False) -> None:
    """Does what the module says."""
    found: dict[str, float] = {}
    for words in LISTS:
        cpu = median(cost([sys.executable, "-m", "app", *words]) for _ in range(runs))
        found[f"himpc-lab {' '.join(words)}, CPU s"] = round(cpu, 3)
    for words in PAGES:
        times = zip(*(listening(words) for _ in range(runs)), strict=True)
        for kind, each in zip(("CPU", "wall"), times, strict=True):
            found[f"listening {' '.join(words)}, {kind} s"] = round(median(each), 3)
    if cold:
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-c", COMPILE]
            first = cost(command, NUMBA_CACHE_DIR=folder)
            found["compiling, CPU s"] = round(first - cost(command, NUMBA_CACHE_DIR=folder), 2)
    print(json.dumps(found, indent=2))


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
