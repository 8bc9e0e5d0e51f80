"""A process of its own that compiles, so that everybody else runs the code that is on disk.

What a compiler holds in memory differs in the last digit from what it writes down: pieces are linked once
more on the way. Whoever loads runs the same code in every process; whoever compiled would not.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module

from robots.processes.orphans import end_with

_COMPILES = "HIMPC_LAB_COMPILES"  # in the environment of such a process


def compiles_here() -> bool:
    """Whether this process is one of them."""
    return _COMPILES in os.environ


def compile_apart(module: str, tell: Callable[[str], None]) -> None:
    """Has a module's functions compiled, of this package all that there are. Returns when that process has
    ended, whether it could or not; an exception raised here meanwhile, and whatever ends this process, ends
    it too.

    Args:
        module: its dotted name.
        tell: hears the dotted name of every function that was compiled.
    """
    code = (
        f"import sys; sys.path[:] = {sys.path!r}; "
        f"from himpc.compilation.compiler import serve; serve({module!r})"
    )
    with subprocess.Popen(
        (sys.executable, "-c", code),
        stdin=subprocess.PIPE,  # nothing is ever written to it: it tells that we are there
        stdout=subprocess.PIPE,
        env={**os.environ, _COMPILES: "1", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        text=True,
        process_group=0 if os.name == "posix" else -1,  # Ctrl-C is ours to answer
    ) as child:
        try:
            assert child.stdout is not None
            for line in child.stdout:
                tell(line.strip())
        finally:
            child.kill()


def serve(module: str) -> None:
    """The process itself."""
    end_with(0)
    # Whatever a module prints is not part of what we tell.
    with os.fdopen(os.dup(1), "w", buffering=1) as out:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        from himpc.compilation.compiled import on_compiled

        with on_compiled(lambda name: print(name, file=out)):
            import_module(module)
            if module.startswith("himpc."):
                from himpc.compilation.compiling import compile_all

                compile_all(lambda *_: None)
