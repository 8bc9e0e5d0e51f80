"""Compiles functions in a process of its own, so that all other processes run the code that is on disk.

A compiling process links the parts once more before it writes the code to disk. The results of the code in
its own memory therefore differ from those of the code on disk in the last digit. All processes that load the
code from disk run the same code.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable

_COMPILES = "HIMPC_LAB_COMPILES"  # variable that is set in the environment of a compiling process


def compiles_here() -> bool:
    """Returns whether this process was started to compile."""
    return _COMPILES in os.environ


def compile_apart(module: str, tell: Callable[[str], None]) -> None:
    """Compiles the functions of a module in a new process. If the module belongs to this package, all
    functions of the package are compiled. The call returns after the new process has ended, with or without
    success. The new process also ends if an exception is raised here or if this process ends.

    Args:
        module: its dotted name.
        tell: called with the dotted name of every compiled function.
    """
    with started(module, subprocess.PIPE) as child:
        try:
            assert child.stdout is not None
            for line in child.stdout:
                tell(line.strip())
        finally:
            child.kill()


def started(module: str, out: int, only_needed: bool = False) -> subprocess.Popen[str]:
    """Returns a process that compiles and writes the dotted names of compiled functions to the file `out`. It
    ends when this process ends or closes its pipe. only_needed: only the functions that the module needs are
    compiled, see `compiling.serve`."""
    code = (
        f"import sys; sys.path[:] = {sys.path!r}; "
        f"from himpc.compilation.compiling import serve; serve({module!r}, {only_needed!r})"
    )
    return subprocess.Popen(
        (sys.executable, "-c", code),
        stdin=subprocess.PIPE,  # nothing is written to this pipe; the child ends when the pipe is closed
        stdout=out,
        env={**os.environ, _COMPILES: "1", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        text=True,
        process_group=0 if os.name == "posix" else -1,  # the child ignores Ctrl-C, which this process handles
    )
